//! Compares proposed outlines with those of the shipped demonstrations.

use std::path::Path;

use crate::shadows::{self, Lamp};
use crate::simulated_person;
use sdg_demonstration::{Demonstration, propose_outline, propose_outline_with};
use sdg_geometry::{BoundingBox, Polygon};

/// Mean overlap on the paper's eight parts: 0.954 with boxes as drawn, 0.957 with boxes a tenth looser. The minimum is
/// that of the thin fuel line (0.905 and 0.889). On all twelve parts the means are 0.954 and 0.955. OpenCV's grabCut,
/// with its five rounds, has means of 0.960 and 0.956 on the eight parts.
const MIN_MEAN_OVERLAP: f64 = 0.93;
const MIN_OVERLAP: f64 = 0.85;

fn shipped() -> Vec<(String, Demonstration)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let read = |path: &Path, name: &str| std::fs::read(path.join(name)).unwrap();
    paths
        .iter()
        .map(|path| {
            let demonstration =
                Demonstration::decode(&read(path, "image.png"), &read(path, "annotation.json"), None).unwrap();
            (path.file_name().unwrap().to_string_lossy().into_owned(), demonstration)
        })
        .collect()
}

#[test]
fn proposals_overlap_the_drawn_outlines_of_all_parts() {
    // The box as drawn, and a tenth looser on every side.
    for looseness in [0.0, 0.1] {
        let mut overlaps = Vec::new();
        for (name, Demonstration { image, annotation }) in shipped() {
            let b = annotation.bbox;
            let (dx, dy) = (looseness * b.width(), looseness * b.height());
            let bbox = BoundingBox { x1: b.x1 - dx, y1: b.y1 - dy, x2: b.x2 + dx, y2: b.y2 + dy };
            let proposed = propose_outline(&image, &bbox);
            let count = proposed.vertices.len();
            assert!((10..=60).contains(&count), "{name}: {count} vertices");
            assert!(proposed.vertices.iter().all(|v| bbox.contains(v)), "{name}");
            assert!(!proposed.crosses_itself(), "{name}");
            let mask = |outline: &sdg_geometry::Polygon| outline.rasterize(image.width(), image.height());
            let overlap = mask(&proposed).iou(&mask(annotation.outline.as_ref().unwrap()));
            assert!(overlap >= MIN_OVERLAP, "{name}, {looseness} looser: {overlap:.3}");
            overlaps.push(overlap);
        }
        assert_eq!(overlaps.len(), 12);
        let mean = overlaps.iter().sum::<f64>() / overlaps.len() as f64;
        println!("{looseness} looser: {mean:.3}");
        assert!(mean >= MIN_MEAN_OVERLAP, "{looseness} looser: {mean:.3}");
    }
}

#[test]
fn same_photo_same_outline() {
    let (_, Demonstration { image, annotation }) = shipped().remove(0);
    assert_eq!(propose_outline(&image, &annotation.bbox), propose_outline(&image, &annotation.bbox));
}

/// Issue 19: median overlap without a click.
const MIN_MEDIAN_OVERLAP: f64 = 0.9;
/// Issue 19: median fraction, after two clicks, of the true outline within 3 px (or 1 % of the diagonal if that is
/// more).
const MIN_NEAR: f64 = 0.9;

/// Pictures of generated parts (crates/part-generator/examples/outline_pictures.rs), whose outlines are exact to the
/// pixel.
#[test]
fn two_clicks_correct_an_outline() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/outlines");
    let (mut overlaps, mut near) = (Vec::new(), Vec::new());
    for number in 0..15 {
        let read = |extension: &str| std::fs::read(folder.join(format!("generated-{number:02}.{extension}"))).unwrap();
        let Demonstration { image, annotation } = Demonstration::decode(&read("jpg"), &read("json"), None).unwrap();
        let truth = annotation.outline.as_ref().unwrap();
        let outlines = simulated_person::outlines(&image, &annotation.bbox, truth, 2);
        let first = simulated_person::agreement(&outlines[0], truth, &image);
        let last = simulated_person::agreement(outlines.last().unwrap(), truth, &image);
        println!("{number}: {first:?}, after two clicks {last:?}");
        overlaps.push(first.iou);
        near.push(last.near);
    }
    let [overlap, near] = [overlaps, near].map(|values| sdg_geometry::median(values).unwrap());
    println!("median overlap {overlap:.3}, median fraction within the tolerance after two clicks {near:.3}");
    assert!(overlap >= MIN_MEDIAN_OVERLAP, "{overlap}");
    assert!(near >= MIN_NEAR, "{near}");
}

/// Shadows of successive lamps: their directions, lengths and depths differ.
fn lamp(number: usize) -> Lamp {
    let dark = [0.5, 0.4, 0.3, 0.2][number % 4];
    let length = [0.15, 0.25, 0.35][number % 3];
    Lamp { direction: 0.4 + 2.1 * number as f64, length, left: [dark, 1.1 * dark, 1.35 * dark], blur: 0.125 }
}

/// Minimum mean overlap of proposals in hard shadows, with a box around the part and with one around part and shadow.
/// Measured: 0.791 and 0.581. The rule of `MIN_SHADOW` (src/outline_proposal) changes nothing here; it helps on
/// photographs. With that minimum at 0, the overlaps were 0.774 and 0.572.
const HARD_SHADOWS: [f64; 2] = [0.785, 0.577];

/// Shadows of small lamps: sharp, mostly darker than those of [`lamp`], half of them without a tint.
fn small_lamp(number: usize) -> Lamp {
    let dark = [0.5, 0.35, 0.22, 0.12][number % 4];
    let length = [0.08, 0.15, 0.25, 0.35][(number / 2) % 4];
    let [green, blue] = [[1.0, 1.0], [1.1, 1.3]][(number / 4) % 2];
    Lamp { direction: 0.4 + 2.1 * number as f64, length, left: [dark, green * dark, blue * dark], blur: 0.02 }
}

#[test]
fn proposals_in_hard_shadows_are_no_worse_than_measured() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/outlines");
    let mut overlaps = [Vec::new(), Vec::new()];
    for number in 15..41 {
        let read = |extension: &str| std::fs::read(folder.join(format!("generated-{number:02}.{extension}"))).unwrap();
        let Demonstration { image, annotation } = Demonstration::decode(&read("jpg"), &read("json"), None).unwrap();
        let truth = annotation.outline.as_ref().unwrap();
        let b = truth.bounds();
        let room = 0.05 * b.width().max(b.height());
        let around_part = BoundingBox { x1: b.x1 - room, y1: b.y1 - room, x2: b.x2 + room, y2: b.y2 + room };
        for which in [number, number + 5] {
            let shaded = shadows::cast(&image, truth, &small_lamp(which));
            for (overlaps, bbox) in overlaps.iter_mut().zip([around_part, shaded.bbox]) {
                overlaps.push(simulated_person::agreement(&propose_outline(&shaded.image, &bbox), truth, &image).iou);
            }
        }
    }
    let means = overlaps.map(|overlaps| overlaps.iter().sum::<f64>() / overlaps.len() as f64);
    println!("mean overlap with a box around the part, around part and shadow: {means:.3?}");
    for (mean, least) in means.iter().zip(HARD_SHADOWS) {
        assert!(*mean >= least, "{means:.3?}");
    }
}

/// An outline includes a shadow and the part if it contains at least these fractions of them.
const SHADOW_IN: f64 = 0.4;
const PART_IN: f64 = 0.85;
/// A shadow counts as removed if the outline includes at most this fraction more of its area than the outline proposed
/// on the same photo without the shadow.
const SHADOW_OUT: f64 = 0.15;
/// The outline must also keep this fraction of the overlap that the photo without the shadow gives.
const OVERLAP_KEPT: f64 = 0.9;
/// Issue 47: eight of ten.
const MIN_REMOVED: f64 = 0.8;

/// One click or one stroke of a simulated person removes a shadow. Measured: 28 of 35 each; without the search for
/// shadows 12 and 20. The first fifteen pictures, on which the constants were chosen, are left out (21 of 23 each);
/// some of the pictures used here were also inspected, in darker shadows.
#[test]
fn one_click_or_one_stroke_removes_a_shadow() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/outlines");
    let (mut cases, mut removed) = (0usize, [0usize, 0]);
    for number in 15..41 {
        let read = |extension: &str| std::fs::read(folder.join(format!("generated-{number:02}.{extension}"))).unwrap();
        let Demonstration { image, annotation } = Demonstration::decode(&read("jpg"), &read("json"), None).unwrap();
        let truth = annotation.outline.as_ref().unwrap();
        let without = propose_outline(&image, &annotation.bbox);
        let overlap = |outline: &Polygon| simulated_person::agreement(outline, truth, &image).iou;
        for which in [number, number + 5] {
            let shaded = shadows::cast(&image, truth, &lamp(which));
            let [shadow_without, _] = shaded.shares(&without);
            let before = propose_outline(&shaded.image, &shaded.bbox);
            let [shadow_before, part_before] = shaded.shares(&before);
            if shadow_before < SHADOW_IN || part_before < PART_IN {
                continue;
            }
            cases += 1;
            let after = [1, 15].map(|num_points| {
                let stroke = simulated_person::stroke(&before, &shaded.part, &shaded.bbox, num_points).unwrap();
                assert!(!stroke.is_inside);
                let after = propose_outline_with(&shaded.image, &shaded.bbox, &[stroke]);
                [shaded.shares(&after)[0], overlap(&after)]
            });
            for (removed, [shadow, overlap_after]) in removed.iter_mut().zip(&after) {
                let is_out =
                    *shadow <= shadow_without + SHADOW_OUT && *overlap_after >= OVERLAP_KEPT * overlap(&without);
                *removed += usize::from(is_out);
            }
            println!(
                "{number}: shadow {shadow_before:.2}, part {part_before:.2}; after a click, a stroke {after:.2?}; without {:.2}",
                overlap(&without)
            );
        }
    }
    println!("of {cases} shadows a click removes {}, a stroke {}", removed[0], removed[1]);
    assert!(cases >= 10, "{cases} outlines with a shadow");
    for removed in removed {
        assert!(removed as f64 >= MIN_REMOVED * cases as f64, "{removed} of {cases}");
    }
}
