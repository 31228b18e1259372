//! The pictures: shipped parts drawn on their tables, and the sets of a split, except sets of the reported side.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use image::RgbImage;
use sdg_cell::Perception;
use sdg_demonstration::Demonstration;
use sdg_evaluation::labelled_pictures::{Instance, LabelledFolder, LabelledPicture};
use sdg_evaluation::split::{ReadySet, Side, read_split};
use sdg_geometry::{PlanarSimilarity, Polygon, RotationalSymmetry};

use crate::turned_parts::{add_strokes, picture, poses};
use crate::works::read_demonstration;

/// Shipped parts that have no symmetry.
const SHIPPED: [&str; 6] = ["circuit_board", "housing", "key", "pendulum", "pliers", "rod_end"];
const SIZE: [u32; 2] = [640, 480];
/// Numbers of parts and of strokes beside them in the pictures of each shipped part; the last picture shows a different
/// part.
const CONTENTS: [(u32, u32); 4] = [(1, 0), (2, 20), (3, 40), (0, 20)];

/// A photo to teach, and the pictures to search.
pub struct Case {
    pub photo: PathBuf,
    pub demonstration: Demonstration,
    pub symmetry: RotationalSymmetry,
    source: Source,
}

enum Source {
    /// Drawn pictures, with ground truth.
    Drawn(Vec<LabelledPicture>),
    /// A folder of pictures with labels.
    Folder(PathBuf),
}

/// Pictures that have their own rows in the table.
pub struct Group {
    pub name: String,
    pub cases: Vec<Case>,
}

impl Case {
    /// The pictures with their ground truth.
    pub fn pictures(&self, detector: &Perception) -> Result<Vec<LabelledPicture>> {
        match &self.source {
            Source::Drawn(pictures) => Ok(pictures.clone()),
            Source::Folder(folder) => Ok(LabelledFolder::read(folder, detector, None)?.pictures),
        }
    }
}

/// Draws the pictures of shipped parts into target/bench/matchers-pictures.
pub fn shipped(root: &Path) -> Result<Group> {
    let folder = root.join("target/bench/matchers-pictures");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let demonstrations = SHIPPED.map(|part| read_demonstration(&root.join("datasets/demonstrations").join(part)));
    let demonstrations = demonstrations.into_iter().collect::<Result<Vec<_>>>()?;
    let mut cases = Vec::new();
    for (idx, (part, demonstration)) in SHIPPED.iter().zip(&demonstrations).enumerate() {
        let mut pictures = Vec::new();
        for (number, (count, strokes)) in CONTENTS.into_iter().enumerate() {
            let laid = poses(demonstration, SIZE, count, 25.0 + 61.0 * number as f64);
            let other = &demonstrations[(idx + 1) % demonstrations.len()];
            let mut drawn = match count {
                0 => picture(other, SIZE, &poses(other, SIZE, 2, 40.0)),
                _ => picture(demonstration, SIZE, &laid),
            };
            let instances: Vec<Instance> =
                laid.iter().map(|pose| instance(demonstration, pose)).collect::<Result<_>>()?;
            strokes_beside(&mut drawn, strokes, &instances);
            let path = folder.join(format!("{part}-{number}.png"));
            drawn.save(&path).with_context(|| path.display().to_string())?;
            pictures.push(LabelledPicture { labels: "drawn".into(), path, size: SIZE, instances, kind: None });
        }
        cases.push(Case {
            photo: root.join("datasets/demonstrations").join(part).join("image.png"),
            demonstration: demonstration.clone(),
            symmetry: RotationalSymmetry::None,
            source: Source::Drawn(pictures),
        });
    }
    Ok(Group { name: format!("{} shipped parts, drawn, 640×480", SHIPPED.len()), cases })
}

fn instance(demonstration: &Demonstration, pose: &PlanarSimilarity) -> Result<Instance> {
    let annotation = &demonstration.annotation;
    let outline = annotation.outline.clone().unwrap_or_else(|| Polygon::from_box(&annotation.bbox));
    let grasp = annotation.require_grasp()?.transformed(pose);
    Ok(Instance { bbox: outline.transformed(pose).bounds(), grasp: Some(grasp), optional: false, extent: None })
}

/// Draws strokes that cover no part.
fn strokes_beside(drawn: &mut RgbImage, count: u32, instances: &[Instance]) {
    let bare = drawn.clone();
    add_strokes(drawn, count);
    for (x, y, pixel) in drawn.enumerate_pixels_mut() {
        let at = nalgebra::Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        if instances.iter().any(|instance| instance.bbox.contains(&at)) {
            *pixel = *bare.get_pixel(x, y);
        }
    }
}

/// The existing sets of datasets/split.toml on which constants are or were fitted; no file of the other sets is opened.
pub fn of_split(root: &Path, sets: &Path) -> Result<Vec<Group>> {
    let split = read_split(&root.join("datasets/split.toml"))?;
    let mut groups = Vec::new();
    for set in split {
        if set.side == Side::Reported || !sets.join(&set.folder).is_dir() {
            continue;
        }
        let photo = sets.join(&set.folder).join(&set.demo);
        let ready = ReadySet::open(set, sets)?;
        let case = Case {
            photo,
            demonstration: ready.demonstration().clone(),
            symmetry: ready.set.symmetry,
            source: Source::Folder(ready.folder().to_owned()),
        };
        groups.push(Group { name: format!("{} ({})", ready.set.name, ready.set.side.name()), cases: vec![case] });
    }
    Ok(groups)
}
