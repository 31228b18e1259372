//! Some thousand executions of every target. One test, because it counts the memory of the whole process.
#![allow(clippy::unwrap_used)]

use peak_alloc::PeakAlloc;
use sdg_fuzz::{TARGETS, run};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

#[test]
fn every_reader_refuses_or_reads_and_takes_neither_long_nor_much() {
    let mut wrong = Vec::new();
    for target in TARGETS {
        // Unchanged, each is read: else nothing of the format would be tried.
        for (k, seed) in (target.seeds)().iter().enumerate() {
            if !(target.run)(seed) {
                wrong.push(format!("{}: seed {k} is refused", target.name));
            }
        }
        let outcome = run(target, 0..target.quick_executions, &ALLOCATOR);
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
        // Of what is made, some is still of the format, and some is not.
        if !(1..outcome.count).contains(&outcome.accepted) {
            wrong.push(format!("{}: {} of {} accepted", target.name, outcome.accepted, outcome.count));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
