//! `sdg camera watch`.

use std::collections::BTreeMap;
use std::io::Write;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use sdg_camera::{Fault, Frame, mean_brightness};
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
    let mut camera = open(&args.live.from, &args.live.options())?;
    let start = Instant::now();
    let mut period = Period::new();
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
        if period.start.elapsed() >= PERIOD {
            period.print(start, args.json)?;
            period = Period { last_number: period.last_number, ..Period::new() };
        }
    };
    if !period.is_empty() {
        period.print(start, args.json)?;
    }
    ended?;
    Ok(if num_frames > 0 { Outcome::Done } else { Outcome::NothingToGrasp })
}

/// The measurements that one line reports.
struct Period {
    start: Instant,
    num_frames: u64,
    num_missed: u64,
    last_number: Option<u64>,
    size: (u32, u32),
    brightness_sum: f64,
    /// For each fault's name: the count and the text of the last fault.
    faults: BTreeMap<&'static str, (u64, String)>,
}

impl Period {
    fn new() -> Self {
        Self {
            start: Instant::now(),
            num_frames: 0,
            num_missed: 0,
            last_number: None,
            size: (0, 0),
            brightness_sum: 0.0,
            faults: BTreeMap::new(),
        }
    }

    fn is_empty(&self) -> bool {
        self.num_frames == 0 && self.faults.is_empty()
    }

    fn add_frame(&mut self, frame: &Frame) {
        self.num_frames += 1;
        self.num_missed += self.last_number.map_or(0, |last| frame.number.saturating_sub(last + 1));
        self.last_number = Some(frame.number);
        self.size = frame.picture.dimensions();
        self.brightness_sum += mean_brightness(&frame.picture);
        for fault in &frame.faults {
            self.add_fault(fault);
        }
    }

    fn add_fault(&mut self, fault: &Fault) {
        let entry = self.faults.entry(fault.name()).or_default();
        *entry = (entry.0 + 1, fault.to_string());
    }

    fn print(&self, start: Instant, is_json: bool) -> Result<()> {
        let fps = self.num_frames as f64 / self.start.elapsed().as_secs_f64();
        let brightness = (self.num_frames > 0).then(|| self.brightness_sum / self.num_frames as f64);
        let seconds = start.elapsed().as_secs_f64();
        let mut stdout = std::io::stdout().lock();
        if is_json {
            let faults: Vec<_> = self
                .faults
                .iter()
                .map(|(name, (count, text))| json!({"name": name, "count": count, "last": text}))
                .collect();
            let told = json!({
                "seconds": seconds, "frames": self.num_frames, "fps": fps, "missed": self.num_missed, "width": self.size.0,
                "height": self.size.1, "brightness": brightness, "faults": faults,
            });
            writeln!(stdout, "{told}")?;
        } else {
            let shown = brightness.map_or_else(String::new, |mean| {
                format!(", {} × {} pixels, mean brightness {mean:.1} of 255", self.size.0, self.size.1)
            });
            let missed = if self.num_missed > 0 { format!(", {} missed", self.num_missed) } else { String::new() };
            let faults: String = self.faults.values().map(|(count, text)| format!("; {count} times {text}")).collect();
            writeln!(stdout, "{seconds:6.1} s: {fps:.1} frames/s{missed}{shown}{faults}")?;
        }
        stdout.flush()?;
        Ok(())
    }
}
