//! The short run of every target: 300 to 100 000 executions. All runs are one test, because it counts the memory of the
//! whole process.
#![allow(clippy::unwrap_used)]

use std::collections::HashSet;
use std::fs;
use std::path::Path;

use peak_alloc::PeakAlloc;
use sdg_fuzz::{TARGETS, costliest_pickles, execute, run};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

#[test]
fn every_reader_refuses_or_reads_and_takes_neither_long_nor_much() {
    let mut wrong = Vec::new();
    for target in TARGETS {
        // Every seed must be accepted unchanged; otherwise the mistakes would never get past the first
        // check.
        let seeds = (target.seeds)();
        for (k, seed) in seeds.iter().enumerate() {
            let execution = execute(target, seed, &ALLOCATOR);
            if !execution.accepted {
                wrong.push(format!("{}: expected seed {k} to be accepted, found {:?}", target.name, execution.broken));
            }
        }
        let outcome = run(target, &seeds, 0..target.quick_executions, &ALLOCATOR);
        println!(
            "{}: {} of {} accepted, slowest {:.0} ms, most {:.1} MB",
            target.name,
            outcome.accepted,
            outcome.count,
            1e3 * outcome.slowest_secs,
            1e-6 * outcome.most_bytes as f64
        );
        if let Some(first) = outcome.failures.first() {
            let count = outcome.failures.len();
            wrong.push(format!(
                "{}: {count} failures, the first is number {}: {}",
                target.name, first.number, first.reason
            ));
        }
        // Some of the mutated inputs are still valid, and some are not.
        if !(1..outcome.count).contains(&outcome.accepted) {
            wrong.push(format!("{}: {} of {} accepted", target.name, outcome.accepted, outcome.count));
        }
    }
    // No mistake produces these pickles, which repeat one operation for a million bytes.
    let checkpoint = TARGETS.iter().find(|target| target.name == "checkpoint").unwrap();
    for (k, pickle) in costliest_pickles().iter().enumerate() {
        // The program does not keep the file in memory, so the limit is 3 bytes per byte of the file instead of
        // [`sdg_fuzz::MAX_BYTES_PER_INPUT_BYTE`].
        let execution = execute(checkpoint, pickle, &ALLOCATOR);
        let most = checkpoint.max_extra_bytes + 3 * pickle.len();
        if execution.broken.is_some() || execution.bytes > most {
            wrong.push(format!(
                "costly pickle {k}: {} bytes of at most {most}, {:?}",
                execution.bytes, execution.broken
            ));
        }
    }
    let seeds: HashSet<Vec<u8>> = TARGETS.iter().flat_map(|target| (target.seeds)()).collect();
    for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/pictures")).unwrap() {
        let path = entry.unwrap().path();
        if !seeds.contains(&fs::read(&path).unwrap()) {
            wrong.push(format!("expected {} to be a seed", path.display()));
        }
    }
    // The targets' hook records panics without printing them; restore the default hook for the assertion
    // below.
    let _ = std::panic::take_hook();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
