//! A script that submits an evaluation's units to Slurm: job arrays in three consecutive stages.
//!
//! Teaching runs are first; pictures and grasps start when these have ended; speed is measured at the end, each
//! unit alone on a node. An array waits for the end of the previous stage, not for its success: failed teaching does
//! not block the units of other parts, and the units of the same part report that the model is missing.

use std::fmt::Write;
use std::path::Path;

use super::unit_list::{ListedUnit, UnitKind};
use super::worker::{Worker, unix_secs};
use crate::shell_word::quoted;

/// The script of one task.
const UNIT_JOB: &str = include_str!("unit_job.sh");
/// Maximum number of tasks in an array: Slurm's default limit of the index is 1000.
const MAX_TASKS: usize = 1000;

/// The command of each task, and the resources that it requests from Slurm.
#[derive(Debug, Clone)]
pub struct SlurmJob<'a> {
    /// The program and its arguments, without --out and --unit.
    pub command: &'a [String],
    /// Absolute path of the evaluation's folder.
    pub folder: &'a Path,
    pub cores: u32,
    pub memory_mb: u32,
    pub limit_mins: u32,
    /// Additional arguments for sbatch.
    pub sbatch: &'a [String],
}

/// The script that submits the units.
pub fn submit_script(job: &SlurmJob, units: &[ListedUnit]) -> String {
    script_of_submission(job, units, &format!("submitted-{}-{}", unix_secs(), std::process::id()))
}

/// The script of the submission with this name. The lists of its units have this name too, because waiting tasks of
/// other submissions still read theirs.
fn script_of_submission(job: &SlurmJob, units: &[ListedUnit], marker: &str) -> String {
    let folder = quoted(&job.folder.display().to_string());
    let host = Worker::this().host;
    let command: Vec<String> = job.command.iter().map(|word| quoted(word)).collect();
    let unit_job = UNIT_JOB
        .replace("@FOLDER@", &folder)
        .replace("@MARKER@", marker)
        .replace("@HOST@", &host)
        .replace("@COMMAND@", &command.join(" "));
    let mut script = format!(
        "#!/usr/bin/env bash\n\
         # Hands {} units of an evaluation to Slurm; printed by `sdg evaluate --submit slurm`.\n\
         set -euo pipefail\n\
         folder={folder}\n\
         mkdir -p \"$folder/slurm\"\n\
         : >\"$folder/slurm/{marker}\"\n\
         cat >\"$folder/slurm/unit.sh\" <<'UNIT_JOB'\n{unit_job}UNIT_JOB\n\
         submit() {{ sbatch --parsable --requeue --open-mode=append --output=\"$folder/slurm/%x-%A_%a.log\"",
        units.len()
    );
    let mut line = |text: std::fmt::Arguments| {
        // Writing to a string cannot fail.
        let _ = script.write_fmt(text);
    };
    line(format_args!(" --cpus-per-task={} --mem={}M --time={}", job.cores, job.memory_mb, job.limit_mins));
    for argument in job.sbatch {
        line(format_args!(" {}", quoted(argument)));
    }
    line(format_args!(" \"$@\" | cut -d ';' -f 1; }}\n"));
    let mut before: Vec<String> = Vec::new();
    let arrays: [(&str, &[UnitKind], &str); 3] = [
        ("teach", &[UnitKind::Teach], ""),
        ("try", &[UnitKind::Look, UnitKind::Grasp], ""),
        ("time", &[UnitKind::Time], " --exclusive"),
    ];
    for (list, kinds, alone) in arrays {
        let is_in_list = |unit: &&ListedUnit| UnitKind::of(&unit.name).is_some_and(|kind| kinds.contains(&kind));
        let names: Vec<&str> = units.iter().filter(is_in_list).map(|unit| unit.name.as_str()).collect();
        if names.is_empty() {
            continue;
        }
        line(format_args!("cat >\"$folder/slurm/{marker}-{list}.units\" <<'UNITS'\n{}\nUNITS\n", names.join("\n")));
        let waits = match before.is_empty() {
            true => String::new(),
            false => format!(" --dependency=\"afterany:{}\"", before.join(":")),
        };
        before.clear();
        for (array, tasks) in names.chunks(MAX_TASKS).enumerate() {
            let variable = format!("{list}_{array}");
            line(format_args!(
                "{variable}=$(submit --job-name=sdg-{list} --array=0-{}{waits}{alone} \"$folder/slurm/unit.sh\" {list} {})\n",
                tasks.len() - 1,
                array * MAX_TASKS
            ));
            line(format_args!("echo \"{list}: job ${variable}, {} units\"\n", tasks.len()));
            before.push(format!("${{{variable}}}"));
        }
    }
    script
}

/// The number of each submitted array in what the script printed.
pub fn submitted_jobs(printed: &str) -> Vec<&str> {
    printed.lines().filter_map(|line| line.split_once(": job ")?.1.split_once(", ")).map(|(job, _)| job).collect()
}

/// The number of cores that Slurm allocated, or else the machine's.
pub fn cores() -> usize {
    let given = std::env::var("SLURM_CPUS_PER_TASK").ok().and_then(|cores| cores.parse().ok());
    given.filter(|&cores| cores > 0).unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from))
}

#[cfg(test)]
mod tests {
    use super::super::unit_list::all_units;
    use super::*;
    use sdg_grasp::ModelKind;
    use sdg_simulation::objects::ObjectSpec;

    #[test]
    fn arrays_wait_for_each_other() {
        let objects = ["pendulum", "rod_end"].map(|name| ObjectSpec::by_name(name).unwrap());
        let units = all_units(&[ModelKind::S, ModelKind::C], &objects, false);
        let command = ["/opt/a program/sdg", "evaluate", "--seed", "3"].map(str::to_owned);
        let job = SlurmJob {
            command: &command,
            folder: Path::new("/shared/run"),
            cores: 2,
            memory_mb: 1500,
            limit_mins: 40,
            sbatch: &["--partition=cpu".to_owned()],
        };
        let script = script_of_submission(&job, &units, "submitted-1");
        for expected in [
            "--requeue",
            "cat >\"$folder/slurm/submitted-1-teach.units\" <<'UNITS'\n",
            "p\" \"$folder/slurm/submitted-1-$list.units\")",
            "--cpus-per-task=2 --mem=1500M --time=40 --partition=cpu",
            "teach_0=$(submit --job-name=sdg-teach --array=0-3 \"$folder",
            "try_0=$(submit --job-name=sdg-try --array=0-5 --dependency=\"afterany:${teach_0}\" ",
            "time_0=$(submit --job-name=sdg-time --array=0-1 --dependency=\"afterany:${try_0}\" --exclusive",
            "'/opt/a program/sdg' evaluate --seed 3 --out \"$folder\" --unit \"$unit\"",
            "\nteach-S-pendulum\nteach-C-pendulum\nteach-S-rod_end\nteach-C-rod_end\nUNITS\n",
        ] {
            assert!(script.contains(expected), "{expected}\n{script}");
        }
        assert!(!script.contains('@') || !script.contains("@FOLDER@"), "{script}");
        // A later submission of other units leaves these lists as they are.
        let later = script_of_submission(&job, &units[1..], "submitted-2");
        let lists = |script: &str| -> Vec<String> {
            script.lines().filter(|line| line.ends_with(".units\" <<'UNITS'")).map(str::to_owned).collect()
        };
        assert_eq!((lists(&script).len(), lists(&later).len()), (3, 3));
        assert!(lists(&later).iter().all(|list| !lists(&script).contains(list)), "{later}");
    }

    #[test]
    fn long_lists_are_several_arrays() {
        let objects = [ObjectSpec::by_name("pendulum").unwrap()];
        let one = all_units(&[ModelKind::S], &objects, false);
        let many: Vec<_> = (0..2500).map(|i| ListedUnit { name: format!("teach-S-{i}"), ..one[0].clone() }).collect();
        let job =
            SlurmJob { command: &[], folder: Path::new("/shared"), cores: 1, memory_mb: 1, limit_mins: 1, sbatch: &[] };
        let script = submit_script(&job, &many);
        assert!(
            script
                .contains("teach_2=$(submit --job-name=sdg-teach --array=0-499 \"$folder/slurm/unit.sh\" teach 2000)")
        );
        assert_eq!(script.matches("--array=0-999").count(), 2);
    }
}
