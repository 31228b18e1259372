"""Tests sdg ros2 against Cyclone DDS on loopback: pictures, poses, services, faults, latency, memory.

python node_tests.py SDG FOLDER [pictures|services|faults|latency|memory ...]: FOLDER receives the taught models.
"""

import gc
import json
import pathlib
import signal
import subprocess
import sys
import threading
import time

import numpy as np
from cyclone import Client, Peer, best_effort, header, make, pack, reliable, stamp_now, unpack
from PIL import Image as PilImage

REPOSITORY = pathlib.Path(__file__).resolve().parents[4]
PHOTO = REPOSITORY / "datasets/demonstrations/pendulum/image.png"
MARKS = PHOTO.parent / "annotation.json"
CAMERA = REPOSITORY / "datasets/workcell/camera.yaml"
FRAME = "camera_optical_frame"
failures = []


def check(condition, text):
    print(("ok    " if condition else "FAIL  ") + text, flush=True)
    if not condition:
        failures.append(text)


class Sdg:
    """A process of sdg ros2 whose lines on standard error are kept."""

    def __init__(self, program, domain, *options, rmw="cyclonedds"):
        self.lines = []
        line = [program, "ros2", "--loopback", f"--rmw={rmw}", f"--domain-id={domain}", *options]
        self.process = subprocess.Popen(line, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        threading.Thread(target=self.read, daemon=True).start()
        assert self.said("Ctrl-C ends it", 30), self.lines

    def read(self):
        for line in self.process.stderr:
            self.lines.append(line.rstrip())

    def said(self, text, timeout=5.0):
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            found = [line for line in self.lines if text in line]
            if found:
                return found[0]
            if self.process.poll() is not None:
                return None
            time.sleep(0.01)
        return None

    def rss_mb(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(next(line for line in status.splitlines() if line.startswith("VmRSS")).split()[1]) / 1024

    def __enter__(self):
        return self

    def __exit__(self, *_):
        is_running = self.process.poll() is None
        self.process.send_signal(signal.SIGINT)
        code = self.process.wait(20)
        check(is_running and code == 0, f"the node ran until it was ended (exit code {code})")
        for line in self.lines:
            if "panicked" in line:
                check(False, line)


def teach(sdg, folder, *options):
    out = folder / f"pendulum{len(options)}.sdg"
    if not out.exists():
        subprocess.run([sdg, "teach", "--model=S", f"--demo={PHOTO}:{MARKS}", f"--out={out}", *options], check=True, stderr=subprocess.DEVNULL)
    return out


def photo():
    return np.asarray(PilImage.open(PHOTO).convert("RGB"))


def image(pixels, stamp=None, encoding="rgb8", **fields):
    height, width = pixels.shape[:2]
    fields = {"height": height, "width": width, "step": 3 * width, "encoding": encoding, **fields}
    return make("sensor_msgs/msg/Image", header=header(FRAME, stamp), data=np.ascontiguousarray(pixels).reshape(-1), **fields)


def nanos(stamp):
    return stamp.sec * 10**9 + stamp.nanosec


def send_at(writer, pixels, rate, count, varied=True):
    """Sends pictures at a rate and returns their stamps. If `varied`, they differ in their last byte, as with a
    sensor's noise."""
    packed = bytearray(pack(image(pixels), "sensor_msgs/msg/Image"))
    stamps, begun = [], time.monotonic()
    for number in range(count):
        time.sleep(max(0.0, begun + number / rate - time.monotonic()))
        stamp = stamp_now()
        packed[0:8] = stamp.sec.to_bytes(4, "little") + stamp.nanosec.to_bytes(4, "little")
        packed[-1] = number % 256 if varied else packed[-1]
        stamps.append(nanos(stamp))
        writer(bytes(packed))
    return stamps


def counts_of(diagnostics):
    status = [status for message in diagnostics for status in message.status]
    return {entry.key: float(entry.value) for entry in status[-1].values} if status else {}


def pictures(sdg, folder):
    model = teach(sdg, folder, f"--camera={CAMERA}", "--mark-height-mm=16")
    expected = json.loads(subprocess.run(
        [sdg, "detect", "--json", f"--grasp-model={model}", f"--camera={CAMERA}", PHOTO], capture_output=True, check=True).stdout)
    best = expected["detections"][0]
    for kind, rate, qos, option in [
        ("reliable", 10, reliable(10), ["--reliable"]),
        ("best effort", 10, best_effort(10), []),
        ("reliable", 30, reliable(10), ["--reliable"]),
        ("best effort", 30, best_effort(10), []),
    ]:
        pictures_at(sdg, model, best, kind, rate, qos, option)
        # The participant must leave before the next one joins. With two participants in one process, of which the first
        # left, the node did not find the second's readers in 5 of 25 attempts; with one in each of two processes, in
        # none of 30.
        gc.collect()


def pictures_at(sdg, model, best, kind, rate, qos, option):
    domain = 41
    with Sdg(sdg, domain, f"--grasp-model={model}", f"--camera={CAMERA}", "--queue=250", *option) as node:
        peer = Peer(domain)
        send = peer.writer("/image", "sensor_msgs/msg/Image", qos)
        detections = peer.raw_reader("/sdg/detections", "vision_msgs/msg/Detection2DArray", reliable(1000))
        poses = peer.reader("/sdg/grasp_pose", "geometry_msgs/msg/PoseStamped", reliable(1000))
        overlays = peer.reader("/sdg/overlay", "sensor_msgs/msg/Image", reliable(4)) if kind == "reliable" and rate == 10 else None
        diagnostics = peer.reader("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", reliable(100))
        transforms = peer.reader("/tf", "tf2_msgs/msg/TFMessage", reliable(1000))
        time.sleep(2.0)
        sent = send_at(send, photo(), rate, 200)
        end, seen, overlay, report = time.monotonic() + 120, [], [], []
        while time.monotonic() < end:
            time.sleep(0.1)
            seen += detections()
            report += diagnostics()
            overlay = (overlays() or overlay) if overlays else overlay
            counts = counts_of(report)
            done = counts.get("pictures searched", 0) + counts.get("pictures skipped", 0)
            if done and done == counts.get("pictures received") and time.monotonic() > end - 115:
                break
        if not report:
            check(False, f"{kind}, {rate} Hz: diagnostics within 120 s")
            return
        received = int(counts["pictures received"])
        print(f"      {kind}, {rate} Hz: {received} of 200 pictures received, {int(counts['messages lost'])} lost, "
              f"{int(counts['pictures searched'])} searched, {len(seen)} results back, search "
              f"{counts['last search, ms']:.0f} ms", flush=True)
        if (kind, rate) != ("reliable", 10):
            return
        check(received == 200 and len(seen) == 200, f"reliable at 10 Hz: 200 of 200 received, {len(seen)} results")
        name = "vision_msgs/msg/Detection2DArray"
        messages = [unpack(data, name) for data in seen]
        check([nanos(message.header.stamp) for message in messages] == sent, "results have the pictures' stamps, in order")
        same = [pack(message, name)[: len(data.rstrip(b"\0"))] == data.rstrip(b"\0") for message, data in zip(messages, seen)]
        check(all(same), "detections are the bytes that rosbags writes of them")
        first = messages[0].detections[0]
        box = best["box"]
        check(abs(first.bbox.center.position.x + 0.5 - (box[0] + box[2]) / 2) < 0.01
              and abs(first.bbox.size_y - (box[3] - box[1])) < 0.01
              and abs(first.results[0].hypothesis.score - best["score"]) < 0.02
              and first.results[0].hypothesis.class_id == "pendulum", "a detection is that of sdg detect")
        pose = poses()[0]
        # The camera looks straight down from (0.48, 0, 0.58) m; its x axis points along the base's -y:
        # datasets/workcell/camera.yaml.
        p, (x, y, z) = pose.pose.position, best["pose"]["p_m"]
        in_base = (0.48 - p.y, -p.x, 0.58 - p.z)
        apart = max(abs(a - b) for a, b in zip(in_base, (x, y, z)))
        check(apart < 1e-3 and pose.header.frame_id == FRAME, f"the pose is that of sdg detect, within {apart * 1e6:.1f} µm")
        parents = [(t.header.frame_id, t.child_frame_id) for message in transforms() for t in message.transforms]
        check((FRAME, "sdg_grasp") in parents, "the grasp is a frame of tf")
        drawn = overlay[-1].data.reshape(photo().shape)
        changed = np.argwhere((drawn != photo()).any(axis=2))
        x1, y1, x2, y2 = box
        inside = ((changed[:, 1] > x1 - 60) & (changed[:, 1] < x2 + 60) & (changed[:, 0] > y1 - 60) & (changed[:, 0] < y2 + 60)).mean()
        check(len(changed) > 200 and inside > 0.98, f"the overlay is the picture with marks on the part ({len(changed)} pixels, {inside:.1%} there)")
        text = f"{overlay[-1].width}x{overlay[-1].height} {overlay[-1].encoding}"
        check(text == "640x480 rgb8", f"the overlay is {text}")


def services(sdg, folder):
    model = teach(sdg, folder, f"--camera={CAMERA}", "--mark-height-mm=16")
    domain, second = 42, folder / "taught.sdg"
    options = [f"--grasp-model={model}", f"--camera={CAMERA}", f"--teach-demo={PHOTO}:{MARKS}", f"--teach-out={second}", "--teach-model=S",
               "--teach-mark-height-mm=16"]
    with Sdg(sdg, domain, *options):
        peer = Peer(domain)
        send = peer.writer("/image", "sensor_msgs/msg/Image", best_effort(5))
        client = {name: Client(peer.participant, f"/sdg/{name}", f"sdg_interfaces/{name.capitalize()}", "", "srv") for name in ("detect", "teach")}
        trigger = {name: Client(peer.participant, f"/sdg/{name}_trigger", "std_srvs/Trigger", "", "srv") for name in ("detect", "teach")}
        time.sleep(2.0)
        stop = threading.Event()

        def stream():
            while not stop.is_set():
                send_at(send, photo(), 10, 5)

        thread = threading.Thread(target=stream)
        thread.start()
        request = pack(make("sdg_interfaces/msg/DetectRequest"), "sdg_interfaces/msg/DetectRequest")
        answer, secs = client["detect"].call(request)
        found = unpack(answer, "sdg_interfaces/msg/DetectResponse")
        check(found.success and len(found.detections.detections) == 1 == len(found.poses) == len(found.openings_m),
              f"detect: {found.message}, {secs * 1e3:.0f} ms")
        answer, secs = trigger["detect"].call(b"\0")
        told = unpack(answer, "std_srvs/msg/TriggerResponse")
        check(told.success and "1 found" in told.message, f"detect_trigger: {told.message}")
        request = make("sdg_interfaces/msg/TeachRequest", photo_path=str(PHOTO), annotation_path=str(MARKS), out_path=str(folder / "service.sdg"), model="S",
                       mark_height_mm=16.0, use_it=True)
        answer, secs = client["teach"].call(pack(request, "sdg_interfaces/msg/TeachRequest"), 120)
        told = unpack(answer, "sdg_interfaces/msg/TeachResponse")
        check(told.success and (folder / "service.sdg").exists(), f"teach: {told.message}")
        answer, _ = client["detect"].call(pack(make("sdg_interfaces/msg/DetectRequest"), "sdg_interfaces/msg/DetectRequest"))
        check(len(unpack(answer, "sdg_interfaces/msg/DetectResponse").detections.detections) == 1, "the taught model is used")
        marks = MARKS.read_text()
        request = make("sdg_interfaces/msg/TeachRequest", photo_path=str(PHOTO), out_path=str(folder / "marks.sdg"), model="S", annotation=marks)
        answer, secs = client["teach"].call(pack(request, "sdg_interfaces/msg/TeachRequest"), 120)
        told = unpack(answer, "sdg_interfaces/msg/TeachResponse")
        check(told.success, f"teach with marks in the request: {told.message}")
        request = make("sdg_interfaces/msg/TeachRequest", photo_path="/nowhere.png", out_path=str(folder / "x.sdg"), model="S")
        answer, secs = client["teach"].call(pack(request, "sdg_interfaces/msg/TeachRequest"), 20)
        told = unpack(answer, "sdg_interfaces/msg/TeachResponse")
        check(not told.success and "/nowhere.png" in told.message, f"teach without a photo: {told.message}")
        answer, _ = client["teach"].call(b"\xff" * 40, 20)
        told = unpack(answer, "sdg_interfaces/msg/TeachResponse")
        check(not told.success and "malformed" in told.message, f"teach, malformed: {told.message}")
        answer, secs = trigger["teach"].call(b"\0", 120)
        told = unpack(answer, "std_srvs/msg/TriggerResponse")
        check(told.success and second.exists(), f"teach_trigger: {told.message}")
        stop.set()
        thread.join()
        request = make("sdg_interfaces/msg/DetectRequest", timeout_secs=0.5)
        time.sleep(1.0)
        answer, secs = client["detect"].call(pack(request, "sdg_interfaces/msg/DetectRequest"))
        told = unpack(answer, "sdg_interfaces/msg/DetectResponse")
        check(not told.success and "no picture on /image" in told.message, f"detect without pictures: {told.message}")


def faults(sdg, folder):
    model = teach(sdg, folder, f"--camera={CAMERA}", "--mark-height-mm=16")
    domain = 43
    with Sdg(sdg, domain, f"--grasp-model={model}", f"--camera={CAMERA}", "--reliable") as node:
        peer = Peer(domain)
        send = peer.writer("/image", "sensor_msgs/msg/Image", reliable(10))
        inform = peer.writer("/camera_info", "sensor_msgs/msg/CameraInfo", reliable(10))
        detections = peer.reader("/sdg/detections", "vision_msgs/msg/Detection2DArray", reliable(100))
        time.sleep(2.0)

        def works(what):
            detections()
            send_at(send, photo(), 10, 3)
            end, seen = time.monotonic() + 10, []
            while time.monotonic() < end and not seen:
                time.sleep(0.05)
                seen = detections()
            check(bool(seen) and len(seen[-1].detections) == 1, f"the node goes on {what}")

        works("at first")
        for message, text, what in [
            (image(photo(), encoding="bayer_rggb8"), "bayer_rggb8", "an unknown encoding"),
            (image(photo(), height=4000), "expected 7680000 bytes", "a height that does not fit"),
            (image(photo(), step=7), "a step of at least 1920 bytes", "a step that does not fit"),
            (pack(image(photo()), "sensor_msgs/msg/Image")[:5000], "malformed message", "a message cut off"),
            (b"\xff" * 3000, "malformed message", "noise"),
            (image(photo()[:100, :100]), "expected pictures of 640 × 480", "a picture of another size"),
            (image(np.zeros((6000, 4000, 3), np.uint8)), "at most 64 MiB", "an oversized picture"),
        ]:
            # The same message is printed only once in two seconds.
            time.sleep(2.1)
            node.lines.clear()
            send(message)
            line = node.said(text, 30 if what == "an oversized picture" else 5)
            check(line is not None, f"{what}: {line}")
            works(f"after {what}")
        wrong = make("sensor_msgs/msg/CameraInfo", header=header(FRAME), width=640, height=480, distortion_model="plumb_bob",
                     d=np.zeros(5), k=np.array([700.0, 0, 319.5, 0, 700, 239.5, 0, 0, 1]))
        node.lines.clear()
        inform(wrong)
        time.sleep(0.3)
        send_at(send, photo(), 10, 3)
        line = node.said("fx = 550.0")
        check(line is not None, f"a camera_info that does not fit: {line}")
        inform(make("sensor_msgs/msg/CameraInfo", header=header(FRAME), width=640, height=480, distortion_model="plumb_bob",
                    d=np.zeros(5), k=np.array([550.0, 0, 319.5, 0, 550, 239.5, 0, 0, 1])))
        time.sleep(0.3)
        works("after a camera_info that fits")
        del send, inform, detections, peer
        gc.collect()
        time.sleep(1.0)
        peer = Peer(domain)
        send = peer.writer("/image", "sensor_msgs/msg/Image", reliable(10))
        detections = peer.reader("/sdg/detections", "vision_msgs/msg/Detection2DArray", reliable(100))
        time.sleep(3.0)
        works("after the peer was started again")

    with Sdg(sdg, domain + 1, f"--grasp-model={model}", f"--camera={CAMERA}", "--base-frame=panda_link0", "--reliable") as node:
        peer = Peer(domain + 1)
        send = peer.writer("/image", "sensor_msgs/msg/Image", reliable(10))
        move = peer.writer("/tf", "tf2_msgs/msg/TFMessage", reliable(100))
        poses = peer.reader("/sdg/grasp_pose", "geometry_msgs/msg/PoseStamped", reliable(100))
        time.sleep(2.0)

        def transform(age):
            stamp = make("builtin_interfaces/msg/Time", sec=int(time.time() - age), nanosec=int((time.time() - age) % 1 * 1e9))
            place = make("geometry_msgs/msg/Transform", translation=make("geometry_msgs/msg/Vector3", x=0.48, z=0.58),
                         rotation=make("geometry_msgs/msg/Quaternion", x=0.5**0.5, y=-(0.5**0.5)))
            one = make("geometry_msgs/msg/TransformStamped", header=header("panda_link0", stamp), child_frame_id=FRAME, transform=place)
            move(make("tf2_msgs/msg/TFMessage", transforms=[one]))

        send_at(send, photo(), 10, 3)
        line = node.said("was received on /tf")
        check(line is not None, f"no transform: {line}")
        transform(3.0)
        time.sleep(0.3)
        send_at(send, photo(), 10, 3)
        line = node.said("stale:")
        check(line is not None, f"a stale transform: {line}")
        for _ in range(20):
            transform(0.0)
            send_at(send, photo(), 10, 1)
        time.sleep(1.0)
        seen = poses()
        check(bool(seen), f"with a fresh transform there are poses ({len(seen)})")


def latency(sdg, folder):
    model = teach(sdg, folder, f"--camera={CAMERA}", "--mark-height-mm=16")
    domain = 45
    with Sdg(sdg, domain, f"--grasp-model={model}", f"--camera={CAMERA}", "--reliable"):
        peer = Peer(domain)
        send = peer.writer("/image", "sensor_msgs/msg/Image", reliable(10))
        poses = peer.reader("/sdg/grasp_pose", "geometry_msgs/msg/PoseStamped", reliable(100))
        diagnostics = peer.reader("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", reliable(100))
        time.sleep(2.0)
        pixels, times, searches = photo(), [], []
        for _ in range(200):
            [sent] = send_at(send, pixels, 10, 1)
            end = time.monotonic() + 5
            while time.monotonic() < end:
                if any(nanos(pose.header.stamp) == sent for pose in poses()):
                    times.append((time.time_ns() - sent) / 1e6)
                    break
                time.sleep(0.0005)
            searches += [counts_of([message])["last search, ms"] for message in diagnostics()]
            time.sleep(0.02)
        in_words = lambda values: f"median {np.median(values):.1f} ms, 99 % {np.percentile(values, 99):.1f} ms"
        print(f"      picture to pose over ROS 2: {in_words(times)} ({len(times)} pictures); search alone: {in_words(searches)}", flush=True)
        check(len(times) == 200, "every picture got its pose")


def memory(sdg, folder, count=10_000):
    """Uses pictures of noise, without a part, at 40 Hz, so that 10^4 pictures take minutes."""
    model = teach(sdg, folder)
    domain = 46
    with Sdg(sdg, domain, f"--grasp-model={model}", "--reliable") as node:
        peer = Peer(domain)
        send = peer.writer("/image", "sensor_msgs/msg/Image", reliable(10))
        diagnostics = peer.reader("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", reliable(100))
        time.sleep(2.0)
        dice, report, sizes = np.random.default_rng(22), [], []
        noise = dice.integers(0, 255, (480, 640, 3), dtype=np.uint8)
        for batch in range(count // 500):
            send_at(send, noise, 40, 500)
            sizes.append(node.rss_mb())
            report += diagnostics()
        time.sleep(1.5)
        counts = counts_of(report + diagnostics())
        print(f"      {int(counts['pictures received'])} of {count} pictures received, {int(counts['pictures searched'])} searched; memory after each "
              f"500: {' '.join(f'{size:.0f}' for size in sizes)} MB", flush=True)
        check(sizes[-1] < sizes[len(sizes) // 4] * 1.05 + 2, "memory is flat")


if __name__ == "__main__":
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[3:] or ["pictures", "services", "faults", "latency", "memory"]:
        print(f"== {name}", flush=True)
        {"pictures": pictures, "services": services, "faults": faults, "latency": latency, "memory": memory}[name](program, folder)
    print(f"{len(failures)} failures", flush=True)
    sys.exit(bool(failures))
