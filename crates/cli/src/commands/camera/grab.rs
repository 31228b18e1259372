//! `sdg camera grab`.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;
use sdg_calibration::CalibratedCamera;
use sdg_camera::{Address, Frame, LatestFrame, OpenOptions, PixelFrame};
use sdg_inputs::camera_files;
use serde_json::json;

use crate::exit::{Outcome, Usage};
use crate::interrupt::Interrupt;
use crate::live_pictures::{LiveArgs, next_frame, open};
use crate::output_paths::prepare_new_folder;

/// `sdg camera grab`
#[derive(Debug, Args)]
pub struct GrabArgs {
    #[command(flatten)]
    pub live: LiveArgs,
    /// The file of the calibrated camera, for frames that are used with --camera: they must have its size, and are not
    /// rotated as an Exif orientation says
    #[arg(long, value_name = "FILE")]
    pub camera: Option<PathBuf>,
    /// Number of frames
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub count: u32,
    /// Seconds between frames; default: no wait
    #[arg(long, value_name = "SECS", default_value_t = 0.0)]
    pub every: f64,
    /// A new PNG file for one frame; a new or empty folder for several
    #[arg(long, value_name = "FILE|FOLDER")]
    pub out: PathBuf,
    /// Print a JSON object for each frame
    #[arg(long)]
    pub json: bool,
}

/// Writes frames to PNG files.
pub fn run(args: &GrabArgs) -> Result<Outcome> {
    if !(0.0..=86400.0).contains(&args.every) {
        return Err(Usage(format!("--every: expected 0 to 86400 seconds, found {}", args.every)).into());
    }
    let is_file = args.count == 1 && !args.out.is_dir();
    if is_file {
        let is_png = args.out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
        if !is_png {
            let found = args.out.display();
            return Err(Usage(format!("--out: expected a file that ends in .png, or a folder, found {found}")).into());
        }
        if std::fs::metadata(&args.out).is_ok_and(|file| file.len() > 0) {
            let found = args.out.display();
            return Err(Usage(format!("--out: expected a new name, found the existing file {found}")).into());
        }
        sdg_files::check_writable(&args.out)?;
    } else {
        prepare_new_folder("--out", &args.out)?;
        // With `follow`, every written frame would be the next one to read.
        if let Address::Folder { path, .. } = &args.live.from
            && sdg_files::is_same_file(path, &args.out)
        {
            let found = args.out.display();
            return Err(Usage(format!("--out: expected another folder than that of --from, found {found}")).into());
        }
    }
    let calibrated = args.camera.as_deref().map(camera_files::read).transpose()?.map(|(camera, _)| camera);
    if let Address::File { path, .. } | Address::Folder { path, .. } = &args.live.from {
        sdg_files::keep(path);
    }
    let interrupt = Interrupt::watch();
    let mut camera = open(&args.live.from, &options(&args.live, calibrated.as_ref())?)?;
    // A live camera delivers frames during the wait: the newest frame is taken, and older ones are dropped.
    if args.every > 0.0 && args.live.from.is_live() {
        camera = Box::new(LatestFrame::spawn(camera));
    }
    let mut due = Instant::now();
    let mut num_written = 0;
    while num_written < args.count && !interrupt.is_requested() {
        while Instant::now() < due && !interrupt.is_requested() {
            std::thread::sleep(due.saturating_duration_since(Instant::now()).min(Duration::from_millis(100)));
        }
        let Some(frame) = next_frame(camera.as_mut(), &interrupt)? else {
            break;
        };
        // From this frame and not from the start: after a pause of the camera, missed frames are not made up for.
        due = Instant::now() + Duration::from_secs_f64(args.every);
        if let Some(calibrated) = &calibrated {
            let size = frame.picture.dimensions();
            calibrated.check_picture(size).with_context(|| format!("frame {} of {}", frame.number, args.live.from))?;
        }
        let path = if is_file { args.out.clone() } else { args.out.join(format!("{num_written:06}.png")) };
        sdg_files::write_png(&path, &frame.picture)?;
        print_frame(&path, &frame, args.json);
        num_written += 1;
    }
    if num_written == 0 {
        bail!("{}: expected a frame, found none", args.live.from);
    }
    if num_written < args.count {
        let why = if interrupt.is_requested() { "interrupted" } else { "the source has no more" };
        eprintln!("sdg: {num_written} of {} frames; {why}", args.count);
    }
    Ok(Outcome::Done)
}

/// The settings of the camera; those of a calibrated camera give its size and the pixels that were calibrated.
fn options(live: &LiveArgs, calibrated: Option<&CalibratedCamera>) -> Result<OpenOptions, Usage> {
    let mut options = live.options()?;
    if let Some(calibrated) = calibrated {
        options.frame = PixelFrame::Sensor;
        if live.request.size.is_none() {
            (options.width, options.height) = (calibrated.intrinsics.width, calibrated.intrinsics.height);
        }
    }
    Ok(options)
}

fn print_frame(path: &Path, frame: &Frame, is_json: bool) {
    let unix_secs = frame.captured_unix_secs();
    let (width, height) = frame.picture.dimensions();
    if is_json {
        let faults: Vec<_> = frame.faults.iter().map(|fault| fault.name()).collect();
        let told = json!({
            "file": path.display().to_string(), "camera": &*frame.camera, "number": frame.number, "captured_unix_secs": unix_secs,
            "width": width, "height": height, "faults": faults,
        });
        println!("{told}");
    } else {
        let faults: String = frame.faults.iter().map(|fault| format!("; {fault}")).collect();
        let number = frame.number;
        println!(
            "{}: frame {number}, {width} × {height} pixels, at {unix_secs:.3} s (Unix time){faults}",
            path.display()
        );
    }
}
