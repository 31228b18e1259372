//! The demonstration's photo: one part, vertical view, even light, and its marks.

use std::sync::Arc;

use nalgebra::Point2;
use sdg_demonstration::{Annotation, Demonstration};
use sdg_geometry::{BoundingBox, GraspLine, Mask, PlanarSimilarity, Polygon, PosedCamera, outer_outline};

use super::contents::Scene;
use super::light::{LightStyle, Lighting};
use super::placement::Placement;
use super::render::{Canvas, Footprint};
use super::sensor::{self, Sensor};
use super::table::{Table, TableStyle};
use super::view::View;
use crate::Part;
use crate::random::{Draw, Stream, generator};

/// Focal length divided by the picture's width: that of the project's wrist camera.
pub(crate) const FOCAL_OVER_WIDTH: f32 = 0.86;

/// Sufficient contrast of table and part: the sum over channels of the differences between square roots of linear
/// values. A table with less contrast is replaced by one with more.
const MIN_CONTRAST: f32 = 0.5;

/// Settings of the photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotoConfig {
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// Range of the part's diagonal divided by the picture's shorter side.
    pub fill: [f64; 2],
}

impl Default for PhotoConfig {
    fn default() -> Self {
        Self { width: 320, height: 240, fill: [0.32, 0.6] }
    }
}

/// A demonstration's photo with its ground truth.
#[derive(Debug, Clone)]
pub struct DemonstrationPhoto {
    /// The photo and its marks.
    pub demonstration: Demonstration,
    /// Maps the part's frame at the marks' height (millimetres) to the photo's pixels.
    pub photo_from_part: PlanarSimilarity,
    /// The camera's distance from the table, in millimetres.
    pub distance_mm: f64,
    /// The camera's pose, in metres, in a frame on the table.
    pub camera: PosedCamera,
}

/// A photo of a part as a user would take and mark it. Another seed gives another position, light and table.
pub fn demonstration(part: &Part, config: &PhotoConfig, seed: u64) -> Demonstration {
    DemonstrationPhoto::take(part, config, seed).demonstration
}

impl DemonstrationPhoto {
    /// Takes the photo of a seed.
    pub fn take(part: &Part, config: &PhotoConfig, seed: u64) -> Self {
        let mut rng = generator(seed, Stream::Photo, part.recipe.grain_seed);
        let focal = FOCAL_OVER_WIDTH * config.width as f32;
        let shorter = config.width.min(config.height) as f32;
        let fill = rng.uniform(config.fill[0] as f32, config.fill[1] as f32);
        let diagonal = part.diagonal_mm() as f32;
        // The top of a tall part is nearer to the camera.
        let distance = diagonal * focal / (fill * shorter) + part.relief.top_mm;
        let view = View::new(config.width, config.height, focal, distance, 0.0, 0.0);
        let mm_per_px = view.mm_per_px();
        let free =
            [config.width, config.height].map(|side| (0.5 * (side as f32 - fill * shorter * 1.1)).max(0.0) * mm_per_px);
        let middle = [rng.uniform(-0.7, 0.7) * free[0], rng.uniform(-0.7, 0.7) * free[1]];
        let turn = rng.angle();
        let bounds = part.outline.bounds().center();
        let mut placement = Placement::new(Arc::new(part.clone()), [0.0; 2], turn, 0.0, mm_per_px);
        let offset = placement.to_table([bounds.x as f32, bounds.y as f32]);
        placement =
            Placement::new(placement.part, [middle[0] - offset[0], middle[1] - offset[1]], turn, 0.0, mm_per_px);
        let light = LightStyle { even: true, glare: false, hard: false };
        let scene = Scene {
            view,
            lighting: Lighting::draw(light, &mut rng),
            table: contrasting_table(part, &mut rng),
            bodies: vec![placement],
            far_shadow: None,
        };
        let sensor = Sensor::clean(&mut rng);
        let mut canvas = Canvas::default();
        let rendered = scene.render(1, &mut canvas);
        let image = sensor::take(&mut canvas, config.width as usize, &sensor, &mut rng);
        let pose = pose(&scene, 0);
        let silhouette = Silhouette::of(&rendered.footprints[0]);
        let outline = silhouette.outline().map(|outline| outline.clip(config.width.into(), config.height.into()));
        let annotation = Annotation {
            label: "part".into(),
            bbox: silhouette.bbox().clip(config.width.into(), config.height.into()),
            grasp: Some(grasp_line(part, &pose)),
            jaw_width: Some(f64::from(part.grasp.jaw_width_mm) * pose.scale),
            outline: outline.filter(|outline| outline.vertices.len() >= 3),
        };
        Self {
            demonstration: Demonstration { image, annotation },
            photo_from_part: pose,
            distance_mm: distance.into(),
            camera: scene.view.camera(),
        }
    }
}

/// Chooses from a few plain tables one that differs in colour from the part, as recommended to users.
fn contrasting_table(part: &Part, rng: &mut rand_pcg::Pcg64Mcg) -> Table {
    let look: Vec<f32> = {
        let level = &part.relief.levels[2];
        let mut sum = [0.0f32; 3];
        let mut count = 0.0f32;
        for texel in level.texels.iter().filter(|texel| texel.top > 0) {
            let material = &part.relief.materials[texel.material as usize];
            let looks =
                material.albedo.iter().zip(material.reflectance).map(|(albedo, mirrored)| albedo + 0.8 * mirrored);
            sum.iter_mut().zip(looks).for_each(|(sum, look)| *sum += look);
            count += 1.0;
        }
        sum.iter().map(|s| (s / count.max(1.0)).sqrt()).collect()
    };
    let contrast = |table: &Table| -> f32 { (0..3).map(|k| (table.mean()[k].sqrt() - look[k]).abs()).sum() };
    let mut best = Table::draw(TableStyle::Plain, rng);
    for _ in 0..5 {
        let other = Table::draw(TableStyle::Plain, rng);
        if contrast(&best) < MIN_CONTRAST && contrast(&other) > contrast(&best) {
            best = other;
        }
    }
    best
}

/// The similarity that maps a part's frame, at its marks' height, to the picture: exact for a vertical view, otherwise
/// the best fit over the part's box and its marks.
pub(crate) fn pose(scene: &Scene, body: usize) -> PlanarSimilarity {
    let placement = &scene.bodies[body];
    let part = &placement.part;
    let z = placement.base + part.grasp.height_mm;
    let marks = [part.grasp.start, part.grasp.end].map(|p| Point2::new(f64::from(p[0]), f64::from(p[1])));
    let corners = part.outline.bounds().corners();
    let (from, to): (Vec<Point2<f64>>, Vec<Point2<f64>>) = corners
        .into_iter()
        .chain(marks)
        .filter_map(|p| {
            let [x, y] = placement.to_table([p.x as f32, p.y as f32]);
            let [px, py] = scene.view.project([x, y, z])?;
            Some((p, Point2::new(f64::from(px), f64::from(py))))
        })
        .unzip();
    PlanarSimilarity::fit(&from, &to).unwrap_or(PlanarSimilarity::IDENTITY)
}

/// The marks of a part at a pose.
pub(crate) fn grasp_line(part: &Part, picture_from_part: &PlanarSimilarity) -> GraspLine {
    let mark = |p: [f32; 2]| picture_from_part.apply(&Point2::new(f64::from(p[0]), f64::from(p[1])));
    GraspLine::new(mark(part.grasp.start), mark(part.grasp.end))
}

/// The pixels of a body without occlusion, inside the picture and outside.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Silhouette {
    /// Position of the first pixel.
    pub origin: [i32; 2],
    pub mask: Mask,
}

impl Silhouette {
    pub fn of(footprint: &Footprint) -> Self {
        let [x0, y0, x1, y1] = footprint.bounds;
        let (width, height) = ((x1 - x0) as u32, (y1 - y0) as u32);
        let mask = Mask::from_fn(width, height, |x, y| footprint.shown[(y * width + x) as usize]);
        Self { origin: [x0, y0], mask }
    }

    fn shift(&self, p: Point2<f64>) -> Point2<f64> {
        Point2::new(p.x + f64::from(self.origin[0]), p.y + f64::from(self.origin[1]))
    }

    /// Bounding box, in pixels of the picture; may extend outside the picture.
    pub fn bbox(&self) -> BoundingBox {
        let b = self.mask.bounds().unwrap_or(BoundingBox { x1: 0.0, y1: 0.0, x2: 1.0, y2: 1.0 });
        let (a, c) = (self.shift(Point2::new(b.x1, b.y1)), self.shift(Point2::new(b.x2, b.y2)));
        BoundingBox { x1: a.x, y1: a.y, x2: c.x, y2: c.y }
    }

    /// Outer outline, in pixels of the picture; may extend outside the picture.
    pub fn outline(&self) -> Option<Polygon> {
        let outline = outer_outline(&self.mask)?;
        Some(Polygon { vertices: outline.vertices.into_iter().map(|v| self.shift(v)).collect() })
    }
}
