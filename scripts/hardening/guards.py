#!/usr/bin/env python3
"""Breaks each guard in a copy of the repository, and prints the tests that notice it: `scripts/hardening/guards.py [WORD…]` for guards
whose line contains a word. Results stay in target/hardening/guards/found.json and are not repeated at the same commit; delete it to
start again."""
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WORK = ROOT / "target/hardening/guards"

# Guard, file, its text, the replacement that breaks it, and the package whose tests must notice, followed by words of the tests' names if
# all its tests would take too long.
GUARDS = [
    # Sizes of the input of decoders.
    ("file: length before it is read", "crates/files/src/bounded.rs", "if length > max_bytes {", "if length > u64::MAX - 1 {", "sdg-files"),
    ("file or pipe: length while it is read", "crates/files/src/bounded.rs", "if bytes.len() as u64 > max_bytes {", "if bytes.len() as u64 > u64::MAX - 1 {", "sdg-files"),
    ("picture: pixels by its header", "crates/picture/src/decode.rs", "if u64::from(width) * u64::from(height) > limits.max_pixels {", "if u64::from(width) * u64::from(height) > u64::MAX - 1 {", "sdg-picture"),
    ("picture: pixels of a JPEG before it is completed", "crates/picture/src/decode.rs", "            if let Ok((width, height)) = header {\n                check_size(width, height, limits)?;\n            }", "            let _ = header;", "sdg-picture"),
    ("picture: the decoder's memory", "crates/picture/src/decode.rs", "allocation.max_alloc = Some(limits.max_bytes());", "allocation.max_alloc = None;", "sdg-picture"),
    ("PPM: pixels", "crates/picture/src/ppm.rs", "u64::from(width) * u64::from(height) <= MAX_PIXELS", "u64::from(width) * u64::from(height) <= u64::MAX", "sdg-picture"),
    ("PPM: sides", "crates/picture/src/ppm.rs", "let is_bounded = width <= MAX_SIDE && height <= MAX_SIDE && ", "let is_bounded = ", "sdg-picture"),
    ("PPM: head", "crates/picture/src/ppm.rs", "None if at > Self::MAX_BYTES", "None if at > usize::MAX - 1", "sdg-picture"),
    ("TIFF: pages", "crates/picture/src/tiff.rs", "if pages.len() > MAX_PAGES {", "if pages.len() > usize::MAX - 1 {", "sdg-picture"),
    ("TIFF: values of the main page's tags", "crates/picture/src/tiff.rs", "    page.check_values(&file)?;\n", "", "sdg-picture"),
    ("WebP: size of a frame", "crates/picture/src/webp.rs", "if is_inside && Some(found) == announced {", "if is_inside || !is_inside {", "sdg-picture"),
    ("WebP: bytes of an Exif block", "crates/picture/src/webp.rs", "if chunk.name == b\"EXIF\" && chunk.is_cut {", "if false {", "sdg-picture"),
    ("TIFF: subdirectories", "crates/picture/src/tiff.rs", "entry.count > MAX_PAGES as u64", "entry.count > u64::MAX - 1", "sdg-picture"),
    ("TIFF: tags of a page", "crates/picture/src/tiff.rs", ".filter(|count| *count <= MAX_ENTRIES)?", "?", "sdg-picture"),
    ("TIFF: values of a tag", "crates/picture/src/tiff.rs", "self.count.min(MAX_VALUES)", "self.count", "sdg-picture"),
    ("JPEG: tested stretches", "crates/picture/src/jpeg_gap.rs", ".clamp(1, MAX_TESTED)", ".max(u64::MAX - 1)", "sdg-picture"),
    ("marks: vertices of an outline", "crates/demonstration/src/draft.rs", " || vertices.len() > MAX_VERTICES", "", "sdg-demonstration"),
    ("marks: bytes of a label", "crates/demonstration/src/draft.rs", "if label.len() > MAX_LABEL_BYTES {", "if label.len() > usize::MAX - 1 {", "sdg-demonstration"),
    ("marks: objects of a JSON file", "crates/demonstration/src/json.rs", "if braces > max_objects {", "if braces > usize::MAX - 1 {", "sdg-demonstration"),
    ("COCO: annotations times categories", "crates/demonstration/src/coco.rs", "if of_image.len().saturating_mul(categories.len()) > MAX_COMPARISONS {", "if of_image.len().saturating_mul(categories.len()) > usize::MAX - 1 {", "sdg-demonstration"),
    ("marks: samples along a border", "crates/demonstration/src/reading.rs", ".sum::<f64>() / MAX_BORDER_SAMPLES).max(1.0);", ".sum::<f64>() / 1e12).max(1.0);", "sdg-demonstration"),
    ("YOLO: objects of a file", "crates/demonstration/src/yolo_pose.rs", "if objects.len() == MAX_OBJECTS {", "if objects.len() == usize::MAX {", "sdg-demonstration"),
    ("data.yaml: classes", "crates/demonstration/src/data_yaml.rs", "if class >= MAX_NAMES {", "if class >= usize::MAX {", "sdg-demonstration"),
    ("npy: dimensions", "crates/demonstration/src/npy.rs", ".filter(|sides| sides.len() <= MAX_DIMENSIONS)", "", "sdg-demonstration"),
    ("npy: bytes of the shape", "crates/demonstration/src/npy.rs", "if expected != Some(elements.len()) {", "if expected.is_none() {", "sdg-demonstration"),
    ("pickle: operations", "weights-conversion/src/pickle/machine.rs", "if total > u64::from(MAX_OPERATIONS) {", "if total > u64::MAX - 1 {", "sdg-weights-conversion"),
    ("pickle: arguments of a call", "weights-conversion/src/pickle/machine.rs", "if items.len() > MAX_ARGUMENTS {", "if items.len() > usize::MAX - 1 {", "sdg-weights-conversion"),
    ("pickle: sizes of a shape", "weights-conversion/src/pickle/object.rs", "if items.len() > MAX_AXES {", "if items.len() > usize::MAX - 1 {", "sdg-weights-conversion"),
    ("tensor: sizes of a shape", "weights-conversion/src/tensor.rs", "if shape.len() > MAX_AXES {", "if shape.len() > usize::MAX - 1 {", "sdg-weights-conversion"),
    ("checkpoint: bytes of all tensors", "weights-conversion/src/checkpoint.rs", "if total > most {", "if total > u64::MAX - 1 {", "sdg-weights-conversion"),
    ("zip: entries", "weights-conversion/src/zip_archive.rs", "if count > MAX_ENTRIES || ", "if ", "sdg-weights-conversion"),
    ("zip: bytes of the directory", "weights-conversion/src/zip_archive.rs", "count > MAX_ENTRIES || directory.len > MAX_DIRECTORY_BYTES", "count > MAX_ENTRIES", "sdg-weights-conversion"),
    ("zip: entries that overlap", "weights-conversion/src/zip_archive.rs", "if total > source.len() {", "if total > u64::MAX - 1 {", "sdg-weights-conversion"),
    ("zip: checksum", "weights-conversion/src/zip_archive.rs", "if found != entry.crc32 {", "if false && found != entry.crc32 {", "sdg-weights-conversion"),
    ("safetensors: bytes of the header", "weights-conversion/src/safetensors_file.rs", "if header_len > MAX_HEADER_BYTES {", "if header_len > u64::MAX - 1 {", "sdg-weights-conversion"),
    ("safetensors: places of tensors", "weights-conversion/src/safetensors_file.rs", "if start != end || stop < start {", "if stop < start {", "sdg-weights-conversion"),
    ("model: demonstrations", "crates/grasp/src/cutout_budget.rs", "1..=MAX_DEMONSTRATIONS => Ok(()),", "1..=1_000_000 => Ok(()),", "sdg-grasp model_file cutout_budget lengths"),
    ("model: pixels of a cut-out by its marks", "crates/grasp/src/cutout_budget.rs", "ImageLimits { max_pixels: pixels.min(self.pixels) }", "let _ = pixels;\n        ImageLimits { max_pixels: self.pixels }", "sdg-grasp model_file cutout_budget lengths"),
    ("model: pixels of all cut-outs", "crates/grasp/src/cutout_budget.rs", "            .checked_sub(pixels)\n            .ok_or(", "            .checked_sub(pixels.min(1))\n            .ok_or(", "sdg-grasp model_file cutout_budget lengths"),
    ("model: pixels of all cut-outs when resized", "crates/grasp/src/cutout_budget.rs", "if self.resized < 0.0 {", "if self.resized < f64::MIN {", "sdg-grasp model_file cutout_budget lengths"),
    ("model: vertices of an outline", "crates/grasp/src/taught.rs", "outline.thinned(MAX_VERTICES)", "outline.thinned(1_000_000)", "sdg-grasp model_file cutout_budget lengths"),
    ("model: lengths", "crates/grasp/src/model_file.rs", "        lengths.check()?;\n", "        let _ = lengths;\n", "sdg-grasp model_file cutout_budget lengths"),
    ("model: turns of a symmetry", "crates/grasp/src/model_file.rs", "&& !(1..=MAX_TURNS).contains(&turns)", "&& turns == u32::MAX", "sdg-grasp model_file cutout_budget lengths"),
    ("model: sides of a photo", "crates/grasp/src/model_file.rs", "&& *width.min(height) == 0", "&& *width.min(height) == u32::MAX", "sdg-grasp model_file cutout_budget lengths"),
    ("model: centre of a photo", "crates/grasp/src/model_file.rs", "&& x.abs().max(y.abs()) > max_px", "&& x.abs().max(y.abs()) > f64::MAX", "sdg-grasp model_file cutout_budget lengths"),
    ("detector: side of the resized image", "crates/detection/src/config_check.rs", "(1..=MAX_SIDE_PX).contains(&w) && (1..=MAX_SIDE_PX).contains(&h),", "w > 0 && h > 0,", "sdg-detection config_check"),
    ("detector: multiple of its sides", "crates/detection/src/config_check.rs", "is_multiple_of(32) && (32..=1024).contains(&self.input.size_divisibility),", "is_multiple_of(32),", "sdg-detection config_check"),
    ("detector: blocks of a stage", "crates/detection/src/config_check.rs", "(1..=MAX_BLOCKS).contains(n)", "*n > 0", "sdg-detection config_check"),
    ("detector: shapes of anchors", "crates/detection/src/config_check.rs", "(1..=MAX_LIST).contains(&self.anchors.aspect_ratios.len())", "!self.anchors.aspect_ratios.is_empty()", "sdg-detection config_check"),
    ("detector: boxes of a level", "crates/detection/src/config_check.rs", "            pre_nms <= MAX_PRE_NMS,", "            pre_nms < usize::MAX,", "sdg-detection config_check"),
    ("detector: convolutions of the keypoint head", "crates/detection/src/config_check.rs", "                (1..=MAX_LIST).contains(&head.conv_channels.len()),", "                !head.conv_channels.is_empty(),", "sdg-detection config_check"),
    ("detector: convolutions of the mask head", "crates/detection/src/config_check.rs", "                (1..=MAX_LIST).contains(&head.conv_channels.len())\n                    && ", "                ", "sdg-detection config_check"),
    ("detector: cells of a pooled square", "crates/detection/src/config_check.rs", "(1..=MAX_POOLED).contains(&pooler.output_size) && ", "pooler.output_size > 0 && ", "sdg-detection config_check"),
    ("detector: samples of a cell", "crates/detection/src/config_check.rs", " && (1..=MAX_POOLED).contains(&samples),", ",", "sdg-detection config_check"),
    ("detector: values of a layer's output", "crates/detection/src/config_check.rs", "check(count <= MAX_OUTPUT_VALUES, field,", "check(count <= f64::MAX, field,", "sdg-detection config_check"),
    ("workcell: cells of a tray", "crates/robot/src/workcell/place_sections.rs", "(1..=MAX_CELLS).contains(&i64::from(count))", "(1..).contains(&i64::from(count))", "sdg-robot"),
    # Input from cameras and browsers.
    ("camera over HTTP: head", "crates/camera/src/http/exchange.rs", "if bytes.len() > MAX_HEAD_BYTES {", "if bytes.len() > usize::MAX - 1 {", "sdg-camera"),
    ("camera over HTTP: redirects", "crates/camera/src/http/exchange.rs", "for _ in 0..=MAX_REDIRECTS {", "for _ in 0..=1_000_000 {", "sdg-camera"),
    ("camera over HTTP: a chunk's line", "crates/camera/src/http/body.rs", "if line.len() > MAX_CHUNK_LINE_BYTES {", "if line.len() > usize::MAX - 1 {", "sdg-camera"),
    ("camera over HTTP: a picture's bytes", "crates/camera/src/http/snapshots.rs", "Ok(Progress::More) if bytes.len() > MAX_ENCODED_BYTES =>", "Ok(Progress::More) if bytes.len() > usize::MAX - 1 =>", "sdg-camera"),
    ("motion JPEG: a part's head", "crates/camera/src/http/multipart.rs", "if self.buffer.len() > MAX_HEAD_BYTES {", "if self.buffer.len() > usize::MAX - 1 {", "sdg-camera"),
    ("motion JPEG: a part's announced length", "crates/camera/src/http/multipart.rs", ".filter(|length| *length <= MAX_ENCODED_BYTES)", "", "sdg-camera"),
    ("motion JPEG: a part without length", "crates/camera/src/http/multipart.rs", "if self.buffer.len() > MAX_ENCODED_BYTES {", "if self.buffer.len() > usize::MAX - 1 {", "sdg-camera"),
    ("program's pictures: a picture's bytes", "crates/camera/src/splitter.rs", "Extent::NotYet if bytes.len() > MAX_ENCODED_BYTES =>", "Extent::NotYet if bytes.len() > usize::MAX - 1 =>", "sdg-camera"),
    ("program's pictures: a PNG's part", "crates/camera/src/splitter.rs", "if length > MAX_ENCODED_BYTES {", "if length > usize::MAX - 1 {", "sdg-camera"),
    ("program's pictures: bytes that belong to no picture", "crates/camera/src/splitter.rs", "if self.garbage_bytes >= MAX_GARBAGE_BYTES {", "if self.garbage_bytes >= usize::MAX {", "sdg-camera"),
    ("camera over HTTP: the password stays with its host", "crates/camera/src/http/url.rs", "if url.authority == self.authority && url.credentials.is_none() {", "if url.credentials.is_none() {", "sdg-camera"),
    ("latest frame: errors that are kept", "crates/camera/src/latest.rs", "if newest.errors.len() == MAX_ERRORS {", "if newest.errors.len() == usize::MAX {", "sdg-camera"),
    ("live page: Host", "crates/camera/src/server.rs", "if !(hosts.next().is_some_and(|host| is_own(&host)) && hosts.next().is_none()) {", "if hosts.next().is_none() {", "sdg-camera"),
    ("live page: Origin", "crates/camera/src/server.rs", "if !values(\"origin\").all(|origin| origin.strip_prefix(\"http://\").is_some_and(is_own)) {", "if values(\"origin\").count() > 9 {", "sdg-camera"),
    ("live page: a request's bytes", "crates/camera/src/server.rs", "Ok(httparse::Status::Partial) if bytes.len() <= MAX_REQUEST_BYTES => {}", "Ok(httparse::Status::Partial) => {}", "sdg-camera"),
    ("live page: connections", "crates/camera/src/server.rs", ">= MAX_CONNECTIONS {", ">= usize::MAX {", "sdg-camera"),
    ("page: token", "crates/annotate/src/guard.rs", "if self.carries_token(head) { Ok(()) } else { Err(Refusal::Token) }", "Ok(())", "sdg-annotate"),
    ("page: the token's bytes", "crates/annotate/src/guard.rs", ".fold(0, |differs, (a, b)| differs | (a ^ b)) == 0", ".count() == self.token.len()", "sdg-annotate"),
    ("page: Host", "crates/annotate/src/guard.rs", "if !(hosts.next().is_some_and(is_own) && hosts.next().is_none()) {", "if hosts.next().is_none() {", "sdg-annotate"),
    ("page: a second Host", "crates/annotate/src/guard.rs", "hosts.next().is_some_and(is_own) && hosts.next().is_none()", "hosts.next().is_some_and(is_own)", "sdg-annotate"),
    ("page: Origin", "crates/annotate/src/guard.rs", "if !head.all(\"origin\").all(|origin| origin.strip_prefix(\"http://\").is_some_and(is_own)) {", "if head.all(\"origin\").count() > 9 {", "sdg-annotate"),
    ("page: the guard before the body", "crates/annotate/src/server.rs", "self.guard.check(&head).map_err(|refusal| refusal.answer())?;", "let _ = self.guard.check(&head);", "sdg-annotate"),
    ("page: a body's length", "crates/annotate/src/server.rs", "if length > routes::max_body_bytes(&head.path) as u64 {", "if length > u64::MAX - 1 {", "sdg-annotate"),
    ("page: a body without length", "crates/annotate/src/server.rs", "let Some(length) = body.size_hint().exact() else {\n            return Err(Response::plain(411, \"expected a body with Content-Length\\n\"));\n        };", "let length = body.size_hint().lower();", "sdg-annotate"),
    ("page: a head's bytes", "crates/annotate/src/server.rs", ".max_header_size(MAX_HEAD_BYTES)", "", "sdg-annotate"),
    ("page: a head's lines", "crates/annotate/src/server.rs", ".max_headers(MAX_HEADERS)", ".max_headers(4096)", "sdg-annotate"),
    ("page: a head that does not come", "crates/annotate/src/server.rs", ".header_read_timeout(patience)", ".header_read_timeout(Duration::from_secs(600))", "sdg-annotate"),
    ("page: a body that does not come", "crates/annotate/src/server.rs", "timeout(patience, body.frame())", "timeout(Duration::from_secs(600), body.frame())", "sdg-annotate"),
    ("page: the session of the numbers", "crates/annotate/src/routes/mod.rs", "if head.all(SESSION_HEADER).any(|id| session.as_ref().is_none_or(|session| id != session.id())) {", "if false {", "sdg-annotate"),
    ("page: strokes of an outline", "crates/annotate/src/routes/images.rs", "if strokes.len() > MAX_STROKES || most > MAX_POINTS {", "if false && (strokes.len() > MAX_STROKES || most > MAX_POINTS) {", "sdg-annotate"),
    ("page: pictures to try", "crates/annotate/src/session/tried.rs", "if self.trial_ids().count() < MAX_TRIAL_PICTURES {", "if self.trial_ids().count() < usize::MAX {", "sdg-annotate"),
    ("page: letters of a name", "crates/annotate/src/session.rs", "if count == 0 || count > MAX_LABEL_CHARS || ", "if count == 0 || ", "sdg-annotate"),
    # Franka's protocol.
    ("Franka: a message's announced size", "crates/fci/src/wire/header.rs", " || header.size > MAX_MESSAGE_SIZE {", " {", "sdg-fci"),
    ("Franka: a size below the header's", "crates/fci/src/wire/header.rs", "if (header.size as usize) < kind.size() || ", "if ", "sdg-fci"),
    ("Franka: memory as bytes arrive", "crates/fci/src/message.rs", "let step = STEP.min(size - arrived);", "let step = size - arrived;", "sdg-fci"),
    ("Franka's client: states in order", "crates/fci/src/client/robot.rs", "if state.message_id > self.state.message_id || self.recent.is_empty() {", "if state.message_id > 0 || self.recent.is_empty() {", "sdg-fci"),
    ("Franka's client: datagrams of its robot alone", "crates/fci/src/client/session.rs", "if from.ip() != self.address.ip() {", "if false && from.ip() != self.address.ip() {", "sdg-fci"),
    ("Franka's client: the answer of its request", "crates/fci/src/client/session.rs", "|(header, _)| header.command_id == id)?;", "|(header, _)| header.command_id == id || true)?;", "sdg-fci"),
    ("Franka's client: commands are finite", "crates/fci/src/client/control.rs", "|value| !value.is_finite()) {\n        None => Ok(()),", "|value| value.is_infinite() && value.is_nan()) {\n        None => Ok(()),", "sdg-fci"),
    ("Franka's server: answers to the present state alone", "crates/fci/src/server/run.rs", "Ok(command) if command.message_id == self.robot.time_ms() => return Some(command),", "Ok(command) if command.message_id <= self.robot.time_ms() => return Some(command),", "sdg-fci"),
    ("Franka's server: datagrams of its client alone", "crates/fci/src/server/link.rs", "Ok((length, from)) if from == peer => return Some(length),", "Ok((length, _)) => return Some(length),", "sdg-fci"),
    ("Franka's server: commands lost in a row", "crates/fci/src/server/communication.rs", "self.lost_in_a_row >= if", "self.lost_in_a_row.saturating_sub(100_000) >= if", "sdg-fci"),
    ("Franka's server: positions are finite", "crates/fci/src/server/motion.rs", "MotionGeneratorMode::JointPosition if !is_finite(&command.q) => {", "MotionGeneratorMode::JointPosition if false && !is_finite(&command.q) => {", "sdg-fci"),
    # ROS 2.
    ("CDR: a sequence's length", "crates/ros2/src/cdr.rs", "if count > most {", "if count > usize::MAX - 1 {", "sdg-ros2"),
    ("CDR: bytes that are left", "crates/ros2/src/cdr.rs", "        self.at += count;\n        Ok(taken)", "        self.at += count.min(self.at);\n        Ok(taken)", "sdg-ros2"),
    ("ROS 2: a picture's bytes", "crates/ros2/src/encoding.rs", "if needed.max(3 * columns * rows) > MAX_BYTES {", "if needed.max(3 * columns * rows) > usize::MAX - 1 {", "sdg-ros2"),
    ("ROS 2: a picture's sides", "crates/ros2/src/encoding.rs", "if !(1..=MAX_SIDE).contains(width) || !(1..=MAX_SIDE).contains(height) {", "if *width == 0 || *height == 0 {", "sdg-ros2"),
    ("ROS 2: a picture's rows", "crates/ros2/src/encoding.rs", "if data.len() < needed {", "if false && data.len() < needed {", "sdg-ros2"),
    ("ROS 2: frames", "crates/ros2/src/transforms.rs", "let is_full = self.frames.len() >= MAX_FRAMES", "let is_full = self.frames.len() >= usize::MAX", "sdg-ros2"),
    ("ROS 2: poses of a frame", "crates/ros2/src/transforms.rs", "while poses.len() > MAX_POSES || ", "while ", "sdg-ros2"),
    ("ROS 2: frames in a circle", "crates/ros2/src/transforms.rs", "frames.len() < MAX_DEPTH", "frames.len() < 1_000_000_000", "sdg-ros2"),
    # Files that are written.
    ("lock of a writer", "crates/files/src/lock.rs", "            if !is_taken {", "            if false && !is_taken {", "sdg-files"),
    ("lock: held alone", "crates/files/src/lock.rs", "Access::Alone => file.try_lock(),", "Access::Alone => file.try_lock_shared(),", "sdg-files"),
    ("lock: of the file at its path", "crates/files/src/lock.rs", "            if is_at(&file, &path) {", "            if is_at(&file, &path) || true {", "sdg-files"),
    ("written whole: renamed, not written in place", "crates/files/src/atomic.rs", "    let mut file = AtomicFile::create(path)?;\n    file.as_file().write_all(bytes).map_err(failed(path, \"writing\"))?;\n    file.commit()", "    fs::write(path, bytes).map_err(failed(path, \"writing\"))", "sdg-files"),
    ("written whole: flushed before it is renamed", "crates/files/src/atomic.rs", "        file.as_file().sync_all().map_err(failed(&path, \"flushing to the disk\"))?;\n", "", "sdg-files"),
    ("written whole: the folder is flushed", "crates/files/src/atomic.rs", "        sync_folder_of(&target);\n", "", "sdg-files"),
    ("written: no input is replaced", "crates/files/src/inputs.rs", "    check_is_no_input(path, own)?;\n    check_replaces_its_kind(path, bytes)?;", "    check_replaces_its_kind(path, bytes)?;", "sdg-files"),
    ("written: no other kind of file is replaced", "crates/files/src/inputs.rs", "    check_replaces_its_kind(path, bytes)?;\n    write_atomically", "    write_atomically", "sdg-files"),
]


def run(command: list[str], **options) -> subprocess.CompletedProcess:
    return subprocess.run(command, text=True, capture_output=True, check=False, **options)


def tests_of(tests: str, tree: Path) -> subprocess.CompletedProcess:
    package, *words = tests.split()
    environment = {**os.environ, "CARGO_TARGET_DIR": str(WORK / "target")}
    command = ["cargo", "test", "--release", "--locked", "--quiet", "--package", package, "--lib", "--tests"]
    built = run([*command, "--no-run"], cwd=tree, env=environment)
    if built.returncode != 0:
        return built
    # The tests may never end if a guard against endless loops is broken.
    return run(["timeout", "300", *command, "--no-fail-fast", "--", *words], cwd=tree, env=environment)


def main() -> None:
    # The tree is also restored if this script is terminated.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended"))
    words = sys.argv[1:]
    guards = [guard for word in words for guard in GUARDS if word in guard[0] or word in guard[4]] if words else GUARDS
    tree, kept = WORK / "tree", WORK / "found.json"
    commit = run(["git", "rev-parse", "HEAD"], cwd=ROOT).stdout.strip()
    at = WORK / "commit"
    if not at.exists() or at.read_text() != commit:
        # Results and files of another commit say nothing about this one.
        kept.unlink(missing_ok=True)
        shutil.rmtree(tree, ignore_errors=True)
        tree.mkdir(parents=True)
        subprocess.run(f"git archive {commit} | tar -x -m -C '{tree}'", shell=True, check=True, cwd=ROOT)
        at.write_text(commit)
    found = json.loads(kept.read_text()) if kept.exists() else {}
    for guard, file, intact, broken, tests in guards:
        if guard not in found:
            path = tree / file
            text = path.read_text()
            if text.count(intact) != 1:
                sys.exit(f"{guard}: expected once in {file}: {intact}")
            path.write_text(text.replace(intact, broken))
            try:
                done = tests_of(tests, tree)
            finally:
                path.write_text(text)
            output = done.stdout + done.stderr
            failed = sorted(set(re.findall(r"^    ([\w:]+)$", output, re.MULTILINE)))
            if "error: could not compile" in output:
                sys.exit(f"{guard}: does not compile:\n{output[-2000:]}")
            found[guard] = {"place": file, "failed": failed, "status": done.returncode}
            kept.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n")
        names = found[guard]["failed"] or (["no end within five minutes"] if found[guard]["status"] == 124 else ["**nothing**"])
        if found[guard]["status"] not in (0, 101, 124):
            names.append(f"status {found[guard]['status']}")
        print(f"| {guard} | {found[guard]['place']} | {', '.join(f'`{name}`' if '*' not in name else name for name in names)} |", flush=True)


if __name__ == "__main__":
    main()
