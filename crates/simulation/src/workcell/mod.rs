//! The robot at its table: one scene, its state, and its motion over time.

mod config;
mod model;
mod pictures;

use nalgebra::Isometry3;
use sdg_kinematics::{ArmGeometry, ready_pose};
use sdg_robot::{CameraPose, HandCommand, Load, PERIOD_SECS};

use crate::camera::posed_camera;
use crate::controller::{ArmController, ArmReference};
use crate::data::Data;
use crate::error::{Result, SimulationError};
use crate::extent::lowest_point_m;
use crate::gripper::Gripper;
use crate::lens::Frustum;
use crate::model::{Body, Camera, Geom, Id};
use crate::obstacles::obstacle_of_geom;
use crate::panda::PandaIds;
use crate::record::Recorder;
use crate::render::Renderer;

pub use config::WorkcellConfig;
use model::CAMERA_IN_BASE;
pub(crate) use model::build_model;

/// The part to grasp, as in MuJoCo's model.
#[derive(Debug, Clone, Copy)]
struct PartIds {
    body: Id<Body>,
}

/// A Panda at a table with a part, its physics and its cameras.
pub struct Workcell {
    config: WorkcellConfig,
    pub(crate) data: Data,
    pub(crate) panda_ids: PandaIds,
    pub(crate) panda: ArmGeometry,
    part: Option<PartIds>,
    wrist_renderer: Renderer,
    scene_camera: Id<Camera>,
    /// The camera of perception.
    camera: Id<Camera>,
    pub(crate) controller: ArmController,
    pub(crate) gripper: Gripper,
    reference: ArmReference,
    recorder: Option<Recorder>,
    tcp_from_camera: Isometry3<f64>,
    /// The last command of the hand.
    pub(crate) hand_command: Option<HandCommand>,
    /// Whether the arm has stopped itself.
    pub(crate) is_in_reflex: bool,
    /// The load that was given to the controller.
    pub(crate) load: Load,
    /// The filtered vertical force on the hand, N.
    pub(crate) felt_n: f64,
    /// Largest absolute value of that force since the last call of [`Workcell::take_peak_felt_n`], N.
    pub(crate) peak_felt_n: f64,
}

impl Workcell {
    /// Builds the scene, its physics and the wrist camera's renderer.
    ///
    /// # Errors
    /// `Model` if MuJoCo rejects the scene, `Rendering` without OpenGL, `Library` for the wrong libmujoco,
    /// `Configuration` for a lens whose model does not cover the corners of its own picture.
    pub fn new(config: &WorkcellConfig) -> Result<Self> {
        let model = build_model(config, "")?;

        let panda_ids = PandaIds::find(&model)?;
        let part = match config.scene.object {
            Some(_) => Some(PartIds { body: model.id("object")? }),
            None => None,
        };
        let wrist_render = match &config.wrist_camera {
            Some(camera) => Frustum::around(camera)?.render_config(&config.wrist_render),
            None => config.wrist_render,
        };
        let wrist_renderer = Renderer::new(&model, wrist_render)?;
        let scene_camera = model.id("scene")?;
        let camera = match config.camera_pose {
            Some(CameraPose::InBase(_)) => model.id(CAMERA_IN_BASE)?,
            Some(CameraPose::OnFlange(_)) | None => panda_ids.wrist_camera,
        };
        let mut data = Data::new(model)?;
        panda_ids.set_position(&mut data, &ready_pose());
        data.forward()?;
        let world_from_camera = posed_camera(&wrist_renderer, &data, camera).world_from_camera;
        let tcp_from_camera = panda_ids.base_from_tcp(&data).inverse() * world_from_camera;

        let mut workcell = Self {
            config: config.clone(),
            data,
            panda_ids,
            panda: ArmGeometry::panda(),
            part,
            wrist_renderer,
            scene_camera,
            camera,
            controller: ArmController::default(),
            gripper: Gripper::at_opening_m(0.08),
            reference: ArmReference::at_rest(ready_pose()),
            recorder: None,
            tcp_from_camera,
            hand_command: None,
            is_in_reflex: false,
            load: Load::NONE,
            felt_n: 0.0,
            peak_felt_n: 0.0,
        };
        workcell.reset(&ready_pose())?;
        Ok(workcell)
    }

    /// The workcell's configuration.
    pub fn config(&self) -> &WorkcellConfig {
        &self.config
    }

    /// Resets everything to the start: part and distractors at their start poses, the arm at rest at `q`
    /// with its hand open.
    ///
    /// # Errors
    /// As for [`Data::forward`], for example if the scene has too many contacts.
    pub fn reset(&mut self, q: &sdg_kinematics::JointVector) -> Result<()> {
        self.data.reset();
        self.panda_ids.set_position(&mut self.data, q);
        self.panda_ids.set_finger_position_m(&mut self.data, crate::panda::FINGER_TRAVEL_M);
        self.gripper = Gripper::at_opening_m(0.08);
        self.reference = ArmReference::at_rest(*q);
        self.hand_command = None;
        self.is_in_reflex = false;
        (self.load, self.felt_n, self.peak_felt_n) = (Load::NONE, 0.0, 0.0);
        self.data.forward()
    }

    /// Moves all objects to their positions in another simulation of the same configuration ([`Data::qpos`]), at rest.
    ///
    /// # Errors
    /// [`SimulationError::Configuration`] for another number of positions; the errors of [`Data::forward`].
    pub fn set_positions(&mut self, qpos: &[f64]) -> Result<()> {
        if qpos.len() != self.data.qpos().len() {
            return Err(SimulationError::Configuration {
                field: "positions",
                expected: format!("{} numbers", self.data.qpos().len()),
                found: qpos.len().to_string(),
            });
        }
        self.data.qpos_mut().copy_from_slice(qpos);
        self.data.qvel_mut().fill(0.0);
        self.reference = ArmReference::at_rest(self.panda_ids.position(&self.data));
        self.data.forward()
    }

    /// The present state of the physics.
    pub fn data(&self) -> &Data {
        &self.data
    }

    /// The arm in the model.
    pub fn panda_ids(&self) -> &PandaIds {
        &self.panda_ids
    }

    /// The part's pose, in the base frame; `None` in a scene without it.
    pub fn base_from_object(&self) -> Option<Isometry3<f64>> {
        self.part.map(|part| self.data.world_from_body(part.body))
    }

    /// Height of the part's lowest point above the table, in metres.
    pub fn object_height_m(&self) -> Option<f64> {
        self.part.map(|part| lowest_point_m(&self.data, part.body))
    }

    /// Whether the left and the right finger touch the part.
    pub fn fingers_on_object(&self) -> [bool; 2] {
        let mut touching = [false; 2];
        let Some(part) = self.part else { return touching };
        let model = self.data.model();
        for contact in self.data.contacts().filter(|contact| contact.normal_force_n > 0.1) {
            for (one, other) in [(contact.geom1, contact.geom2), (contact.geom2, contact.geom1)] {
                if let (Some(finger), true) = (self.panda_ids.finger_of(model, one), model.body_of(other) == part.body)
                {
                    touching[finger] = true;
                }
            }
        }
        touching
    }

    /// Distance between the fingers in metres.
    pub fn opening_m(&self) -> f64 {
        self.panda_ids.finger_position_m(&self.data).iter().sum()
    }

    /// The wrist camera's pose (optical frame) relative to the tool centre point.
    pub fn tcp_from_camera(&self) -> Isometry3<f64> {
        self.tcp_from_camera
    }

    /// The pose of the tool centre point at which the wrist camera has a given pose (optical frame).
    pub fn base_from_tcp_for_camera(&self, base_from_camera: &Isometry3<f64>) -> Isometry3<f64> {
        base_from_camera * self.tcp_from_camera.inverse()
    }

    /// Advances one control period, with the arm following the reference.
    pub(crate) fn tick(&mut self) -> Result<()> {
        self.data.step1()?;
        self.controller.apply(&mut self.data, &self.panda_ids, &self.reference);
        self.gripper.apply(&mut self.data, &self.panda_ids, PERIOD_SECS);
        self.data.step2()?;
        self.look_on()
    }

    /// Records the force on the hand and, if due, a picture; called in every period.
    pub(crate) fn look_on(&mut self) -> Result<()> {
        self.feel();
        match &mut self.recorder {
            Some(recorder) => recorder.look(&mut self.data),
            None => Ok(()),
        }
    }

    /// Sets the controller's reference for the next period.
    pub(crate) fn set_reference(&mut self, reference: ArmReference) {
        self.reference = reference;
    }

    /// The controller's reference.
    pub(crate) fn commanded(&self) -> sdg_kinematics::JointVector {
        self.reference.position
    }

    /// Describes which bodies of the arm touch which objects.
    pub(crate) fn describe_arm_contacts(&self) -> String {
        let model = self.data.model();
        let body_of = |geom: Id<Geom>| model.name(model.body_of(geom)).unwrap_or_default();
        let name_of = |geom: Id<Geom>| match body_of(geom).as_str() {
            // The table and the obstacles are geoms of MuJoCo's body "world".
            "" | "world" => match model.name(geom).as_deref() {
                None | Some("table") => "the table".to_owned(),
                Some(name) => obstacle_of_geom(name).to_owned(),
            },
            body => body.to_owned(),
        };
        let mut touching: Vec<String> = self
            .data
            .contacts()
            .map(|contact| [contact.geom1, contact.geom2])
            .filter_map(|[one, other]| match (is_arm(&body_of(one)), is_arm(&body_of(other))) {
                (true, false) => Some(format!("{} on {}", name_of(one), name_of(other))),
                (false, true) => Some(format!("{} on {}", name_of(other), name_of(one))),
                _ => None,
            })
            .collect();
        touching.sort();
        touching.dedup();
        if touching.is_empty() { "the motors were too weak".into() } else { touching.join(", ") }
    }
}

fn is_arm(body: &str) -> bool {
    body.starts_with("link") || body == "hand" || body.ends_with("_finger")
}
