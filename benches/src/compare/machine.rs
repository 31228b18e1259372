//! Describes the machine of a run.

use std::process::Command;

/// The machine and the state of the repository.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    pub processor: String,
    /// Number of cores that this process may use.
    pub cores: usize,
    /// The processor's SIMD instruction sets that matter for the measurements.
    pub instructions: String,
    pub memory_gib: f64,
    /// The measured commit, with a plus sign if files differ from it.
    pub commit: String,
}

impl Machine {
    /// The machine and the commit in one line.
    pub fn in_words(&self) -> String {
        let Self { processor, cores, instructions, memory_gib, commit } = self;
        format!("{processor}, {cores} cores ({instructions}), {memory_gib:.0} GiB; commit {commit}")
    }

    /// Reads the facts from the system. A processor or commit that the system does not report is "unknown", and an
    /// unknown memory is 0.
    pub fn read() -> Self {
        let processor = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let memory = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
        Self {
            processor: processor_name(&processor),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            instructions: instructions(&processor),
            memory_gib: value(&memory, "MemTotal").and_then(kib).unwrap_or(0.0) / f64::from(1 << 20),
            commit: git(&["describe", "--always", "--dirty=+", "--abbrev=8"]).unwrap_or_else(|| "unknown".to_owned()),
        }
    }
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Value of the first line with this key.
fn value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let mut lines = text.lines().filter_map(|line| line.split_once(':'));
    lines.find(|(found, _)| found.trim() == key).map(|(_, value)| value.trim())
}

fn kib(text: &str) -> Option<f64> {
    text.strip_suffix("kB")?.trim().parse().ok()
}

/// Name, family and model number: virtual machines give many processors the same name.
fn processor_name(cpuinfo: &str) -> String {
    let of = |key| value(cpuinfo, key).unwrap_or("unknown");
    format!("{} (family {}, model {})", of("model name"), of("cpu family"), of("model"))
}

/// CPU features by which programs select their code, as Linux names them on x86 and Arm.
const FEATURES: [&str; 13] = [
    "sse4_1",
    "avx",
    "avx2",
    "fma",
    "f16c",
    "avx512f",
    "avx512bw",
    "avx512dq",
    "avx512vl",
    "avx512_vnni",
    "avx512_bf16",
    "asimd",
    "sve",
];

fn instructions(cpuinfo: &str) -> String {
    let flags = value(cpuinfo, "flags").or_else(|| value(cpuinfo, "Features")).unwrap_or_default();
    let has = |feature: &&&str| flags.split_whitespace().any(|flag| flag == **feature);
    let found: Vec<&str> = FEATURES.iter().filter(has).copied().collect();
    if found.is_empty() { "no wide instructions known".to_owned() } else { found.join(" ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_first_processor() {
        let cpuinfo = "processor\t: 0\ncpu family\t: 25\nmodel\t\t: 17\nmodel name\t: AMD EPYC\n\
                       flags\t\t: fpu avx2 avx512f\n\nprocessor\t: 1\nmodel name\t: other\n";
        assert_eq!(processor_name(cpuinfo), "AMD EPYC (family 25, model 17)");
        assert_eq!(instructions(cpuinfo), "avx2 avx512f");
        assert_eq!(instructions("flags : avx avx2 fma"), "avx avx2 fma");
        assert_eq!(instructions("Features : fp asimd"), "asimd");
        assert_eq!(instructions(""), "no wide instructions known");
    }
}
