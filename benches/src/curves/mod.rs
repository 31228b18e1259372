//! `sdg-bench curves`: the time of model S as a function of pixels, parts in the picture and edge points.
//!
//! ```text
//! shipped photo ─ the part drawn on its table, rotated ─ pictures that differ in one number ─ median time ─ table, exponents
//! ```
//! With an exponent of 1, the time is proportional to the varied number. The exponent of a curve comes from its first
//! and last row.

mod table;

use std::ops::{ControlFlow, RangeInclusive};
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args as ClapArgs;
use image::RgbImage;
use sdg_demonstration::Demonstration;
use sdg_geometry::median;
use sdg_grasp::{CheckConfig, GraspModel, ModelKind, SearchRegion, TeachOptions, Verification, teach};

use self::table::{Curve, Row};
use crate::compare::machine::Machine;
use crate::results::rewrite;
use crate::turned_parts::{add_strokes, photo_of_size, picture, poses};
use crate::works::read_demonstration;

/// `sdg-bench curves`
#[derive(Debug, ClapArgs)]
pub struct CurvesArgs {
    /// Root of the repository
    #[arg(long, default_value = ".", value_name = "DIR")]
    root: PathBuf,
    /// Name of the shipped part
    #[arg(long, default_value = "pendulum", value_name = "NAME")]
    part: String,
    /// Measure only the region of 200×200
    #[arg(long)]
    region_only: bool,
    /// Maximum seconds per row, but at least three runs
    #[arg(long, default_value_t = 3.0, value_name = "SECS")]
    secs: f64,
    /// Rewrite the table in this file
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
}

/// Minimum and maximum number of timed runs of a row, after one untimed run.
const RUNS: RangeInclusive<usize> = 3..=25;
/// Sizes of pictures, up to 12 megapixels.
const SIZES: [[u32; 2]; 5] = [[320, 240], [640, 480], [1280, 960], [2560, 1920], [4000, 3000]];
const PARTS: [u32; 6] = [1, 2, 4, 8, 16, 32];
const SEARCH_POINTS: [usize; 6] = [16, 32, 64, 128, 256, 512];
const STROKES: [u32; 5] = [0, 50, 100, 200, 400];
/// Size of the pictures of the curves over parts and strokes.
const WIDE: [u32; 2] = [1280, 960];
const REGION_PX: u32 = 200;

/// Measures all curves and prints them.
pub fn run(args: &CurvesArgs) -> Result<()> {
    let photo = read_demonstration(&args.root.join("datasets/demonstrations").join(&args.part))?;
    let bench = Bench { photo, secs: args.secs };
    let mut text = format!("{}; part {}, model S, medians.\n", Machine::read().in_words(), args.part);
    let curves = match args.region_only {
        true => Vec::new(),
        false => vec![bench.pixels()?, bench.parts()?, bench.search_points()?, bench.strokes()?],
    };
    for curve in &curves {
        eprint!("{}", curve.markdown());
        text += &format!("\n{}", curve.markdown());
    }
    let region = bench.region()?;
    text += &format!("\n{region}");
    println!("{text}");
    if let Some(results) = args.results.as_ref().filter(|_| !args.region_only) {
        rewrite(results, "curves", &text)?;
    }
    Ok(())
}

struct Bench {
    photo: Demonstration,
    secs: f64,
}

/// The measured tolerances of the part's size: free, which is the default, and fixed.
const TOLERANCES: [(&str, RangeInclusive<f64>); 2] =
    [("free", CheckConfig::DEFAULT_SIZE_TOLERANCE), ("fixed", CheckConfig::FIXED_HEIGHT_TOLERANCE)];

impl Bench {
    /// Model S from a photo of the size of the pictures, for each tolerance.
    fn models(&self, size: [u32; 2]) -> Result<[GraspModel; 2]> {
        let mut options = TeachOptions::new(1);
        options.kind = ModelKind::S;
        let taught = teach(&[photo_of_size(&self.photo, size)], &options, &mut |_| ControlFlow::Continue(()))?;
        let [free, fixed] = TOLERANCES.map(|(_, tolerance)| taught.model.clone().with_size_tolerance(tolerance));
        Ok([free?, fixed?])
    }

    /// Median seconds of a detection, and number of parts found.
    fn time(&self, model: &GraspModel, picture: &RgbImage) -> Result<(f64, usize)> {
        let detect = || model.detect(picture, Verification::ByShape);
        let num_found = detect()?.iter().filter(|found| found.is_accepted()).count();
        let (begun, mut seconds) = (Instant::now(), Vec::new());
        while seconds.len() < *RUNS.start()
            || (seconds.len() < *RUNS.end() && begun.elapsed().as_secs_f64() < self.secs)
        {
            let start = Instant::now();
            std::hint::black_box(detect()?);
            seconds.push(start.elapsed().as_secs_f64());
        }
        Ok((median(seconds).context("expected times of a row, found none")?, num_found))
    }

    fn row(&self, number: f64, num_parts: u32, models: &[GraspModel; 2], picture: &RgbImage) -> Result<Row> {
        let [(free, found_free), (fixed, found_fixed)] =
            [self.time(&models[0], picture)?, self.time(&models[1], picture)?];
        Ok(Row { number, num_parts, found: [found_free, found_fixed], seconds: [free, fixed] })
    }

    fn pixels(&self) -> Result<Curve> {
        let row = |size: &[u32; 2]| {
            let pixels = f64::from(size[0]) * f64::from(size[1]);
            self.row(pixels, 1, &self.models(*size)?, &picture(&self.photo, *size, &poses(&self.photo, *size, 1, 25.0)))
        };
        Curve::new("pixels of the picture, one part", SIZES.iter().map(row))
    }

    fn parts(&self) -> Result<Curve> {
        let models = self.models(WIDE)?;
        let row = |count: &u32| {
            let shown = picture(&self.photo, WIDE, &poses(&self.photo, WIDE, *count, 25.0));
            self.row(f64::from(*count), *count, &models, &shown)
        };
        Curve::new("parts in a picture of 1280×960", PARTS.iter().map(row))
    }

    fn search_points(&self) -> Result<Curve> {
        let size = [640, 480];
        let shown = picture(&self.photo, size, &poses(&self.photo, size, 1, 25.0));
        let models = self.models(size)?;
        let row = |count: &usize| {
            let [free, fixed] = models.clone().map(|model| model.with_search_points(*count));
            self.row(*count as f64, 1, &[free?, fixed?], &shown)
        };
        Curve::new("edge points compared at each pose, 640×480, one part", SEARCH_POINTS.iter().map(row))
    }

    fn strokes(&self) -> Result<Curve> {
        let models = self.models(WIDE)?;
        let bare = picture(&self.photo, WIDE, &poses(&self.photo, WIDE, 1, 25.0));
        let row = |count: &u32| {
            let mut shown = bare.clone();
            add_strokes(&mut shown, *count);
            self.row(num_edge_pixels(&shown) as f64, 1, &models, &shown)
        };
        Curve::new("edge pixels of a picture of 1280×960: 0 to 400 strokes beside one part", STROKES.iter().map(row))
    }

    /// Compares a region around the part, with sides of [`REGION_PX`], with the whole picture.
    fn region(&self) -> Result<String> {
        let mut text =
            String::from("| a region of 200×200 about the part | whole | region | ratio |\n|---|--:|--:|--:|\n");
        for size in [SIZES[1], SIZES[4]] {
            let shown = picture(&self.photo, size, &poses(&self.photo, size, 1, 25.0));
            for (model, (name, _)) in self.models(size)?.into_iter().zip(TOLERANCES) {
                let corner = size.map(|side| (side - REGION_PX) / 2);
                let region = SearchRegion::new([corner[0], corner[1], REGION_PX, REGION_PX]);
                let whole = self.time(&model, &shown)?.0;
                let (part, num_found) = self.time(&model.with_region(Some(region))?, &shown)?;
                anyhow::ensure!(num_found == 1, "expected the part in the region, found {num_found}");
                let [width, height] = size;
                text += &format!(
                    "| {width}×{height}, size {name} | {:.1} ms | {:.1} ms | {:.2} |\n",
                    1e3 * whole,
                    1e3 * part,
                    whole / part
                );
            }
        }
        Ok(text)
    }
}

/// Number of pixels that differ from a neighbour by more than noise.
fn num_edge_pixels(picture: &RgbImage) -> usize {
    const EDGE: u8 = 24;
    let differ =
        |x: u32, y: u32, u: u32, v: u32| picture.get_pixel(x, y)[1].abs_diff(picture.get_pixel(u, v)[1]) > EDGE;
    let (width, height) = picture.dimensions();
    let inner = (0..height - 1).flat_map(|y| (0..width - 1).map(move |x| (x, y)));
    inner.filter(|&(x, y)| differ(x, y, x + 1, y) || differ(x, y, x, y + 1)).count()
}
