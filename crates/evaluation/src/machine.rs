//! The machine on which a report's numbers were measured.

/// Cores, architecture, operating system, and the processor's name if available.
pub fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let named = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| processor(&text));
    let named = named.map(|name| format!(" ({name})")).unwrap_or_default();
    format!("{cores} cores{named}, {} {}", std::env::consts::ARCH, std::env::consts::OS)
}

fn processor(cpuinfo: &str) -> Option<String> {
    let line = cpuinfo.lines().find(|line| line.starts_with("model name"))?;
    let name = line.split_once(':')?.1.trim();
    (!name.is_empty()).then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_s_name_is_read_where_there_is_one() {
        let cpuinfo = "processor\t: 0\nmodel name\t: AMD EPYC 9B14\nstepping\t: 1\n";
        assert_eq!(processor(cpuinfo).as_deref(), Some("AMD EPYC 9B14"));
        assert_eq!(processor("processor\t: 0\n"), None);
        assert!(machine().contains("cores"));
    }
}
