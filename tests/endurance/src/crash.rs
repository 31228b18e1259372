//! Kills commands at random moments (seeded), each with a simulated power cut.
//!
//! ```text
//! folder with inputs ─ the command, traced, killed before change k ─ the folder as the disk holds it ─ inputs unchanged? output
//! none, old or new, and complete? ─ the command again: it succeeds
//! ```

use std::fs::{self, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};

use crate::disk::{Disk, Loss};
use crate::files::{contents_under, files_under, fresh};
use crate::flakey::FlakeyDisk;
use crate::page::Page;
use crate::scenario::{Places, Scenario};
use crate::tracer::{Ending, Tracee};

/// Maximum time between a kill and the power cut of a flakey disk, whose journal is committed every second.
const MAX_CUT_AFTER: Duration = Duration::from_millis(2500);

/// Kills a command until `kills` kills are in the log, including those of earlier calls, and prints a summary. The
/// command works on `flakey`, whose power is cut after the kill; without it the loss is simulated.
///
/// # Errors
/// The run without a kill fails; a kill loses or damages a file; the command fails when it is run again after a kill.
pub fn kill(scenario: Scenario, kills: u64, seed: u64, places: &Places, flakey: Option<&FlakeyDisk>) -> Result<()> {
    let section = if flakey.is_some() { "flakey" } else { "crash" };
    let work = places.work.join(section).join(scenario.name().replace(' ', "-"));
    fs::create_dir_all(&work)?;
    let log = work.join(format!("kills-{seed}.jsonl"));
    // An earlier call that was cut off may leave a damaged last line.
    let lines: Vec<Value> = match fs::File::open(&log) {
        Ok(file) => BufReader::new(file).lines().map_while(|line| serde_json::from_str(&line.ok()?).ok()).collect(),
        Err(_) => Vec::new(),
    };
    fs::write(&log, lines.iter().map(|line| format!("{line}\n")).collect::<String>())?;

    // First a run without a kill, which counts the changes and gives the reference result.
    let reference = work.join("reference");
    fresh(&reference)?;
    scenario.prepare(places, &reference, false)?;
    let (ending, changes, _) = traced(scenario, places, &reference, &work.join("kept"), None)?;
    let runs = flakey.map_or(work.as_path(), FlakeyDisk::folder);
    ensure!(is_good(scenario, ending), "{}: without a kill: {ending:?}", scenario.name());

    let mut lines = lines;
    for number in lines.len() as u64..kills {
        let mut random = Pcg64Mcg::seed_from_u64(seed ^ (number << 20));
        // `changes + 1` cuts the power after the command has ended.
        let at = random.random_range(1..=changes + 1);
        let line = one(scenario, number, at, &mut random, places, runs, flakey, &reference)
            .with_context(|| format!("{}: kill {number}", scenario.name()))?;
        writeln!(OpenOptions::new().append(true).open(&log)?, "{line}")?;
        lines.push(line);
    }
    report(scenario, changes, &lines)
}

fn report(scenario: Scenario, changes: u64, lines: &[Value]) -> Result<()> {
    let count = |is: &dyn Fn(&Value) -> bool| lines.iter().filter(|line| is(line)).count();
    let failures: Vec<&Value> = lines.iter().filter(|line| line["fault"].is_string()).collect();
    println!(
        "{}: {} kills over {changes} changes; lost something unsynced in {}; output: none {}, old {}, new {}; temporary files left {}; failures {}",
        scenario.name(),
        lines.len(),
        count(&|line| line["lost"].as_u64() > Some(0)),
        count(&|line| line["output"] == "none"),
        count(&|line| line["output"] == "old"),
        count(&|line| line["output"] == "new"),
        lines.iter().filter_map(|line| line["left"].as_u64()).sum::<u64>(),
        failures.len()
    );
    for failure in &failures {
        println!("  {failure}");
    }
    ensure!(failures.is_empty(), "{}: {} failures", scenario.name(), failures.len());
    Ok(())
}

fn is_good(scenario: Scenario, ending: Ending) -> bool {
    // The page is ended by SIGINT, the signal of Ctrl-C.
    ending == Ending::Exited(0)
        || scenario == Scenario::Annotate && matches!(ending, Ending::Signalled(libc::SIGINT) | Ending::Exited(130))
}

/// Runs the command in a folder, traced.
fn traced(
    scenario: Scenario,
    places: &Places,
    folder: &Path,
    kept: &Path,
    kill_at: Option<u64>,
) -> Result<(Ending, u64, Disk)> {
    fresh(kept)?;
    let mut disk = Disk::follow(&folder.canonicalize()?, kept)?;
    let mut command = places.sdg(folder, scenario.arguments());
    let errors = kept.with_extension("stderr");
    command.stderr(fs::File::create(&errors)?);
    let mut tracee = Tracee::start(&mut command)?;
    let printed = tracee.child.stdout.take().context("expected a pipe")?;
    let pid = tracee.child.id() as libc::pid_t;
    let client = thread::spawn(move || {
        if scenario == Scenario::Annotate {
            let photo = fs::read("datasets/demonstrations/pendulum/image.png");
            let done = Page::of(printed).and_then(|page| page.mark_teach_and_try(&photo?));
            // SAFETY: no memory is involved. If the tracer has already reaped the process, its id is normally unused,
            // and the call fails.
            unsafe { libc::kill(pid, libc::SIGINT) };
            return done;
        }
        // Read, so that the program never blocks on a full pipe.
        BufReader::new(printed).lines().for_each(drop);
        Ok(())
    });
    let (ending, changes) = tracee.follow(&mut disk, kill_at)?;
    let done = client.join().map_err(|_| anyhow::anyhow!("the client panicked"))?;
    let is_killed = ending == Ending::Killed;
    if !is_killed {
        done?;
        ensure!(is_good(scenario, ending), "{ending:?}: {}", fs::read_to_string(errors)?);
    }
    Ok((ending, changes, disk))
}

/// Kills a command once in a folder of `runs`, cuts the power and checks the folder; after some of the kills, runs the
/// command again.
#[expect(clippy::too_many_arguments, reason = "a function of this file, called once")]
fn one(
    scenario: Scenario,
    number: u64,
    at: u64,
    random: &mut Pcg64Mcg,
    places: &Places,
    runs: &Path,
    flakey: Option<&FlakeyDisk>,
    reference: &Path,
) -> Result<Value> {
    let (run, kept) = (runs.join("run"), runs.join("kept"));
    fresh(&run)?;
    scenario.prepare(places, &run, number % 2 == 1)?;
    let before = contents_under(&run)?;
    // SAFETY: no memory is involved.
    unsafe { libc::sync() };
    let (ending, changes, disk) = traced(scenario, places, &run, &kept, Some(at))?;
    let (after, lost) = match flakey {
        Some(flakey) => {
            let written = contents_under(&run)?;
            thread::sleep(random.random_range(Duration::ZERO..=MAX_CUT_AFTER));
            flakey.cut_power()?;
            let found = contents_under(&run)?;
            (run, written.iter().filter(|file| !found.contains(file)).count())
        }
        None => {
            let after = runs.join(format!("after-{number}"));
            if after.exists() {
                fs::remove_dir_all(&after)?;
            }
            let Loss { contents, folders } = disk.after_power_cut(random, &after)?;
            (after, contents + folders)
        }
    };
    let mut line =
        json!({"number": number, "at": at, "changes": changes, "ending": format!("{ending:?}"), "lost": lost});
    let found = judge(scenario, ending, &before, places, &after).and_then(|found| {
        if number.is_multiple_of(scenario.again_every()) {
            scenario.again(places, &after, reference).context("again")?;
        }
        Ok(found)
    });
    match found {
        Ok((output, left)) => {
            line["output"] = json!(output);
            line["left"] = json!(left);
            fs::remove_dir_all(&after)?;
        }
        Err(error) => {
            line["fault"] = json!(format!("{error:#}"));
            // For inspection; the next kill uses a flakey disk again.
            let kept = reference.with_file_name(format!("after-{number}"));
            if kept != after {
                for (file, content) in contents_under(&after)? {
                    let copy = kept.join(file);
                    fs::create_dir_all(copy.parent().unwrap_or(&kept))?;
                    fs::write(copy, content)?;
                }
            }
        }
    }
    Ok(line)
}

fn judge(
    scenario: Scenario,
    ending: Ending,
    before: &[(PathBuf, Vec<u8>)],
    places: &Places,
    after: &Path,
) -> Result<(&'static str, usize)> {
    let output = scenario.output().map(Path::new);
    // Of the inputs, the page rewrites only the marks.
    let is_written =
        |file: &Path| Some(file) == output || scenario == Scenario::Annotate && file.ends_with("photo.json");
    for (file, content) in before {
        if is_written(file) {
            ensure!(after.join(file).exists(), "{}: gone", file.display());
        } else {
            let found = fs::read(after.join(file)).with_context(|| file.display().to_string())?;
            ensure!(found == *content, "{}: an input was changed", file.display());
        }
    }
    let mut left = 0;
    for file in files_under(after)? {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let old = before.iter().find(|(before, _)| *before == file).map(|(_, content)| content);
        if name.starts_with(".sdg-") {
            left += 1;
        } else if !name.ends_with(".lock")
            && old.is_none_or(|old| fs::read(after.join(&file)).ok().as_ref() != Some(old))
        {
            Scenario::check_whole(places, &after.join(&file))
                .with_context(|| format!("{}: damaged", file.display()))?;
        }
    }
    let state = output.map_or("none", |output| {
        let old = before.iter().find(|(before, _)| before == output).map(|(_, content)| content);
        match fs::read(after.join(output)) {
            Err(_) => "none",
            Ok(found) if Some(&found) == old => "old",
            Ok(_) => "new",
        }
    });
    ensure!(
        ending == Ending::Killed || output.is_none() || state == "new",
        "the command had succeeded, but its output is lost (found {state})"
    );
    Ok((state, left))
}
