//! Writes medians as JSON, as lines, and as a Markdown table.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Result, bail};
use sdg_files::write_atomically;
use sdg_geometry::median;
use serde::Serialize;

use crate::compare::machine::Machine;
use crate::compare::worker_process::WorkerProcess;
use crate::registry::{Peer, Side, WorkSpec};
use crate::results::{duration, rewrite};

/// One side of a work, measured.
#[derive(Debug, Clone)]
pub struct Measured {
    pub side: Side,
    /// Seconds of every run.
    pub seconds: Vec<f64>,
    /// Peak memory of the timed runs, in bytes.
    pub memory_bytes: Option<u64>,
    /// Amount of work in GFLOP, if it was counted.
    pub gflop: Option<f64>,
    /// Versions of the software.
    pub version: String,
}

impl Measured {
    /// Reads the peak memory and ends the worker.
    pub fn new(worker: WorkerProcess, seconds: Vec<f64>) -> Result<Self> {
        if seconds.is_empty() {
            bail!("expected times of {}, found none", worker.side.title());
        }
        let memory_bytes = worker.peak_memory_bytes();
        let ready = worker.ready.clone();
        Ok(Self { side: worker.side, seconds, memory_bytes, gflop: ready.gflop, version: ready.version })
    }

    fn median(&self) -> f64 {
        median(self.seconds.iter().copied()).unwrap_or(f64::NAN)
    }
}

/// A row of `peers.json`. Its peer columns are null if no peer does the same work.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    work: &'static str,
    ours_seconds: f64,
    peer: Option<&'static str>,
    peer_seconds: Option<f64>,
    ratio: Option<f64>,
}

/// A row with all measurements, for `details.json`.
#[derive(Debug, Clone, Serialize)]
struct Details {
    work: &'static str,
    title: &'static str,
    side: &'static str,
    version: String,
    seconds: Vec<f64>,
    memory_bytes: Option<u64>,
    gflop: Option<f64>,
}

/// All measurements of a run.
#[derive(Debug)]
pub struct Report {
    machine: Machine,
    threads: usize,
    /// The highest speed that a side reached in a matrix product, in GFLOP/s.
    peak_gflops: Option<f64>,
    works: Vec<(&'static WorkSpec, Vec<Measured>)>,
    versions: Vec<String>,
}

impl Report {
    /// An empty report.
    pub fn new(machine: Machine, threads: usize) -> Self {
        Self { machine, threads, peak_gflops: None, works: Vec::new(), versions: Vec::new() }
    }

    /// Sets the machine's peak from the fastest run of the matrix product.
    pub fn set_peak(&mut self, gemm: &[Measured]) {
        const GFLOP: f64 = 2e-9 * 2048.0 * 2048.0 * 2048.0;
        let fastest = gemm.iter().flat_map(|side| &side.seconds).copied().min_by(f64::total_cmp);
        self.peak_gflops = fastest.map(|seconds| GFLOP / seconds);
        self.note_versions(gemm);
    }

    /// Adds a work; our side is the first.
    pub fn add(&mut self, work: &'static WorkSpec, measured: Vec<Measured>) {
        self.note_versions(&measured);
        self.works.push((work, measured));
    }

    fn note_versions(&mut self, measured: &[Measured]) {
        for version in measured.iter().flat_map(|side| side.version.split(", ")) {
            if !version.is_empty() && self.versions.iter().all(|known| known != version) {
                self.versions.push(version.to_owned());
            }
        }
    }

    /// One line with machine, versions and peak.
    pub fn heading(&self) -> String {
        let peak = self.peak_gflops.map_or("unknown".to_owned(), |peak| format!("{peak:.0} GFLOP/s"));
        let versions = if self.versions.is_empty() { String::new() } else { format!(" {}.", self.versions.join(", ")) };
        format!(
            "{}; {} threads per side.{versions} Peak of a product of matrices: {peak}.",
            self.machine.in_words(),
            self.threads
        )
    }

    /// The rows of `peers.json`.
    fn rows(&self) -> Vec<Row> {
        let rows_of = |(work, measured): &(&'static WorkSpec, Vec<Measured>)| -> Vec<Row> {
            let Some((ours, peers)) = measured.split_first() else { return Vec::new() };
            let ours_seconds = ours.median();
            let alone = Row { work: work.name, ours_seconds, peer: None, peer_seconds: None, ratio: None };
            if peers.is_empty() {
                return vec![alone];
            }
            let against = |peer: &Measured| {
                let peer_seconds = peer.median();
                let ratio = Some(peer_seconds / ours_seconds);
                Row { peer: Some(peer.side.title()), peer_seconds: Some(peer_seconds), ratio, ..alone.clone() }
            };
            peers.iter().map(against).collect()
        };
        self.works.iter().flat_map(rows_of).collect()
    }

    /// Writes `peers.json` and `details.json`, each atomically.
    pub fn write_json(&self, folder: &Path) -> Result<()> {
        let details: Vec<Details> = self
            .works
            .iter()
            .flat_map(|(work, measured)| {
                measured.iter().map(|side| Details {
                    work: work.name,
                    title: work.title,
                    side: side.side.title(),
                    version: side.version.clone(),
                    seconds: side.seconds.clone(),
                    memory_bytes: side.memory_bytes,
                    gflop: side.gflop,
                })
            })
            .collect();
        write_atomically(&folder.join("peers.json"), &serde_json::to_vec_pretty(&self.rows())?)?;
        Ok(write_atomically(&folder.join("details.json"), &serde_json::to_vec_pretty(&details)?)?)
    }

    /// The rows of the last work, to print during the run.
    pub fn last_lines(&self) -> String {
        self.works.last().map(|(work, measured)| self.table_rows(work, measured)).unwrap_or_default()
    }

    /// Heading and table.
    pub fn markdown(&self) -> String {
        let mut text = format!("{}\n\n", self.heading());
        text.push_str("| work | ours | peer | peer's | ratio | wanted | memory, ours / peer's | GFLOP | of peak |\n");
        text.push_str("|---|--:|---|--:|--:|--:|--:|--:|--:|\n");
        for (work, measured) in &self.works {
            text.push_str(&self.table_rows(work, measured));
        }
        text
    }

    fn table_rows(&self, work: &WorkSpec, measured: &[Measured]) -> String {
        let mut text = String::new();
        let Some((ours, peers)) = measured.split_first() else { return text };
        let our_secs = ours.median();
        let gflop = measured.iter().find_map(|side| side.gflop);
        let share = gflop.zip(self.peak_gflops).map(|(gflop, peak)| gflop / our_secs / peak);
        let gflop = gflop.map_or(String::new(), |gflop| format!("{gflop:.1}"));
        let share = share.map_or(String::new(), |share| format!("{:.0} %", 100.0 * share));
        let our_memory = memory(ours.memory_bytes);
        if peers.is_empty() {
            let _ = writeln!(
                text,
                "| {} | {} | | | | | {our_memory} | {gflop} | {share} |",
                work.title,
                duration(our_secs)
            );
        }
        for peer in peers {
            let secs = peer.median();
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {:.2} | {} | {our_memory} / {} | {gflop} | {share} |",
                work.title,
                duration(our_secs),
                peer.side.title(),
                duration(secs),
                secs / our_secs,
                wanted(&peer.side).map_or(String::new(), |wanted| format!("{wanted:.1}")),
                memory(peer.memory_bytes),
            );
        }
        text
    }

    /// Replaces the text between the marks of a file by heading and table.
    pub fn rewrite(&self, results: &Path) -> Result<()> {
        rewrite(results, "measured", &self.markdown())
    }
}

fn wanted(side: &Side) -> Option<f64> {
    match side {
        Side::Ours => None,
        Side::Peer(Peer { wanted, .. }) => *wanted,
    }
}

fn memory(bytes: Option<u64>) -> String {
    bytes.map_or("?".to_owned(), |bytes| format!("{:.0} MiB", bytes as f64 / f64::from(1 << 20)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::WORKS;
    use serde_json::{Value, json};

    fn measured(side: Side, seconds: &[f64]) -> Measured {
        let version = format!("{} 1.0", side.title());
        Measured { side, seconds: seconds.to_vec(), memory_bytes: Some(3 << 20), gflop: None, version }
    }

    fn work(name: &str) -> &'static WorkSpec {
        WORKS.iter().find(|work| work.name == name).unwrap()
    }

    fn report() -> Report {
        let machine = Machine {
            processor: "test".to_owned(),
            cores: 2,
            instructions: "avx2".to_owned(),
            memory_gib: 8.0,
            commit: "abc".to_owned(),
        };
        let mut report = Report::new(machine, 2);
        report.set_peak(&[measured(Side::Ours, &[0.2, 0.1])]);
        let backbone = work("backbone");
        let torch = Measured { gflop: Some(43.0), ..measured(Side::Peer(&backbone.peers[0]), &[1.0, 9.0, 2.0]) };
        report.add(backbone, vec![measured(Side::Ours, &[0.5, 0.25, 1.0, 0.75]), torch]);
        report.add(work("teaching"), vec![measured(Side::Ours, &[90.0])]);
        report
    }

    #[test]
    fn peers_json_has_the_agreed_columns() {
        let folder = tempfile::tempdir().unwrap();
        report().write_json(folder.path()).unwrap();
        let text = std::fs::read_to_string(folder.path().join("peers.json")).unwrap();
        let rows: Value = serde_json::from_str(&text).unwrap();
        let expected = json!([
            // Medians: 0.625 s on our side, 2 s on the peer's.
            {"work": "backbone", "ours_seconds": 0.625, "peer": "PyTorch", "peer_seconds": 2.0, "ratio": 3.2},
            {"work": "teaching", "ours_seconds": 90.0, "peer": null, "peer_seconds": null, "ratio": null},
        ]);
        assert_eq!(rows, expected);
    }

    #[test]
    fn the_table_tells_ratio_and_share_of_the_peak() {
        let table = report().markdown();
        // The peak is 17.2 GFLOP in 0.1 s; 43 GFLOP in 0.625 s are 69 of its 172 GFLOP/s.
        let row = "| R50-FPN backbone forward, 480×640 | 625 ms | PyTorch | 2.00 s | 3.20 | 2.0 | 3 MiB / 3 MiB | 43.0 | 40 % |";
        assert!(table.contains("172 GFLOP/s") && table.contains(row), "{table}");
    }
}
