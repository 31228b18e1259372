//! A user's own part: its outline in a photo, extruded to its height, with the photo on top.
//!
//! ```text
//! outline ─┬─ strips between neighbouring corners ─ triangles, textured by the photo ── appearance
//!          └─ strips across the marked line ─ boxes ── contacts and mass
//! ```
//! Boxes are used instead of a convex hull, so that the jaws can also close on a waist between two wide ends.
//! Properties that the photo does not show are assumed: walls are vertical, and the density is uniform.

mod mesh;

use std::fmt::Write as _;
use std::io::Cursor;

use image::imageops::{self, FilterType};
use image::{ImageFormat, RgbImage};
use nalgebra::{Point2, Point3, Vector2};
use sdg_geometry::{GraspLine, Polygon, RotationalSymmetry, convex_hull};

use self::mesh::{Strip, mesh, strips};
use super::{LARGEST_JAW_WIDTH_M, ObjectSpec};
use crate::error::{Result, SimulationError};
use crate::model::Asset;
use crate::panda::FINGERTIP_BEYOND_TCP_M;

/// Smallest height of the tool centre point above the table: the finger tips are then 2 mm above the table. No shipped
/// part has a smaller grasp height.
const MIN_GRASP_HEIGHT_M: f64 = FINGERTIP_BEYOND_TCP_M + 0.002;
/// Largest height of a part above the tool centre point; a higher part could touch the palm.
const MAX_ABOVE_TCP_M: f64 = 0.03;
/// Width of the strips of boxes along the part's length, whose number is limited. Chosen by hand, so that the jaws'
/// pads, 2 cm wide, touch several boxes: every strip between them has up to 16 contacts. Fewer strips have too few
/// contacts: MuJoCo's contacts are soft on a light part, and the fingers passed through a single box of 1 g.
const STRIP_M: f64 = 0.004;
const MIN_STRIPS: usize = 8;
const MAX_STRIPS: usize = 40;
/// Maximum number of boxes: an outline with several intervals in each strip gets fewer strips. Each box on the table
/// has four contacts, and the time of a step grows with their number.
const MAX_BOXES: usize = 64;
/// Minimum width of a box, because narrower boxes give no contact. Chosen by hand.
const MIN_BOX_M: f64 = 1e-4;
/// Maximum size of the texture: the camera would not resolve a larger one.
const MAX_TEXTURE_PX: u32 = 1024;
/// The walls take the photo's colour at this distance inside the outline, in pixels, because the colour on the outline
/// itself is half the table's.
const WALL_INSET_PX: f64 = 2.0;
/// Friction coefficient of a part for which none is given: that of most shipped parts.
const ASSUMED_FRICTION: f64 = 0.6;

/// The data of an extruded part; positions in pixels of `photo`, which is taken vertically from above.
#[derive(Debug, Clone)]
pub struct Extrusion<'a> {
    /// Name at the command line.
    pub name: &'a str,
    /// The photo, or a crop of it.
    pub photo: &'a RgbImage,
    /// The part's outline.
    pub outline: &'a Polygon,
    /// The marked line, across which the jaws close.
    pub grasp: GraspLine,
    /// The part's width between the jaws, in pixels.
    pub jaw_width_px: f64,
    /// Size of a pixel, in metres.
    pub metres_per_pixel: f64,
    /// Height above the table, in metres, within [`Self::HEIGHTS_M`].
    pub height_m: f64,
    /// Mass in kilograms.
    pub mass_kg: f64,
    /// Coefficient of sliding friction in every contact, also with the finger pads. `None`: 0.6 on the table, and the
    /// pads' own friction between the fingers, as for shipped parts.
    pub friction: Option<f64>,
    /// The part's symmetry.
    pub symmetry: RotationalSymmetry,
}

impl Extrusion<'_> {
    /// Smallest and largest height of a body above the table, in metres.
    pub const HEIGHTS_M: [f64; 2] = [0.003, 0.12];

    /// The volume of the body, in cubic metres.
    pub fn volume_m3(&self) -> f64 {
        self.outline.area() * self.metres_per_pixel.powi(2) * self.height_m
    }

    /// Checks that a simulated hand and table can handle the part; the error states the name of the value, the expected
    /// range and the found value.
    fn check(&self) -> std::result::Result<(), String> {
        let [min_m, max_m] = Self::HEIGHTS_M;
        let ranges = [
            ("height in m", self.height_m, min_m, max_m),
            ("mass in kg", self.mass_kg, 1e-4, 3.0),
            ("friction", self.friction_or_assumed(), 0.01, 5.0),
            ("opening of the jaws in m", self.jaw_width_px * self.metres_per_pixel, 1e-3, LARGEST_JAW_WIDTH_M),
            ("longest side in m", self.longest_side_m(), 0.005, 0.4),
            ("marked line in m", self.grasp.length() * self.metres_per_pixel, 1e-3, 0.4),
            // The lightest foams have 10 kg/m³: a smaller value is that of a mass in kilograms, given as grams.
            ("density in kg/m³", self.mass_kg / self.volume_m3(), 10.0, 1e5),
        ];
        for (name, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err(format!("{name}: expected {low} to {high}, found {value:.4}"));
            }
        }
        Ok(())
    }

    fn friction_or_assumed(&self) -> f64 {
        self.friction.unwrap_or(ASSUMED_FRICTION)
    }

    /// The attributes of a collision shape that determine its contacts.
    fn contact_attributes(&self) -> String {
        match self.friction {
            // MuJoCo takes the parameters of a contact from the shape with the higher priority. Except for the
            // friction, these are the parameters of the pads, which have priority 1.
            Some(friction) => format!(
                "priority=\"2\" friction=\"{friction} {} 0.0002\" solref=\"0.006 1\" solimp=\"0.95 0.99 0.001\"",
                0.008 * friction
            ),
            None => format!("friction=\"{ASSUMED_FRICTION} 0.005 0.0002\""),
        }
    }

    fn longest_side_m(&self) -> f64 {
        let bounds = self.outline.bounds();
        bounds.width().max(bounds.height()) * self.metres_per_pixel
    }

    /// Conversion from pixels to the object frame: x along the marked line, y to its left seen from above, origin at
    /// the centroid of the outline.
    fn to_object(&self) -> impl Fn(&Point2<f64>) -> Point2<f64> {
        let center = self.outline.centroid();
        let along = (self.grasp.end - self.grasp.start).normalize();
        // y of pixels points downwards.
        let left = Vector2::new(along.y, -along.x);
        let scale = self.metres_per_pixel;
        move |p| Point2::new(scale * along.dot(&(p - center)), scale * left.dot(&(p - center)))
    }
}

impl Extrusion<'_> {
    /// The visible body, as OBJ.
    fn mesh(&self, corners: &[Point2<f64>]) -> String {
        let [width, height] = [self.photo.width(), self.photo.height()].map(f64::from);
        let along = (self.grasp.end - self.grasp.start).normalize();
        let left = Vector2::new(along.y, -along.x);
        let center = self.outline.centroid();
        let texcoord = |p: Point2<f64>| {
            let pixel = center + (along * p.x + left * p.y) / self.metres_per_pixel;
            [pixel.x / width, 1.0 - pixel.y / height]
        };
        mesh(corners, self.height_m, WALL_INSET_PX * self.metres_per_pixel, texcoord)
    }
}

impl ObjectSpec {
    /// A part extruded from its outline, with the photo on top.
    ///
    /// # Errors
    /// [`SimulationError::Asset`] for values that the hand or table cannot handle.
    pub fn extruded(extrusion: &Extrusion<'_>) -> Result<Self> {
        let fail = |reason: String| SimulationError::Asset { name: extrusion.name.to_owned(), reason };
        extrusion.check().map_err(fail)?;
        let Extrusion { name, height_m, mass_kg, symmetry, .. } = *extrusion;
        let to_object = extrusion.to_object();
        let corners: Vec<Point2<f64>> = extrusion.outline.vertices.iter().map(&to_object).collect();
        let mark = |point: &Point2<f64>| {
            let on_part = to_object(point);
            Point3::new(on_part.x, on_part.y, height_m)
        };
        let mut texture = Cursor::new(Vec::new());
        texture_of(extrusion.photo)
            .write_to(&mut texture, ImageFormat::Png)
            .map_err(|error| fail(format!("the photo: {error}")))?;
        Ok(Self {
            name: name.to_owned(),
            title: name.to_owned(),
            description: format!("{name}, its outline in a photo drawn up to {:.1} mm", 1e3 * height_m),
            mass_kg,
            friction: extrusion.friction_or_assumed(),
            grasp_start: mark(&extrusion.grasp.start),
            grasp_end: mark(&extrusion.grasp.end),
            jaw_width_m: extrusion.jaw_width_px * extrusion.metres_per_pixel,
            grasp_height_m: (0.5 * height_m).max(height_m - MAX_ABOVE_TCP_M).max(MIN_GRASP_HEIGHT_M),
            mark_height_m: height_m,
            seen_height_m: height_m,
            rest_height_m: 0.0,
            symmetry,
            footprint: convex_hull(corners.iter().copied()),
            mjcf: mjcf(extrusion, &corners),
            files: vec![
                Asset { name: "object_photo.png".to_owned(), bytes: texture.into_inner() },
                Asset { name: "object_body.obj".to_owned(), bytes: extrusion.mesh(&corners).into_bytes() },
            ],
        })
    }
}

fn texture_of(photo: &RgbImage) -> RgbImage {
    let side = photo.width().max(photo.height());
    if side <= MAX_TEXTURE_PX {
        return photo.clone();
    }
    let scaled = |length: u32| (u64::from(length) * u64::from(MAX_TEXTURE_PX) / u64::from(side)).max(1) as u32;
    imageops::resize(photo, scaled(photo.width()), scaled(photo.height()), FilterType::Triangle)
}

/// Centre and size of each collision box, seen from above.
fn boxes(corners: &[Point2<f64>]) -> Vec<(Vector2<f64>, Vector2<f64>)> {
    let ends = corners.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], c| [low.min(c.x), high.max(c.x)]);
    let length_m = ends[1] - ends[0];
    let boxes_of = |num_strips: usize| -> Vec<_> {
        let cuts: Vec<f64> = (0..=num_strips).map(|k| ends[0] + length_m * k as f64 / num_strips as f64).collect();
        strips(corners, &cuts)
            .into_iter()
            .map(|Strip { x, low, high }| {
                let (low, high) = (0.5 * (low[0] + low[1]), 0.5 * (high[0] + high[1]));
                (Vector2::new(0.5 * (x[0] + x[1]), 0.5 * (low + high)), Vector2::new(x[1] - x[0], high - low))
            })
            .filter(|(_, size)| size.min() > MIN_BOX_M)
            .collect()
    };
    let mut num_strips = ((length_m / STRIP_M) as usize).clamp(MIN_STRIPS, MAX_STRIPS);
    let mut boxes = boxes_of(num_strips);
    while (boxes.is_empty() || boxes.len() > MAX_BOXES) && num_strips > 1 {
        num_strips -= 1;
        boxes = boxes_of(num_strips);
    }
    boxes
}

/// Collision shapes and mass: the boxes of the strips, with uniform density.
fn mjcf(extrusion: &Extrusion<'_>, corners: &[Point2<f64>]) -> String {
    let Extrusion { height_m, mass_kg, .. } = *extrusion;
    let contact = extrusion.contact_attributes();
    let boxes = boxes(corners);
    let area: f64 = boxes.iter().map(|(_, size)| size.x * size.y).sum();
    let shares: Vec<f64> = boxes.iter().map(|(_, size)| mass_kg * size.x * size.y / area).collect();
    let middle = boxes.iter().zip(&shares).map(|((at, _), m)| at * *m).sum::<Vector2<f64>>() / mass_kg;
    let [mut xx, mut yy, mut xy] = [0.0; 3];
    for ((at, size), m) in boxes.iter().zip(&shares) {
        let from_middle = at - middle;
        xx += m * (size.y * size.y / 12.0 + from_middle.y * from_middle.y);
        yy += m * (size.x * size.x / 12.0 + from_middle.x * from_middle.x);
        xy -= m * from_middle.x * from_middle.y;
    }
    let upright = mass_kg * height_m * height_m / 12.0;
    let half = 0.5 * height_m;
    let mut geoms = String::new();
    for (idx, (at, size)) in boxes.iter().enumerate() {
        let _ = writeln!(
            geoms,
            "<geom name=\"object_collision_{idx}\" type=\"box\" pos=\"{:.6} {:.6} {half:.6}\" size=\"{:.6} {:.6} {half:.6}\" \
             {contact} condim=\"4\" group=\"3\"/>",
            at.x,
            at.y,
            0.5 * size.x,
            0.5 * size.y
        );
    }
    format!(
        "<asset><texture name=\"object_photo\" type=\"2d\" file=\"object_photo.png\"/>\
         <material name=\"object_photo\" texture=\"object_photo\" specular=\"0.2\" shininess=\"0.3\"/>\
         <mesh name=\"object_body\" file=\"object_body.obj\"/></asset>\n\
         <worldbody><body name=\"object\"><freejoint name=\"object_joint\"/>\
         <inertial pos=\"{:.6} {:.6} {half:.6}\" mass=\"{mass_kg}\" fullinertia=\"{:e} {:e} {:e} {xy:e} 0 0\"/>\n\
         <geom name=\"object_visual_0\" type=\"mesh\" mesh=\"object_body\" material=\"object_photo\" contype=\"0\" \
         conaffinity=\"0\" group=\"1\"/>\n{geoms}</body></worldbody>",
        middle.x,
        middle.y,
        xx + upright,
        yy + upright,
        xx + yy,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraView;
    use crate::data::Data;
    use crate::model::{Body, Model};
    use crate::render::{RenderConfig, Renderer};
    use approx::assert_relative_eq;
    use image::Rgb;
    use std::sync::Arc;

    /// An L: 80 by 60 px with the upper right 50 by 40 px missing; red left of x = 50, green right of it.
    fn photo() -> (RgbImage, Polygon) {
        let photo = RgbImage::from_fn(120, 100, |x, _| if x < 50 { Rgb([220, 20, 20]) } else { Rgb([20, 200, 20]) });
        let corners = [(20.0, 20.0), (50.0, 20.0), (50.0, 60.0), (100.0, 60.0), (100.0, 80.0), (20.0, 80.0)];
        (photo, Polygon { vertices: corners.map(|(x, y)| Point2::new(x, y)).to_vec() })
    }

    fn extrusion<'a>(photo: &'a RgbImage, outline: &'a Polygon, height_m: f64) -> Extrusion<'a> {
        Extrusion {
            name: "bracket",
            photo,
            outline,
            grasp: GraspLine::new(Point2::new(60.0, 70.0), Point2::new(90.0, 70.0)),
            jaw_width_px: 20.0,
            metres_per_pixel: 0.001,
            height_m,
            mass_kg: 0.05,
            friction: None,
            symmetry: RotationalSymmetry::None,
        }
    }

    fn model(spec: &ObjectSpec) -> Arc<Model> {
        let base_from_object = spec.base_from_object(0.0, 0.0, 0.0);
        let fragment = spec.fragment(&base_from_object);
        let xml = format!(
            "<mujoco><size njmax='4000' nconmax='1000'/><worldbody><light pos='0 0 1' dir='0 0 -1' directional='true' diffuse='.9 .9 .9'/>\
             <geom type='plane' size='1 1 .1' rgba='1 1 1 1'/><camera name='above' pos='0 0 0.3' fovy='47.15'/></worldbody>{}</mujoco>",
            fragment.sections
        );
        Arc::new(Model::from_xml(&xml, &fragment.files).unwrap())
    }

    #[test]
    fn the_picture_from_above_is_the_photo() {
        let (photo, outline) = photo();
        let spec = ObjectSpec::extruded(&extrusion(&photo, &outline, 0.01)).unwrap();
        let model = model(&spec);
        let mut data = Data::new(model.clone()).unwrap();
        let mut renderer = Renderer::new(&model, RenderConfig::default()).unwrap();
        let view = CameraView::capture(&mut renderer, &mut data, model.id("above").unwrap()).unwrap();
        // The object's x is the x of the photo and of the camera; the origin is the centroid of the outline.
        let center = outline.centroid();
        let shown = |x: f64, y: f64| {
            let at = Point3::new(0.001 * (x - center.x), 0.001 * (center.y - y), 0.01);
            let pixel = view.camera.project(&at).unwrap();
            view.image.get_pixel(pixel.x as u32, pixel.y as u32).0
        };
        let is = |color: [u8; 3], strong: usize| {
            (0..3).all(|c| c == strong || u16::from(color[strong]) > 2 * u16::from(color[c]))
        };
        assert!(is(shown(30.0, 30.0), 0), "upper left red: {:?}", shown(30.0, 30.0));
        assert!(is(shown(30.0, 70.0), 0), "lower left red: {:?}", shown(30.0, 70.0));
        assert!(is(shown(90.0, 70.0), 1), "lower right green: {:?}", shown(90.0, 70.0));
        let [r, g, b] = shown(85.0, 40.0);
        assert!(r.abs_diff(g) < 30 && g.abs_diff(b) < 30, "what is missing shows the table: {r} {g} {b}");
    }

    #[test]
    fn it_weighs_what_it_is_told_and_rests_as_it_lies() {
        let (photo, outline) = photo();
        let spec = ObjectSpec::extruded(&extrusion(&photo, &outline, 0.02)).unwrap();
        // 30 · 60 + 50 · 20 mm².
        assert_relative_eq!(extrusion(&photo, &outline, 0.02).volume_m3(), 2800e-6 * 0.02, epsilon = 1e-12);
        let model = model(&spec);
        let body = model.id::<Body>("object").unwrap();
        let mut data = Data::new(model.clone()).unwrap();
        for _ in 0..500 {
            data.step().unwrap();
        }
        let pose = data.world_from_body(body);
        assert!(pose.translation.vector.norm() < 0.001, "{pose}");
        assert!(pose.rotation.angle() < 0.02, "{pose}");
    }

    #[test]
    fn strips_are_4_mm_wide_and_numbers_are_limited() {
        let corners =
            |points: &[(f64, f64)]| points.iter().map(|&(x, y)| Point2::new(1e-3 * x, 1e-3 * y)).collect::<Vec<_>>();
        let bar = |length: f64| corners(&[(0.0, 0.0), (length, 0.0), (length, 15.0), (0.0, 15.0)]);
        for (length_mm, num_boxes) in [(0.45, 4), (3.5, 8), (30.0, 8), (50.0, 12), (200.0, 40)] {
            assert_eq!(boxes(&bar(length_mm)).len(), num_boxes, "{length_mm} mm");
        }
        // A comb with ten prongs along x.
        let mut comb = vec![(0.0, 0.0)];
        for prong in 0..10 {
            let y = 8.0 * f64::from(prong);
            comb.extend([(120.0, y), (120.0, y + 5.0), (10.0, y + 5.0), (10.0, y + 8.0)]);
        }
        comb.truncate(comb.len() - 2);
        comb.push((0.0, 77.0));
        let boxes = boxes(&corners(&comb));
        assert!((50..=MAX_BOXES).contains(&boxes.len()), "{}", boxes.len());
    }

    #[test]
    fn a_part_shorter_than_4_mm_has_a_body() {
        let (photo, _) = photo();
        let outline = Polygon {
            vertices: [(20.0, 20.0), (23.5, 20.0), (23.5, 35.0), (20.0, 35.0)].map(|(x, y)| Point2::new(x, y)).to_vec(),
        };
        let grasp = GraspLine::new(Point2::new(20.5, 27.0), Point2::new(23.0, 27.0));
        let spec =
            ObjectSpec::extruded(&Extrusion { grasp, mass_kg: 0.001, ..extrusion(&photo, &outline, 0.012) }).unwrap();
        let body = model(&spec).id::<Body>("object").unwrap();
        assert_relative_eq!(model(&spec).mass_kg(body), 0.001, epsilon = 1e-9);
    }

    #[test]
    fn what_no_hand_can_take_is_refused() {
        let (photo, outline) = photo();
        let refused = |change: fn(&mut Extrusion<'_>)| {
            let mut extrusion = extrusion(&photo, &outline, 0.01);
            change(&mut extrusion);
            ObjectSpec::extruded(&extrusion).unwrap_err().to_string()
        };
        assert!(refused(|e| e.height_m = 0.001).contains("height in m: expected 0.003 to 0.12, found 0.0010"));
        assert!(refused(|e| e.jaw_width_px = 90.0).contains("opening of the jaws in m: expected 0.001 to 0.08"));
        assert!(refused(|e| e.metres_per_pixel = 0.01).contains("found 0.2"));
        assert!(refused(|e| e.mass_kg = f64::NAN).contains("mass in kg"));
        assert!(refused(|e| e.friction = Some(6.0)).contains("friction: expected 0.01 to 5, found 6"));
        // 28 cm³.
        assert!(refused(|e| e.mass_kg = 0.17e-3).contains("density in kg/m³: expected 10 to 100000, found 6.07"));
    }
}
