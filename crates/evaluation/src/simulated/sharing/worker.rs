//! The process that runs a unit: machine, process and Slurm job; and the hash of its program.

use std::fmt;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};
use sdg_weights_conversion::sha256_of;
use serde::{Deserialize, Serialize};

/// A process that runs units.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Worker {
    /// Slurm's name of the node, or else the machine's name.
    pub host: String,
    pub pid: u32,
    /// The Slurm job, if the process is part of one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub job: Option<String>,
}

impl Worker {
    /// This process.
    pub fn this() -> Self {
        let set = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
        let machine = || std::fs::read_to_string("/proc/sys/kernel/hostname").ok().map(|name| name.trim().to_owned());
        let host = set("SLURMD_NODENAME").or_else(machine).or_else(|| set("HOSTNAME"));
        Self { host: host.unwrap_or_else(|| "unknown".to_owned()), pid: std::process::id(), job: set("SLURM_JOB_ID") }
    }

    /// A part of a file name that is unique for this process.
    pub(super) fn file_name_part(&self, started_secs: u64) -> String {
        let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '-' || letter == '.';
        let host: String = self.host.chars().map(|letter| if is_plain(letter) { letter } else { '_' }).collect();
        format!("{host}-{}-{started_secs}", self.pid)
    }
}

impl fmt::Display for Worker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (process {}", self.host, self.pid)?;
        if let Some(job) = &self.job {
            write!(f, ", job {job}")?;
        }
        f.write_str(")")
    }
}

/// Seconds since 1970.
pub(super) fn unix_secs() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

/// The SHA-256 of the running program.
///
/// # Errors
/// The program file cannot be read.
pub fn own_sha256() -> Result<String> {
    // The running file, even if another file of this name has replaced it.
    let running = PathBuf::from("/proc/self/exe");
    let path = if running.exists() { running } else { std::env::current_exe().context("the program's own path")? };
    sha256_of(&path).with_context(|| format!("{}: the program's own file", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_worker_s_file_name_has_no_separators() {
        let worker = Worker { host: "node/7 a".to_owned(), pid: 12, job: Some("31".to_owned()) };
        assert_eq!(worker.file_name_part(1700), "node_7_a-12-1700");
        assert_eq!(worker.to_string(), "node/7 a (process 12, job 31)");
        assert_eq!(Worker::this().pid, std::process::id());
    }

    #[test]
    fn the_program_s_hash_is_that_of_its_file() {
        assert_eq!(own_sha256().unwrap(), sha256_of(&std::env::current_exe().unwrap()).unwrap());
    }
}
