//! A camera of the model in the project's conventions: a picture with the camera's pose in the world.
//!
//! MuJoCo's camera frame has x right, y up and looks along -z; the optical frame used everywhere else has x right, y
//! down and looks along z. The two differ by a rotation of 180° about x.

use std::f64::consts::PI;

use image::RgbImage;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use sdg_geometry::{PinholeCamera, PosedCamera};

use crate::data::Data;
use crate::error::Result;
use crate::model::{Camera, Id};
use crate::render::Renderer;

/// Focal length of the wrist camera in pixels, as in the paper.
pub const WRIST_FOCAL_LENGTH_PX: f64 = 550.0;

/// A picture and the camera that took it, posed in the world (the robot's base frame).
#[derive(Debug, Clone, PartialEq)]
pub struct CameraView {
    /// The picture.
    pub image: RgbImage,
    /// The camera's intrinsics and `world_from_camera`, in the optical frame.
    pub camera: PosedCamera,
}

impl CameraView {
    /// Takes a picture with a camera of the model, in the present state of `data`.
    ///
    /// # Errors
    /// As for [`Renderer::image`].
    pub fn capture(renderer: &mut Renderer, data: &mut Data, camera: Id<Camera>) -> Result<Self> {
        let image = renderer.image(data, camera)?;
        Ok(Self { image, camera: posed_camera(renderer, data, camera) })
    }
}

/// Pose and intrinsics of a camera of the model for the renderer's picture size.
pub fn posed_camera(renderer: &Renderer, data: &Data, camera: Id<Camera>) -> PosedCamera {
    let (width, height) = (renderer.config().width, renderer.config().height);
    let focal_px = 0.5 * f64::from(height) / (0.5 * data.model().vertical_field_of_view_rad(camera)).tan();
    PosedCamera {
        intrinsics: PinholeCamera::symmetric(width, height, focal_px),
        world_from_camera: data.world_from_mujoco_camera(camera) * optical_from_mujoco_camera(),
    }
}

/// The vertical field of view, in radians, of a picture with a given focal length and height.
pub fn vertical_field_of_view_rad(focal_px: f64, height_px: u32) -> f64 {
    2.0 * (0.5 * f64::from(height_px) / focal_px).atan()
}

/// The transform between MuJoCo's camera frame and the optical frame. It is a rotation by 180° and thus its own
/// inverse.
pub(crate) fn optical_from_mujoco_camera() -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Point3;

    use super::*;
    use crate::model::{Geom, Model};
    use crate::render::RenderConfig;

    /// Three balls that distinguish right from left and up from down, under a slightly tilted camera.
    fn scene() -> (Data, Renderer) {
        let fovy = vertical_field_of_view_rad(WRIST_FOCAL_LENGTH_PX, 480).to_degrees();
        let xml = format!(
            "<mujoco><compiler angle='degree'/><worldbody>\
             <geom name='table' type='box' size='1 1 .01' pos='0.5 0 -0.01'/>\
             <geom name='middle' type='sphere' size='.006' pos='0.5 0 0.006' rgba='1 0 0 1'/>\
             <geom name='right' type='sphere' size='.006' pos='0.62 -0.03 0.006' rgba='0 1 0 1'/>\
             <geom name='up' type='sphere' size='.006' pos='0.45 0.12 0.006' rgba='0 0 1 1'/>\
             <camera name='wrist' pos='0.45 -0.05 0.55' euler='10 -5 30' fovy='{fovy:.12}'/>\
             </worldbody></mujoco>"
        );
        let model = Arc::new(Model::from_xml(&xml, &[]).unwrap());
        let renderer = Renderer::new(&model, RenderConfig::default()).unwrap();
        (Data::new(model).unwrap(), renderer)
    }

    #[test]
    fn the_focal_length_is_exact() {
        let (data, renderer) = scene();
        let camera = posed_camera(&renderer, &data, data.model().id("wrist").unwrap());
        assert!((camera.intrinsics.fx - 550.0).abs() < 1e-6 && (camera.intrinsics.fy - 550.0).abs() < 1e-6);
        assert_eq!((camera.intrinsics.cx, camera.intrinsics.cy), (320.0, 240.0));
    }

    #[test]
    fn things_appear_where_the_camera_says() {
        let (mut data, mut renderer) = scene();
        let model = data.model().clone();
        let camera = model.id("wrist").unwrap();
        let posed = posed_camera(&renderer, &data, camera);
        let segmentation = renderer.segmentation(&mut data, camera).unwrap();
        for name in ["middle", "right", "up"] {
            let ball = model.id::<Geom>(name).unwrap();
            let centre = Point3::from(data.world_from_geom(ball).translation.vector);
            let expected = posed.project(&centre).unwrap();
            let pixels: Vec<_> = segmentation.pixels_where(|geom| geom == ball).collect();
            assert!(pixels.len() > 80, "{name}: {} pixels", pixels.len());
            let mean = |f: fn(&(u32, u32)) -> u32| {
                pixels.iter().map(|p| f64::from(f(p)) + 0.5).sum::<f64>() / pixels.len() as f64
            };
            let found = (mean(|p| p.0), mean(|p| p.1));
            // A ball's outline is an ellipse around nearly its centre; the mean of its pixels has an error of a tenth
            // of a pixel.
            assert!(
                (found.0 - expected.x).hypot(found.1 - expected.y) < 0.25,
                "{name}: found {found:?}, expected {expected:?}"
            );
        }
    }

    #[test]
    fn the_picture_shows_the_colours_at_the_segmented_pixels() {
        let (mut data, mut renderer) = scene();
        let model = data.model().clone();
        let camera = model.id("wrist").unwrap();
        let view = CameraView::capture(&mut renderer, &mut data, camera).unwrap();
        assert_eq!(view.image.dimensions(), (640, 480));
        for (name, channel) in [("middle", 0), ("right", 1), ("up", 2)] {
            let centre = data.world_from_geom(model.id(name).unwrap()).translation.vector;
            let pixel = view.camera.project(&centre.into()).unwrap();
            let color = view.image.get_pixel(pixel.x as u32, pixel.y as u32).0;
            let strongest = (0..3).max_by_key(|&c| color[c]).unwrap();
            assert_eq!(strongest, channel, "{name}: {color:?}");
        }
    }
}
