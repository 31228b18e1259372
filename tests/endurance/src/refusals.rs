//! Runs commands on a full or read-only disk, without free descriptors, and while the clock is set back.
//!
//! Each command must succeed or end with one clear line, never with a panic; if it fails, the old file is unchanged and
//! no temporary file is left. Mounting needs root.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::files::{contents_under, files_under, fresh};
use crate::flakey::run;
use crate::page::Page;
use crate::scenario::{Places, Scenario};

/// Time in which a page that rejected a request may end on its own.
const ENDING: Duration = Duration::from_secs(3);

/// A fault of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// A disk with this number of KiB free.
    FullDisk(u64),
    /// The folder's file system is mounted read-only.
    ReadOnly,
    /// Maximum number of open descriptors.
    Descriptors(u32),
    /// The clock is set back by thirty days while the command runs.
    ClockSetBack,
}

impl Trouble {
    /// All faults that are tested.
    pub fn all() -> Vec<Self> {
        let full = [0, 4, 8, 16, 32, 64, 256, 1024, 2048].map(Self::FullDisk);
        let descriptors = (3..=16).chain([20, 24, 32]).map(Self::Descriptors);
        full.into_iter().chain([Self::ReadOnly]).chain(descriptors).chain([Self::ClockSetBack]).collect()
    }

    fn must_end_well(self) -> bool {
        self == Self::ClockSetBack
    }
}

/// A small disk in memory, unmounted on drop.
struct SmallDisk(PathBuf);

impl SmallDisk {
    fn mount(folder: &Path) -> Result<Self> {
        fresh(folder)?;
        run(Command::new("mount").args(["-t", "tmpfs", "-o", "size=32m", "endurance"]).arg(folder))?;
        Ok(Self(folder.to_owned()))
    }

    /// Fills the disk except for `free_kib` KiB.
    fn fill(&self, free_kib: u64) -> Result<()> {
        let filler = self.0.join("filler.bin");
        run(Command::new("sh").arg("-c").arg(format!("cat /dev/zero > '{}' 2>/dev/null || true", filler.display())))?;
        let length = fs::metadata(&filler)?.len();
        fs::File::options().write(true).open(&filler)?.set_len(length.saturating_sub(free_kib << 10))?;
        Ok(())
    }

    fn remount(&self, option: &str) -> Result<()> {
        run(Command::new("mount").args(["-o", &format!("remount,{option}")]).arg(&self.0))
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

/// Runs a command with every fault of the machine and prints how often it was refused.
///
/// # Errors
/// Damaged files and unclear errors.
pub fn try_all(scenario: Scenario, places: &Places) -> Result<()> {
    let (mut well, mut refused, mut faults) = (0, 0, Vec::new());
    let troubles = Trouble::all();
    for trouble in &troubles {
        match attempt(scenario, *trouble, places) {
            Ok(true) => well += 1,
            Ok(false) => refused += 1,
            Err(error) => faults.push(format!("{} {trouble:?}: {error:#}", scenario.name())),
        }
    }
    let (name, count) = (scenario.name(), troubles.len());
    println!(
        "{name}: {count} conditions: {well} succeeded, {refused} refused with one clear line, {} faults",
        faults.len()
    );
    ensure!(faults.is_empty(), "{}", faults.join("\n"));
    Ok(())
}

/// Runs the command once; returns whether it succeeded.
fn attempt(scenario: Scenario, trouble: Trouble, places: &Places) -> Result<bool> {
    let disk = SmallDisk::mount(&places.work.join(format!("small-{}", scenario.name().replace(' ', "-"))))?;
    let folder = disk.0.clone();
    scenario.prepare(places, &folder, true)?;
    match trouble {
        Trouble::FullDisk(free_kib) => disk.fill(free_kib)?,
        Trouble::ReadOnly => disk.remount("ro")?,
        Trouble::Descriptors(_) | Trouble::ClockSetBack => {}
    }
    let before = contents_under(&folder)?;
    let mut command = places.sdg(&folder, scenario.arguments());
    // Temporary files do not belong on the disk that is full.
    command.env("TMPDIR", &places.work);
    if let Trouble::Descriptors(count) = trouble {
        let inner = command;
        command = Command::new("sh");
        command.args(["-c", &format!("ulimit -n {count}; exec \"$@\""), "sh"]).arg(inner.get_program());
        command.args(inner.get_args()).current_dir(&folder).envs(inner.get_envs().filter_map(|(k, v)| Some((k, v?))));
        command.stdin(std::process::Stdio::null());
        command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped());
    }
    let clock = places.work.join("clock");
    if trouble == Trouble::ClockSetBack {
        fs::write(&clock, "+0")?;
        command.env("LD_PRELOAD", faketime()?).env("FAKETIME_TIMESTAMP_FILE", &clock);
        command.env("FAKETIME_NO_CACHE", "1").env("FAKETIME_DONT_FAKE_MONOTONIC", "1");
    }
    let mut child = command.spawn()?;
    let mut errors = child.stderr.take().context("expected a pipe")?;
    let reader = thread::spawn(move || {
        let mut text = Vec::new();
        let _ = errors.read_to_end(&mut text);
        String::from_utf8_lossy(&text).into_owned()
    });
    if trouble == Trouble::ClockSetBack {
        thread::sleep(Duration::from_millis(150));
        fs::write(&clock, "-30d")?;
    }
    let printed = child.stdout.take().context("expected a pipe")?;
    let mut refusal = None;
    let status = if scenario == Scenario::Annotate {
        let photo = fs::read(places.root.join("datasets/demonstrations/pendulum/image.png"))?;
        match Page::of(printed) {
            Ok(page) => refusal = page.mark_teach_and_try(&photo).err(),
            Err(error) => refusal = Some(error),
        }
        // After a rejected request the page may be ending on its own.
        let given = Instant::now();
        let mut ended = child.try_wait()?;
        while refusal.is_some() && ended.is_none() && given.elapsed() < ENDING {
            thread::sleep(Duration::from_millis(20));
            ended = child.try_wait()?;
        }
        child.kill()?;
        child.wait()?;
        ended
    } else {
        let drained = thread::spawn(move || std::io::copy(&mut { printed }, &mut std::io::sink()));
        let status = child.wait()?;
        let _ = drained.join();
        Some(status)
    };
    let errors = reader.join().map_err(|_| anyhow::anyhow!("a reader panicked"))?;
    let is_good = match (&refusal, status) {
        (None, status) => status.is_none_or(|status| status.success()),
        // The page's server keeps running and reports the error in an answer.
        (Some(refusal), None) if refusal.to_string().contains("HTTP/1.1") => false,
        (Some(refusal), None) if refusal.to_string().contains("the teaching failed") => false,
        (Some(refusal), None) => bail!("expected an answer of the page, found none: {refusal:#}; {errors}"),
        (Some(_), Some(_)) => false,
    };
    ensure!(!errors.contains("panicked"), "a panic: {errors}");
    if !is_good && status.is_some() {
        check_is_clear(&errors, status)?;
    }
    check_files(scenario, is_good, &before, places, &folder)?;
    ensure!(is_good || !trouble.must_end_well(), "failed: {errors}");
    Ok(is_good)
}

fn check_is_clear(errors: &str, status: Option<ExitStatus>) -> Result<()> {
    let last = errors.lines().rfind(|line| !line.trim().is_empty()).unwrap_or_default();
    // An error of the dynamic loader, before the program runs.
    let is_loaders =
        last.contains("error while loading shared libraries") || last.contains("cannot open shared object");
    let code = status.and_then(|status| status.code());
    ensure!(
        is_loaders || last.starts_with("sdg: ") && code == Some(1),
        "expected one clear line, found {code:?}: {errors}"
    );
    Ok(())
}

fn check_files(
    scenario: Scenario,
    is_good: bool,
    before: &[(PathBuf, Vec<u8>)],
    places: &Places,
    folder: &Path,
) -> Result<()> {
    let output = scenario.output().map(Path::new);
    for (file, content) in before {
        let is_output =
            Some(file.as_path()) == output || scenario == Scenario::Annotate && file.ends_with("photo.json");
        let found = fs::read(folder.join(file)).with_context(|| format!("{}: gone", file.display()))?;
        ensure!(
            is_output && (is_good || scenario == Scenario::Annotate) || found == *content,
            "{}: changed",
            file.display()
        );
    }
    for file in files_under(folder)? {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        ensure!(!name.starts_with(".sdg-"), "a temporary file was left");
        if name.ends_with(".lock") || name == "filler.bin" || before.iter().any(|(old, _)| *old == file) && !is_good {
            continue;
        }
        Scenario::check_whole(places, &folder.join(&file)).with_context(|| format!("{}: damaged", file.display()))?;
    }
    Ok(())
}

/// libfaketime's library, as Debian installs it.
fn faketime() -> Result<PathBuf> {
    let folder = Path::new("/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1");
    ensure!(folder.exists(), "{}: scripts/install.sh libfaketime installs it", folder.display());
    Ok(folder.to_owned())
}
