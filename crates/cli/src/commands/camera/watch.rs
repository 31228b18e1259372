//! `sdg camera watch`.

use std::io::Write;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use sdg_camera::FrameStatistics;
use serde_json::json;

use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::live_pictures::{LiveArgs, open};

/// `sdg camera watch`
#[derive(Debug, Args)]
pub struct WatchArgs {
    #[command(flatten)]
    pub live: LiveArgs,
    /// Seconds to watch; default: until Ctrl-C
    #[arg(long, value_name = "SECS")]
    pub seconds: Option<f64>,
    /// Print one JSON object per second
    #[arg(long)]
    pub json: bool,
}

/// Time between lines.
const PERIOD: Duration = Duration::from_secs(1);

/// Prints one line per second: frame rate, size, brightness, faults.
pub fn run(args: &WatchArgs) -> Result<Outcome> {
    let limit = match args.seconds {
        Some(secs) if !(0.1..=1e6).contains(&secs) => {
            return Err(Usage(format!("--seconds: expected 0.1 to 1000000, found {secs}")).into());
        }
        limit => limit.map(Duration::from_secs_f64),
    };
    let interrupt = Interrupt::watch();
    let mut camera = open(&args.live.from, &args.live.options()?)?;
    let start = Instant::now();
    let mut period = FrameStatistics::begin();
    let mut num_frames = 0_u64;
    let ended = loop {
        if interrupt.is_requested() || limit.is_some_and(|limit| start.elapsed() >= limit) {
            break Ok(());
        }
        match camera.next_frame() {
            Ok(Some(frame)) => {
                num_frames += 1;
                period.add_frame(&frame);
            }
            Ok(None) => break Ok(()),
            Err(error) => match error.fault() {
                Some(fault) => period.add_fault(fault),
                None => break Err(error),
            },
        }
        if period.elapsed() >= PERIOD {
            print(&period, start, args.json)?;
            period = period.begin_next();
        }
    };
    if !period.is_empty() {
        print(&period, start, args.json)?;
    }
    ended?;
    Ok(if num_frames > 0 { Outcome::Done } else { Outcome::NothingToGrasp })
}

fn print(period: &FrameStatistics, start: Instant, is_json: bool) -> Result<()> {
    let (fps, brightness) = (period.fps(), period.brightness());
    let seconds = start.elapsed().as_secs_f64();
    let mut stdout = std::io::stdout().lock();
    if is_json {
        let faults: Vec<_> = period
            .faults
            .iter()
            .map(|(name, (count, text))| json!({"name": name, "count": count, "last": text}))
            .collect();
        let (width, height) = (period.num_frames > 0).then_some(period.size).unzip();
        let told = json!({
            "seconds": seconds, "frames": period.num_frames, "fps": fps, "missed": period.num_missed, "width": width,
            "height": height, "brightness": brightness, "faults": faults,
        });
        writeln!(stdout, "{told}")?;
    } else {
        let shown = brightness.map_or_else(String::new, |mean| {
            format!(", {} × {} pixels, mean brightness {mean:.1} of 255", period.size.0, period.size.1)
        });
        let missed = if period.num_missed > 0 { format!(", {} missed", period.num_missed) } else { String::new() };
        let faults: String = period.faults.values().map(|(count, text)| format!("; {count} times {text}")).collect();
        writeln!(stdout, "{seconds:6.1} s: {fps:.1} frames/s{missed}{shown}{faults}")?;
    }
    stdout.flush()?;
    Ok(())
}
