//! Long runs: memory, threads and descriptors must not grow, and the last tenth must not be slower.
//!
//! ```text
//! camera of this test (HTTP, motion JPEG) ─ frame ─ sdg detect --from http://… --json ─ line ─ the next frame
//! ```
//!
//! A frame is sent after the line of the frame before was printed, so no frame is dropped, and the time between lines
//! is the time of one frame.

use std::fmt;
use std::fs;
use std::io::{BufRead, BufReader, Cursor, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use image::{ImageFormat, RgbImage};
use serde_json::Value;

use crate::files::fresh;
use crate::page::Page;
use crate::scenario::Places;

/// Longer than any frame takes on a busy machine.
const TIMEOUT: Duration = Duration::from_secs(120);
/// Maximum growth of the heap's bytes in use from the fifth tenth to the last, in KiB and as a ratio. Each tenth's least
/// value counts, because a frame in work needs memory for a moment.
const MAX_HEAP_GROWTH_KIB: u64 = 256;
const MAX_HEAP_GROWTH: f64 = 1.01;
/// Maximum ratio of the resident memory in the last tenth to that in the fifth. The program keeps freed memory, in one
/// heap for all threads, so its size is that of the most unfavourable moment so far.
const MAX_RESIDENT_GROWTH: f64 = 1.25;
/// Maximum ratio of the processor time per unit in the last tenth to that in the fifth: other programs take part of the
/// caches.
const MAX_SLOWER: f64 = 1.15;
/// Number of threads more in the last tenth than in the first half that is no growth: tokio starts a thread for a
/// request if the previous request's thread is not idle yet, and ends it after ten seconds without a request.
const MAX_MORE_THREADS: u64 = 1;
const NUM_FRAMES: u32 = 16;

/// The memory, threads and descriptors of a process, and its processor time so far.
#[derive(Debug, Clone, Copy)]
struct Held {
    resident_kib: u64,
    /// The heap's memory in use.
    heap_kib: u64,
    threads: u64,
    descriptors: u64,
    cpu_secs: f64,
    /// Parts in the frame; 0 for a session.
    parts: u64,
}

impl Held {
    fn of(pid: u32, heap: &Path, parts: u64) -> Result<Self> {
        let status = fs::read_to_string(format!("/proc/{pid}/status"))?;
        let field = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name)).context("expected a field of status")?;
            line.split_whitespace().next().and_then(|number| number.parse().ok()).context("expected a number")
        };
        let stat = fs::read_to_string(format!("/proc/{pid}/stat"))?;
        // The name, in brackets, may contain blanks.
        let after_name = stat.rsplit(')').next().unwrap_or_default();
        let ticks: Vec<u64> = after_name.split_whitespace().skip(11).take(2).filter_map(|n| n.parse().ok()).collect();
        let in_use: u64 = fs::read_to_string(heap)?.trim().parse().context("expected the heap's bytes in use")?;
        Ok(Self {
            resident_kib: field("VmRSS:")?,
            heap_kib: in_use >> 10,
            threads: field("Threads:")?,
            descriptors: fs::read_dir(format!("/proc/{pid}/fd"))?.count() as u64,
            // `/proc` counts a hundred ticks per second, independent of the kernel's own clock.
            cpu_secs: ticks.iter().sum::<u64>() as f64 / 100.0,
            parts,
        })
    }
}

/// The state of a process after each unit: a frame or a session.
#[derive(Debug, Default)]
struct Course(Vec<Held>);

/// A tenth of a run: the largest values, the least memory in use, and the processor time of a unit.
#[derive(Debug, Clone, Copy)]
struct Tenth {
    resident_kib: u64,
    heap_kib: u64,
    threads: u64,
    descriptors: u64,
    parts: u64,
    cpu_secs_each: f64,
}

impl Course {
    fn tenth(&self, idx: usize) -> Tenth {
        let units = &self.0[self.0.len() * idx / 10..self.0.len() * (idx + 1) / 10];
        let most = |of: fn(&Held) -> u64| units.iter().map(of).max().unwrap_or_default();
        let cpu_secs =
            units.last().map_or(0.0, |last| last.cpu_secs) - units.first().map_or(0.0, |first| first.cpu_secs);
        Tenth {
            resident_kib: most(|held| held.resident_kib),
            heap_kib: units.iter().map(|held| held.heap_kib).min().unwrap_or_default(),
            threads: most(|held| held.threads),
            descriptors: most(|held| held.descriptors),
            parts: most(|held| held.parts),
            cpu_secs_each: cpu_secs / (units.len() - 1).max(1) as f64,
        }
    }

    /// Prints all tenths, and compares the last with the fifth; the first four are the start-up. Threads and descriptors
    /// are compared with the first half. Processor time is compared only if every unit does the same work.
    fn report(&self, what: impl fmt::Display, secs: f64, is_work_the_same: bool) -> Result<()> {
        ensure!(self.0.len() >= 30, "expected at least 30 units, found {}", self.0.len());
        println!("{what} in {secs:.0} s, by tenth:");
        let tenths: Vec<Tenth> = (0..10).map(|idx| self.tenth(idx)).collect();
        let row = |name: &str, of: &dyn Fn(&Tenth) -> String| {
            println!("  {name}: {}", tenths.iter().map(of).collect::<Vec<_>>().join(" "));
        };
        row("heap in use, at least, MB", &|tenth| format!("{:.2}", tenth.heap_kib as f64 / 1024.0));
        row("resident memory, at most, MB", &|tenth| format!("{:.1}", tenth.resident_kib as f64 / 1024.0));
        row("threads, at most", &|tenth| tenth.threads.to_string());
        row("descriptors, at most", &|tenth| tenth.descriptors.to_string());
        row("parts of a frame, at most", &|tenth| tenth.parts.to_string());
        row("processor time of a unit, ms", &|tenth| format!("{:.1}", tenth.cpu_secs_each * 1e3));
        let (early, late) = (tenths[4], tenths[9]);
        let grown = |before: u64, ratio: f64| (before as f64 * ratio) as u64;
        let heap_kib = grown(early.heap_kib, MAX_HEAP_GROWTH).max(early.heap_kib + MAX_HEAP_GROWTH_KIB);
        ensure!(late.heap_kib <= heap_kib, "{what}: the heap grows");
        ensure!(late.resident_kib <= grown(early.resident_kib, MAX_RESIDENT_GROWTH), "{what}: memory grows");
        // A connection that is just ending counts in some tenths and not in others.
        let before = |of: fn(&Tenth) -> u64| tenths[..5].iter().map(of).max().unwrap_or_default();
        ensure!(late.threads <= before(|tenth| tenth.threads) + MAX_MORE_THREADS, "{what}: threads grow");
        ensure!(late.descriptors <= before(|tenth| tenth.descriptors), "{what}: descriptors grow");
        ensure!(
            !is_work_the_same || late.cpu_secs_each <= early.cpu_secs_each * MAX_SLOWER + 1e-3,
            "{what}: the last tenth is slower"
        );
        Ok(())
    }
}

/// Preloads the library that reports the heap's memory in use (scripts/hardening/heap.c); returns the file into which it
/// writes.
fn watch_heap(command: &mut Command, folder: &Path, places: &Places) -> Result<PathBuf> {
    let library = places.work.join("heap.so");
    ensure!(library.exists(), "expected {}, which `make endure SECTION=soak` makes, found no file", library.display());
    let file = folder.join("heap");
    command.env("LD_PRELOAD", library).env("HEAP_FILE", &file);
    Ok(file)
}

/// The pendulum's photo, shifted a little from frame to frame along a closed path.
fn frames(places: &Places) -> Result<Vec<Vec<u8>>> {
    let photo = image::open(places.root.join("datasets/demonstrations/pendulum/image.png"))?.into_rgb8();
    let (width, height) = photo.dimensions();
    let moved = |idx: u32| {
        // There and back, two pixels per frame.
        let shift = 2 * (NUM_FRAMES / 2).abs_diff(idx);
        let picture = RgbImage::from_fn(width, height, |x, y| *photo.get_pixel((x + shift) % width, y));
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Jpeg)?;
        Ok(bytes.into_inner())
    };
    (0..NUM_FRAMES).map(moved).collect()
}

/// The path of the model with this letter, which is taught if the file is missing.
fn model(places: &Places, letter: &str) -> Result<String> {
    let folder = places.work.join("once");
    fs::create_dir_all(&folder)?;
    let file = folder.join(format!("soak-{letter}.sdg"));
    let name = file.to_str().context("expected a path in UTF-8")?.to_owned();
    if !file.exists() {
        let demonstrations = places.root.join("datasets/demonstrations/pendulum");
        let demonstration = format!(
            "{}:{}",
            demonstrations.join("image.png").display(),
            demonstrations.join("annotation.json").display()
        );
        // The quality of the model does not matter: its layers do the same computation.
        let output = places
            .sdg(&folder, &["teach", "--model", letter, "--steps", "2", "--demo", &demonstration, "--out", &name])
            .output()?;
        ensure!(file.exists(), "teaching {letter}: {}", String::from_utf8_lossy(&output.stderr));
    }
    Ok(name)
}

/// How the frames of a run are processed, and how often the camera disconnects.
#[derive(Debug, Clone)]
pub struct FrameRun {
    /// The model's letter.
    pub model: String,
    /// Total number of frames.
    pub frames: usize,
    /// Whether every frame is searched on its own.
    pub every_frame: bool,
    /// Number of frames after which the connection ends.
    pub frames_a_connection: usize,
    /// No frame is started after this time; finished frames count.
    pub max_secs: u64,
}

/// Live detection over many frames, from a camera that disconnects every `frames_a_connection` frames.
///
/// # Errors
/// A run that grows, slows down, or ends early.
pub fn detect(run: &FrameRun, places: &Places) -> Result<()> {
    let model = model(places, &run.model)?;
    let frames = frames(places)?;
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let address = format!("http://{}/video.mjpg", listener.local_addr()?);
    let (printed, lines) = channel();
    let (planned, each) = (run.frames, run.frames_a_connection);
    // The thread ends with this process if no client connects any more.
    thread::spawn(move || serve(&listener, &frames, each, &lines));
    let mut arguments = vec!["detect", "--grasp-model", &model, "--from", &address, "--json", "--stall-secs", "60"];
    if run.every_frame {
        arguments.push("--every-frame");
    }
    let folder = places.work.join("soak");
    fresh(&folder)?;
    let mut command = places.sdg(&folder, &arguments);
    let heap = watch_heap(command.stderr(Stdio::null()), &folder, places)?;
    let mut child = Running(command.spawn()?);
    let output = BufReader::new(child.0.stdout.take().context("expected a pipe")?);
    let (start, mut course) = (Instant::now(), Course::default());
    for line in output.lines() {
        let line = line?;
        // Lines about a camera that is disconnected are no frames.
        if !line.contains("\"detections\"") {
            continue;
        }
        let frame: Value = serde_json::from_str(&line)?;
        let parts = frame["detections"].as_array().map_or(0, Vec::len) as u64;
        course.0.push(Held::of(child.0.id(), &heap, parts)?);
        if course.0.len() == planned || start.elapsed().as_secs() >= run.max_secs {
            break;
        }
        let _ = printed.send(());
    }
    drop(child);
    let done = course.0.len();
    ensure!(done == planned || start.elapsed().as_secs() >= run.max_secs, "ended after {done} of {planned} frames");
    let how = if run.every_frame { "each searched" } else { "followed" };
    let disconnections = (done - 1) / each;
    let what = format!("{done} frames, model {}, {how}, {disconnections} disconnections", run.model);
    course.report(what, start.elapsed().as_secs_f64(), run.every_frame)
}

/// A process that ends with this value, also after an error.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Serves motion JPEG: sends a frame, then the next one after a line was printed; closes the connection after `each`
/// frames.
fn serve(listener: &TcpListener, frames: &[Vec<u8>], each: usize, lines: &Receiver<()>) -> Result<()> {
    let mut sent = 0;
    for stream in listener.incoming() {
        let mut stream = stream?;
        let of_connection = connection(&mut stream, frames, each, lines, &mut sent);
        // The program closes its connection when it ends, which is no error.
        let _ = of_connection;
    }
    Ok(())
}

fn connection(
    stream: &mut TcpStream,
    frames: &[Vec<u8>],
    each: usize,
    lines: &Receiver<()>,
    sent: &mut usize,
) -> Result<()> {
    let mut request = [0; 4096];
    let _ = stream.read(&mut request)?;
    stream.set_nodelay(true)?;
    write!(
        stream,
        "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\nConnection: close\r\n\r\n"
    )?;
    for _ in 0..each {
        let frame = &frames[*sent % frames.len()];
        // Content-Length marks the end of a frame; the next boundary comes with the next frame.
        let length = frame.len();
        write!(stream, "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {length}\r\n\r\n")?;
        stream.write_all(frame)?;
        write!(stream, "\r\n")?;
        *sent += 1;
        lines.recv_timeout(TIMEOUT)?;
    }
    Ok(())
}

/// Sessions of the annotation page on one server: each creates a project, marks the photo, teaches, tests a picture and
/// leaves the project.
///
/// # Errors
/// The errors of [`detect`].
pub fn page(sessions: usize, max_secs: u64, places: &Places) -> Result<()> {
    let folder = places.work.join("soak");
    fresh(&folder)?;
    fs::create_dir(folder.join("state"))?;
    let demonstrations = places.root.join("datasets/demonstrations/pendulum");
    let photo = fs::read(demonstrations.join("image.png"))?;
    // A page of its own reads the shipped marks and returns them in the form that the page expects.
    fs::copy(demonstrations.join("image.png"), folder.join("photo.png"))?;
    fs::copy(demonstrations.join("annotation.json"), folder.join("photo.json"))?;
    let (reader, page) = serve_page(&mut places.sdg(&folder, &["annotate", "photo.png", "--no-browser", "--json"]))?;
    let marks = page.json("GET", "/api/session", b"")?["images"][0]["marks"].to_string();
    drop(reader);
    let mut command = places.sdg(&folder, &["annotate", "--no-browser", "--json"]);
    let heap = watch_heap(&mut command, &folder, places)?;
    let (server, served) = serve_page(&mut command)?;
    let (start, mut course) = (Instant::now(), Course::default());
    while course.0.len() < sessions && start.elapsed().as_secs() < max_secs {
        let name = format!("part{}", course.0.len());
        served.ask("POST", &format!("/api/projects?name={name}&photo=photo.png"), &photo)?;
        served.ask("PUT", "/api/images/0/marks", marks.as_bytes())?;
        served.mark_teach_and_try(&photo)?;
        served.ask("DELETE", "/api/projects", b"")?;
        // The heap's memory in use is written a hundred times a second, so the last value may be from before the end.
        thread::sleep(Duration::from_millis(50));
        course.0.push(Held::of(server.0.id(), &heap, 0)?);
        // The disk is not under test.
        remove(&folder.join(&name))?;
    }
    drop(server);
    course.report(format!("{} page sessions", course.0.len()), start.elapsed().as_secs_f64(), true)
}

fn serve_page(command: &mut Command) -> Result<(Running, Page)> {
    let mut server = Running(command.stderr(Stdio::null()).spawn()?);
    let page = Page::of(server.0.stdout.take().context("expected a pipe")?)?;
    Ok((server, page))
}

fn remove(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder)?;
    }
    Ok(())
}
