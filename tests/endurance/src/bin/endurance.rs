//! The sections of `make endure`.

#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
fn main() -> anyhow::Result<()> {
    sections::run()
}

#[cfg(not(all(target_os = "linux", target_arch = "x86_64")))]
fn main() {
    eprintln!("endurance: expected Linux on x86-64, because it traces system calls");
    std::process::exit(1);
}

#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
mod sections {
    use std::fs;
    use std::path::PathBuf;

    use anyhow::{Context, Result, ensure};
    use clap::{Parser, Subcommand, ValueEnum};
    use sdg_endurance::flakey::FlakeyDisk;
    use sdg_endurance::scenario::{Places, Scenario};
    use sdg_endurance::soak::FrameRun;
    use sdg_endurance::{crash, refusals, soak};

    /// Tests of `sdg` under killed commands, full disks and long runs.
    #[derive(Parser)]
    struct Arguments {
        /// The program under test.
        #[arg(long, default_value = "target/release/sdg")]
        sdg: PathBuf,
        #[command(subcommand)]
        section: Section,
    }

    #[derive(Subcommand)]
    enum Section {
        /// Kills commands at random moments (seeded), each with a simulated power cut; resumes an earlier run.
        Crash {
            /// Number of kills of each command.
            #[arg(long, default_value_t = 200)]
            kills: u64,
            #[arg(long, default_value_t = 1)]
            seed: u64,
            /// A block device, whose content is lost: dm-flakey drops its writes at each kill (needs root).
            #[arg(long, value_name = "DEVICE")]
            flakey: Option<PathBuf>,
            /// Commands to test; all by default.
            #[arg(value_enum)]
            commands: Vec<Scenario>,
        },
        /// Runs commands on a full disk, on a read-only disk, without free descriptors and while the clock is set back
        /// (needs root).
        Refusals {
            /// Commands to test; all by default.
            #[arg(value_enum)]
            commands: Vec<Scenario>,
        },
        /// Live detection over many frames.
        Frames {
            /// The model's letter.
            #[arg(long, default_value = "S")]
            model: String,
            #[arg(long, default_value_t = 100_000)]
            frames: usize,
            /// Search every frame on its own instead of tracking parts.
            #[arg(long)]
            every_frame: bool,
            /// Number of frames after which the camera closes its connection.
            #[arg(long, default_value_t = usize::MAX)]
            frames_a_connection: usize,
            /// Stop after this many seconds and report the finished part.
            #[arg(long, default_value_t = 600)]
            max_secs: u64,
        },
        /// Sessions of the annotation page on one server.
        Page {
            #[arg(long, default_value_t = 500)]
            sessions: usize,
            /// Stop after this many seconds and report the finished part.
            #[arg(long, default_value_t = 600)]
            max_secs: u64,
        },
    }

    /// Runs all commands, also after one has failed.
    fn each(commands: &[Scenario], run: impl Fn(Scenario) -> Result<()>) -> Result<()> {
        let commands = if commands.is_empty() { Scenario::value_variants() } else { commands };
        let failed: Vec<String> =
            commands.iter().filter_map(|command| Some(format!("{:#}", run(*command).err()?))).collect();
        ensure!(failed.is_empty(), "{}", failed.join("\n"));
        Ok(())
    }

    pub fn run() -> Result<()> {
        let Arguments { sdg, section } = Arguments::parse();
        let root = PathBuf::from(".").canonicalize()?;
        ensure!(root.join("datasets").exists(), "expected to be started in the repository's root");
        let sdg = sdg.canonicalize().with_context(|| format!("{}: `make build` makes it", sdg.display()))?;
        let work = root.join("target/endurance");
        fs::create_dir_all(&work)?;
        let places = Places { sdg, root, work };
        match section {
            Section::Crash { kills, seed, flakey, commands } => {
                let mount = places.work.join("mount");
                let flakey = flakey.map(|device| FlakeyDisk::format(&device, &mount)).transpose()?;
                each(&commands, |command| crash::kill(command, kills, seed, &places, flakey.as_ref()))
            }
            Section::Refusals { commands } => each(&commands, |command| refusals::try_all(command, &places)),
            Section::Frames { model, frames, every_frame, frames_a_connection, max_secs } => {
                soak::detect(&FrameRun { model, frames, every_frame, frames_a_connection, max_secs }, &places)
            }
            Section::Page { sessions, max_secs } => soak::page(sessions, max_secs, &places),
        }
    }
}
