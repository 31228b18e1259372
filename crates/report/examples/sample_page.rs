//! A page with most kinds of blocks, filled with made-up numbers and pictures, for working on its style.
//!
//! `cargo run --release -p sdg-report --example sample_page -- DIR` writes `DIR/index.html`.

use image::{Rgb, RgbImage};
use nalgebra::{Point2, Vector2};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_geometry::{GraspLine, PlanarGrasp, PlanarSimilarity, Polygon, median};
use sdg_report::{
    Animation, AnimationOptions, AttemptSummary, Axis, Chart, Color, DetectionError, DetectionMark, Figure,
    GallerySize, KeyFigure, Report, Section, Series, ShareChart, Tone, Verdict, attempts_table, draw_demonstration,
    draw_detections, outcome_matrix, shade_polygon,
};

const SIZE: (u32, u32) = (640, 480);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "report".to_owned());
    let path = report()?.write(folder.as_ref())?;
    println!("{}", path.display());
    Ok(())
}

fn report() -> Result<Report, sdg_report::ReportError> {
    let attempts = attempts();
    let held = attempts.iter().filter(|attempt| attempt.success).count();
    let distances = attempts.iter().filter_map(|a| a.detection_error.map(|e| e.distance_mm));
    let error_mm = format!("{:.1}", median(distances).unwrap_or(f64::NAN));
    Ok(Report::new("Pendulum, taught from one photo")
        .kicker("Rehearsal in simulation")
        .lead(
            "One photograph, one marked grasp, 142 seconds of teaching on two cores. \
             The robot then searched for the part, moved to it and lifted it, ten times from unseen poses.",
        )
        .cover(Figure::animation(animation()?).alt("The wrist camera comes down on the pendulum and the jaws close.").caption("Attempt 1 from the wrist camera, at twice its speed: look, hover, approach, close, lift."))
        .key_figure(KeyFigure::new("142", "s", "to teach, from one photo"))
        .key_figure(KeyFigure::new(held.to_string(), "of 10", "grasped and held").tone(Tone::Good))
        .key_figure(KeyFigure::new(error_mm, "mm", "median error of detection"))
        .key_figure(KeyFigure::new("0", "of 50", "false alarms without the part"))
        .section(demonstration())
        .section(teaching())
        .section(detections())
        .section(
            Section::new("Attempts")
                .lead("Random poses and start configurations. Held means: at least 10 cm above the table between both fingers, one second after lifting.")
                .matrix(outcome_matrix(&STEPS, "held", &attempts, 10.0, 10.0))
                .shares(
                    ShareChart::new("Attempts that held the part")
                        .reference_name("the paper")
                        .row("A", 92.5, [84.6, 96.5], Some(91.3))
                        .row("B", 97.5, [91.3, 99.3], Some(82.5))
                        .row("S", 78.8, [68.6, 86.3], None),
                )
                .table(attempts_table(&STEPS, "held", &attempts).caption(
                    "The part's position is in the robot's base frame. Errors are those of the second detection, from \
                     above the part.",
                )),
        )
        .section(
            Section::new("This run")
                .lead("Settings for reproducing the numbers.")
                .facts([
                    ("object", "pendulum"),
                    ("grasp model", "C, 12 keypoints"),
                    ("preset", "edge"),
                    ("seed", "7"),
                    ("steps", "300 of at most 600, stopped early"),
                    ("model file", "9.1 MB, sha256 5c0e9a4d1b7f4a39c2f1d0e8b6a7"),
                    ("machine", "2 cores, Cascade Lake, 2.5 GHz, AVX-512"),
                    ("version", "sdg 0.1.0, burn 0.22.1, MuJoCo 2.2.2"),
                    ("written", "2026-11-21 02:00 UTC"),
                    ("took", "8 min 12 s in all"),
                ])
                .command("sdg demo --seed 7\nsdg rehearse --grasp-model report/pendulum.safetensors --object pendulum --attempts 10 --seed 7"),
        )
        .footer("Made by sdg. This page is one file: it fetches nothing and runs no script."))
}

fn demonstration() -> Section {
    let raw = scene(&Pose::demonstration(), 1, true);
    let pose = Pose::demonstration().image_from_part();
    let outline = part_outline().transformed(&pose);
    let line = grasp_line().transformed(&pose);
    let grasp = PlanarGrasp::from_line(&line, 46.0 * pose.scale);
    let mut marked = raw.clone();
    draw_demonstration(&mut marked, &outline.bounds(), Some(&outline), Some(&line), Some(&grasp));
    let samples = (0..24).map(|idx| {
        let mut pose = Pose::random(idx);
        pose.scale *= 0.9;
        let mut sample = scene(&pose, 100 + idx, idx % 6 != 5);
        if idx % 6 != 5 {
            let outline = part_outline().transformed(&pose.image_from_part());
            sdg_report::draw_box(&mut sample, &outline.bounds(), &sdg_report::Pen::new(Color::BOX).width(4.0));
        }
        Figure::photo(sample).alt(format!("augmented sample {idx}"))
    });
    Section::new("Demonstration")
        .lead("Human input: a photograph, a box, an outline, and a line along which to grasp.")
        .gallery(
            GallerySize::Large,
            vec![
                Figure::photo(raw).caption("As photographed by the wrist camera."),
                Figure::photo(marked).caption(
                    "As marked: box (blue), outline (yellow), grasp line (dashed), and the jaws computed from it \
                     (orange).",
                ),
            ],
        )
        .captioned_gallery(
            GallerySize::Small,
            samples.collect(),
            "Augmented samples 0 to 23. Each sixth scene is without the part, so that the model learns to reject.",
        )
}

fn teaching() -> Section {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut loss = |scale: f64, tau: f64| -> Vec<(f64, f64)> {
        (0..300)
            .map(|step| {
                let step = f64::from(step);
                (step, scale * (0.08 + (-step / tau).exp()) * random.random_range(0.7..1.3))
            })
            .collect()
    };
    let losses = Chart::new("Training loss", Axis::new("step"), Axis::new("loss").logarithmic())
        .series(Series::new("keypoints", loss(7.0, 70.0)).noisy())
        .series(Series::new("box and class", loss(1.4, 50.0)).noisy())
        .series(Series::new("proposals", loss(0.7, 30.0)).noisy())
        .caption("Each step, and its running mean.");
    let every = |values: &[f64]| -> Vec<(f64, f64)> {
        values.iter().zip(1u32..).map(|(&value, k)| (25.0 * f64::from(k), value)).collect()
    };
    let millimetres = [41.0, 22.0, 12.5, 8.1, 5.0, 3.9, 3.1, 2.4, 1.9, 1.7, 1.55, 1.6];
    let degrees = [38.0, 14.0, 7.0, 4.1, 2.2, 1.7, 1.2, 1.0, 0.9, 0.85, 0.8, 0.82];
    let place = Chart::new("Validation: place", Axis::new("step"), Axis::new("error").unit("mm").logarithmic())
        .series(Series::new("median", every(&millimetres)).with_markers())
        .series(Series::new("95th percentile", every(&millimetres.map(|v| 2.7 * v + 1.0))).with_markers())
        .limit(10.0, "limit 10 mm")
        .moment(275.0, "kept");
    let angle = Chart::new("Validation: angle", Axis::new("step"), Axis::new("error").unit("°").from_zero())
        .series(Series::new("median", every(&degrees)).with_markers())
        .limit(10.0, "limit 10°")
        .moment(275.0, "kept")
        .caption("On 64 held-out augmentations.");
    let found = Chart::new("Validation: found", Axis::new("step"), Axis::new("share").unit("%").from_zero())
        .series(
            Series::new(
                "within 10 mm and 10°",
                every(&[8.0, 30.0, 52.0, 71.0, 84.0, 90.0, 94.0, 97.0, 98.0, 99.0, 100.0, 100.0]),
            )
            .with_markers(),
        )
        .series(
            Series::new("false alarms", every(&[0.0, 6.0, 22.0, 18.0, 12.0, 8.0, 5.0, 3.0, 1.0, 0.0, 0.0, 0.0]))
                .with_markers(),
        );
    Section::new("Teaching")
        .lead("300 steps of four pictures in 142 s. The checkpoint with the smallest error was kept.")
        .charts(vec![losses, place, angle, found])
}

fn detections() -> Section {
    let pictures = (0..6).map(|idx: u64| {
        let pose = Pose::random(40 + idx);
        let refused = idx == 4;
        let mut picture = scene(&pose, 500 + idx, !refused);
        let image_from_part = pose.image_from_part();
        let outline = part_outline().transformed(&image_from_part);
        let line = grasp_line().transformed(&image_from_part);
        let mark = DetectionMark {
            bounds: Some(outline.bounds()),
            outline: (!refused).then_some(&outline),
            keypoints: &line.keypoints(12),
            grasp: Some(PlanarGrasp::from_line(&line, 46.0 * image_from_part.scale)),
            score: if refused { 0.21 } else { 0.97 - 0.01 * idx as f64 },
            verdict: if refused { Verdict::Refused } else { Verdict::Verified },
            number: None,
        };
        draw_detections(&mut picture, &[mark]);
        Figure::photo(picture).caption(if refused {
            format!(
                "Test image {idx}: no part in the picture; the network detected one, and the demonstration did \
                     not agree (0.66)."
            )
        } else {
            format!("Test image {idx}: error {:.1} mm, {:.1}°.", 0.6 + 0.3 * idx as f64, 0.2 + 0.1 * idx as f64)
        })
    });
    Section::new("Detections")
        .lead("On images not used for teaching: other poses, light, table, and distractors.")
        .gallery(GallerySize::Medium, pictures.collect())
        .notice(Tone::Warning, "One of six was refused: the demonstration did not agree with the image.")
}

/// The steps of an attempt, with the names of `sdg_robot::GraspStep`.
const STEPS: [&str; 6] = ["detect", "hover", "approach", "close", "lift", "hold"];

fn attempts() -> Vec<AttemptSummary> {
    let mut random = Pcg64Mcg::seed_from_u64(11);
    (1..=10)
        .map(|number| {
            let success = number != 7;
            AttemptSummary {
                number,
                object_mm: [random.random_range(430.0..620.0), random.random_range(-160.0..160.0)],
                object_angle_deg: random.random_range(-180.0..180.0),
                detection_error: Some(DetectionError {
                    distance_mm: random.random_range(0.4..2.2),
                    angle_deg: random.random_range(0.05..1.1),
                }),
                step: Some(if success { 5 } else { 4 }),
                not_found: false,
                success,
                why: if success {
                    String::new()
                } else {
                    "the part slipped out of the fingers 31 mm above the table".into()
                },
                duration_secs: random.random_range(8.4..11.9),
            }
        })
        .collect()
}

/// The part's pose in a picture.
struct Pose {
    x: f64,
    y: f64,
    angle: f64,
    scale: f64,
}

impl Pose {
    fn demonstration() -> Self {
        Self { x: 330.0, y: 235.0, angle: 0.45, scale: 1.35 }
    }

    fn random(seed: u64) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        Self {
            x: random.random_range(220.0..420.0),
            y: random.random_range(170.0..310.0),
            angle: random.random_range(-3.1..3.1),
            scale: random.random_range(0.95..1.2),
        }
    }

    fn image_from_part(&self) -> PlanarSimilarity {
        PlanarSimilarity {
            scale: self.scale,
            angle: sdg_geometry::Angle::from_radians(self.angle),
            tx: self.x,
            ty: self.y,
        }
    }
}

fn grasp_line() -> GraspLine {
    GraspLine::new(Point2::new(-60.0, 0.0), Point2::new(60.0, 0.0))
}

/// A bar with a large eye and a small eye.
fn part_outline() -> Polygon {
    let arc = |center: f64, radius: f64, from: f64, to: f64| {
        (0..=24).map(move |k| {
            let angle = from + (to - from) * f64::from(k) / 24.0;
            Point2::new(center, 0.0) + Vector2::new(angle.cos(), angle.sin()) * radius
        })
    };
    Polygon { vertices: arc(-95.0, 46.0, 0.35, 5.93).chain(arc(95.0, 30.0, -2.6, 2.6)).collect() }
}

fn disc(center: Point2<f64>, radius: f64) -> Polygon {
    let corner = |k: u32| {
        let angle = f64::from(k) / 40.0 * std::f64::consts::TAU;
        center + Vector2::new(angle.cos(), angle.sin()) * radius
    };
    Polygon { vertices: (0..40).map(corner).collect() }
}

fn scene(pose: &Pose, seed: u64, with_part: bool) -> RgbImage {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let tint: [f64; 3] =
        [random.random_range(110.0..190.0), random.random_range(110.0..180.0), random.random_range(100.0..170.0)];
    let slope: (f64, f64) = (random.random_range(-0.08..0.08), random.random_range(-0.08..0.08));
    let mut image = RgbImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        let light =
            slope.0 * (f64::from(x) - 320.0) + slope.1 * (f64::from(y) - 240.0) + random.random_range(-5.0..5.0);
        Rgb(tint.map(|channel| (channel + light) as u8))
    });
    for _ in 0..4 {
        let center = Point2::new(random.random_range(40.0..600.0), random.random_range(40.0..440.0));
        let side = random.random_range(14.0..34.0);
        let shade = random.random_range(40..200u8);
        shade_polygon(&mut image, &disc(center + Vector2::new(4.0, 6.0), side), Color([20, 20, 24]), 0.35);
        shade_polygon(&mut image, &disc(center, side), Color([shade, shade / 2 + 40, 90]), 1.0);
    }
    if with_part {
        draw_part(&mut image, &pose.image_from_part());
    }
    image
}

fn draw_part(image: &mut RgbImage, image_from_part: &PlanarSimilarity) {
    let mut shadow_pose = *image_from_part;
    shadow_pose.tx += 5.0;
    shadow_pose.ty += 8.0;
    shade_polygon(image, &part_outline().transformed(&shadow_pose), Color([18, 18, 22]), 0.45);
    shade_polygon(image, &part_outline().transformed(image_from_part), Color([92, 98, 108]), 1.0);
    for (x, radius, color) in [(-95.0, 32.0, [128, 134, 142]), (-95.0, 17.0, [34, 36, 40]), (95.0, 13.0, [34, 36, 40])]
    {
        shade_polygon(image, &disc(Point2::new(x, 0.0), radius).transformed(image_from_part), Color(color), 1.0);
    }
    let rib = [(-46.0, -6.0), (62.0, -5.0), (62.0, 5.0), (-46.0, 6.0)].map(|(x, y)| Point2::new(x, y));
    let rib = Polygon { vertices: rib.to_vec() }.transformed(image_from_part);
    shade_polygon(image, &rib, Color([126, 132, 140]), 1.0);
}

fn animation() -> Result<Animation, sdg_report::ReportError> {
    let background = scene(&Pose::demonstration(), 1, false);
    let frames: Vec<RgbImage> = (0..72)
        .map(|k| {
            let time = (f64::from(k) / 60.0).min(1.0);
            let ease = time * time * (3.0 - 2.0 * time);
            let pose = Pose {
                x: 330.0 - 20.0 * ease,
                y: 235.0 + 10.0 * ease,
                angle: 0.45 - 0.45 * ease,
                scale: 0.8 + 0.8 * ease,
            };
            let mut frame = background.clone();
            draw_part(&mut frame, &pose.image_from_part());
            let line = grasp_line().transformed(&pose.image_from_part());
            let grasp = PlanarGrasp::from_line(&line, (110.0 - 64.0 * (2.0 * time - 1.0).max(0.0)) * pose.scale);
            sdg_report::draw_grasp_jaws(&mut frame, &grasp, &sdg_report::Pen::new(Color::GRASP).width(3.0));
            frame
        })
        .collect();
    Animation::encode(&frames, &AnimationOptions::default())
}
