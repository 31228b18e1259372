//! `cmd:`: a program that writes pictures to its standard output.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStderr, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use sdg_picture::PixelFrame;

use crate::command_line::CommandLine;
use crate::decode::decode;
use crate::error::CameraError;
use crate::source::{Missing, Source, Taken};
use crate::splitter::Splitter;

/// Bytes per read from the program.
const PIECE_BYTES: usize = 64 << 10;
/// Maximum number of bytes that are kept of a line on standard error.
const MAX_LINE_BYTES: u64 = 1 << 10;
/// Time limit for a program to exit after it has closed its standard output.
const EXIT_TIMEOUT: Duration = Duration::from_secs(1);

/// The time of arrival, and a picture, still encoded, or text that describes invalid data.
type Arrived = (SystemTime, Result<Vec<u8>, String>);

/// A running program. Pictures are taken in order without gaps: a program that is faster than its reader must wait.
pub(crate) struct Program {
    child: Child,
    pictures: Option<Receiver<Arrived>>,
    last_line: Arc<Mutex<String>>,
    threads: Vec<JoinHandle<()>>,
    has_delivered: bool,
    frame: PixelFrame,
}

impl Program {
    /// Starts the program.
    ///
    /// # Errors
    /// [`CameraError::Open`] if the program cannot be started.
    pub(crate) fn start(line: &CommandLine, frame: PixelFrame) -> Result<Self, CameraError> {
        let refused = |why: String| CameraError::Open { address: format!("cmd:{line}"), why };
        let (program, arguments) = line.words().split_first().ok_or_else(|| refused("no program".to_owned()))?;
        let mut command = Command::new(program);
        command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| refused(format!("{program} cannot be started: {error}")))?;
        let last_line = Arc::new(Mutex::new(String::new()));
        let (send, pictures) = sync_channel(1);
        let mut threads = Vec::new();
        if let Some(stdout) = child.stdout.take() {
            threads.push(std::thread::spawn(move || read_pictures(stdout, &send)));
        }
        if let Some(stderr) = child.stderr.take() {
            let last_line = Arc::clone(&last_line);
            threads.push(std::thread::spawn(move || keep_last_line(stderr, &last_line)));
        }
        Ok(Self { child, pictures: Some(pictures), last_line, threads, has_delivered: false, frame })
    }

    /// Interprets the end of the program's output.
    fn end(&mut self) -> Result<Option<Taken>, Missing> {
        let deadline = Instant::now() + EXIT_TIMEOUT;
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) if Instant::now() < deadline => std::thread::sleep(Duration::from_millis(5)),
                Ok(None) => return Err(Missing::Gone("the program closed its standard output".to_owned())),
                Err(error) => return Err(Missing::Gone(format!("the program's state is unknown: {error}"))),
            }
        };
        // The program has exited, so its standard error ends as well, unless a child process holds it open.
        while self.threads.iter().any(|thread| !thread.is_finished()) && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        if status.success() {
            return Ok(None);
        }
        let why = self.with_last_line(status);
        // A program with wrong arguments exits immediately; restarting it would have the same result.
        Err(if self.has_delivered { Missing::Gone(why) } else { Missing::Ended(why) })
    }

    fn with_last_line(&self, status: ExitStatus) -> String {
        let line = self.last_line.lock().unwrap_or_else(PoisonError::into_inner);
        let message =
            if line.is_empty() { "it printed no error".to_owned() } else { format!("its last line of errors: {line}") };
        format!("expected pictures, found that the program ended with {status}; {message}")
    }
}

impl Source for Program {
    fn take(&mut self, deadline: Instant) -> Result<Option<Taken>, Missing> {
        let Some(pictures) = &self.pictures else {
            return Ok(None);
        };
        match pictures.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok((captured, Ok(bytes))) => {
                let picture = decode(&bytes, self.frame).map_err(Missing::Torn)?;
                self.has_delivered = true;
                Ok(Some(Taken { picture, captured, num_skipped: 0 }))
            }
            Ok((_, Err(found))) => Err(Missing::Torn(found)),
            Err(RecvTimeoutError::Timeout) => Err(Missing::Late),
            Err(RecvTimeoutError::Disconnected) => self.end(),
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // Dropping the receiver ends the reading thread if the thread waits until its picture is taken.
        self.pictures = None;
        // The program may have exited already. Without `wait`, it would remain a zombie.
        let _ = self.child.kill();
        let _ = self.child.wait();
        // The threads are not joined: they end when the pipes are closed, and a grandchild process may hold these open.
    }
}

fn read_pictures(mut stdout: ChildStdout, send: &SyncSender<Arrived>) {
    let mut splitter = Splitter::default();
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        let count = match stdout.read(&mut piece) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(_) => break,
        };
        let now = SystemTime::now();
        splitter.push(&piece[..count]);
        while let Some(picture) = splitter.next_picture() {
            if send.send((now, picture)).is_err() {
                return;
            }
        }
    }
    if let Some(rest) = splitter.rest() {
        let _ = send.send((SystemTime::now(), Err(rest)));
    }
}

fn keep_last_line(stderr: ChildStderr, last_line: &Mutex<String>) {
    let mut reader = BufReader::new(stderr);
    let mut bytes = Vec::new();
    loop {
        bytes.clear();
        // Programs that show progress end their lines with a carriage return instead of a line feed, so the length is
        // bounded.
        match reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes) {
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        let text = String::from_utf8_lossy(&bytes);
        if let Some(line) = text.split(['\r', '\n']).map(str::trim).rfind(|line| !line.is_empty()) {
            line.clone_into(&mut last_line.lock().unwrap_or_else(PoisonError::into_inner));
        }
    }
}
