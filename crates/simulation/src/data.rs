//! The state of a model at one instant, and its integration in time.

use std::sync::Arc;

use nalgebra::{DMatrix, Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use sdg_mujoco_sys as mj;

use crate::error::{Result, SimulationError};
use crate::guard::{guarded, take_warnings};
use crate::model::{Body, Camera, Geom, Id, Joint, Kind, Model, Site};

/// Positions, velocities, forces and contacts of a [`Model`] at one instant.
///
/// Positions of bodies, sites and cameras are those of the last [`Data::forward`], [`Data::step1`]
/// or [`Data::step`]; after changing `qpos`, call one of them first.
pub struct Data {
    model: Arc<Model>,
    ptr: *mut mj::mjData,
}

// SAFETY: this value owns the data, and MuJoCo does not bind it to a thread.
unsafe impl Send for Data {}

/// Two geoms that touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// One of the two geoms; MuJoCo defines the order.
    pub geom1: Id<Geom>,
    /// The other geom.
    pub geom2: Id<Geom>,
    /// Centre of the contact in the world frame, in metres.
    pub position: Vector3<f64>,
    /// Distance between the surfaces in metres; negative if they overlap.
    pub distance_m: f64,
    /// Force along the contact's normal, in newtons, never negative.
    pub normal_force_n: f64,
}

impl Data {
    /// The initial state of a model; the positions of all its objects are computed.
    ///
    /// # Errors
    /// [`SimulationError::MuJoCo`] if memory runs out; the errors of [`Self::forward`].
    pub fn new(model: Arc<Model>) -> Result<Self> {
        // SAFETY: the model is live.
        let ptr = guarded("mj_makeData", || unsafe { mj::mj_makeData(model.as_ptr()) })?;
        if ptr.is_null() {
            return Err(SimulationError::MuJoCo { call: "mj_makeData", message: "out of memory".into() });
        }
        let mut data = Self { model, ptr };
        data.forward()?;
        Ok(data)
    }

    /// The model of this state.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    fn raw(&self) -> &mj::mjData {
        // SAFETY: the pointer comes from `mj_makeData`, is not null, and lives as long as `self`.
        unsafe { &*self.ptr }
    }

    pub(crate) fn as_mut_ptr(&mut self) -> *mut mj::mjData {
        self.ptr
    }

    /// Restores the initial state.
    pub fn reset(&mut self) {
        // SAFETY: model and data are live and belong together.
        unsafe { mj::mj_resetData(self.model.as_ptr(), self.ptr) };
    }

    /// Computes everything that follows from `qpos`, `qvel` and `ctrl`, without a time step.
    ///
    /// # Errors
    /// [`SimulationError::MuJoCo`], [`SimulationError::Unstable`] or [`SimulationError::TooManyContacts`].
    pub fn forward(&mut self) -> Result<()> {
        // SAFETY: model and data are live and belong together.
        guarded("mj_forward", || unsafe { mj::mj_forward(self.model.as_ptr(), self.ptr) })?;
        self.check(self.time_secs())
    }

    /// Computes only positions and overlaps: no forces, no time step.
    ///
    /// # Errors
    /// [`SimulationError::MuJoCo`], [`SimulationError::Unstable`] or [`SimulationError::TooManyContacts`].
    pub(crate) fn collide(&mut self) -> Result<()> {
        // SAFETY: model and data are live and belong together; collision reads what kinematics wrote.
        guarded("mj_collision", || unsafe {
            mj::mj_kinematics(self.model.as_ptr(), self.ptr);
            mj::mj_collision(self.model.as_ptr(), self.ptr);
        })?;
        self.check(self.time_secs())
    }

    /// Pairs of overlapping geoms with their depths (m), after [`Data::collide`].
    pub(crate) fn overlaps(&self) -> impl Iterator<Item = (Id<Geom>, Id<Geom>, f64)> + '_ {
        let raw = self.raw();
        // SAFETY: the array has `ncon` valid entries and lives as long as the data.
        let contacts = unsafe { std::slice::from_raw_parts(raw.contact, raw.ncon as usize) };
        contacts
            .iter()
            .filter(|contact| contact.dist < 0.0)
            .map(|contact| (Id::new(contact.geom1 as usize), Id::new(contact.geom2 as usize), -contact.dist))
    }

    /// Advances by one timestep.
    ///
    /// # Errors
    /// [`SimulationError::MuJoCo`], [`SimulationError::Unstable`] or [`SimulationError::TooManyContacts`].
    pub fn step(&mut self) -> Result<()> {
        let before_secs = self.time_secs();
        // SAFETY: model and data are live and belong together.
        guarded("mj_step", || unsafe { mj::mj_step(self.model.as_ptr(), self.ptr) })?;
        self.check(before_secs)
    }

    /// The first half of a step: everything that follows from positions and velocities, for a
    /// controller to read before it sets `ctrl`.
    ///
    /// # Errors
    /// [`SimulationError::MuJoCo`], [`SimulationError::Unstable`] or [`SimulationError::TooManyContacts`].
    pub fn step1(&mut self) -> Result<()> {
        let before_secs = self.time_secs();
        // SAFETY: model and data are live and belong together.
        guarded("mj_step1", || unsafe { mj::mj_step1(self.model.as_ptr(), self.ptr) })?;
        self.check(before_secs)
    }

    /// The second half of a step: forces from `ctrl`, accelerations, new positions.
    ///
    /// # Errors
    /// [`SimulationError::MuJoCo`], [`SimulationError::Unstable`] or [`SimulationError::TooManyContacts`].
    pub fn step2(&mut self) -> Result<()> {
        let before_secs = self.time_secs();
        // SAFETY: model and data are live and belong together.
        guarded("mj_step2", || unsafe { mj::mj_step2(self.model.as_ptr(), self.ptr) })?;
        self.check(before_secs)
    }

    /// Returns an error for positions or velocities that are not finite, and if MuJoCo has warned of invalid numbers or
    /// of a full list of contacts or constraints. `time_secs` is the time before the call of MuJoCo: after invalid
    /// numbers in a time step, MuJoCo resets the state and its time.
    fn check(&self, time_secs: f64) -> Result<()> {
        // MuJoCo looks for such numbers in time steps only.
        let is_finite = self.qpos().iter().chain(self.qvel()).all(|number| number.is_finite());
        let has_warned = |warning: mj::mjtWarning_| self.raw().warning[warning as usize].number > 0;
        let bad = [mj::mjWARN_BADQPOS, mj::mjWARN_BADQVEL, mj::mjWARN_BADQACC, mj::mjWARN_BADCTRL];
        if !is_finite || bad.into_iter().any(has_warned) {
            let message = take_warnings().pop().unwrap_or_else(|| "a number is not finite or too large".into());
            return Err(SimulationError::Unstable { time_secs, message });
        }
        if [mj::mjWARN_CONTACTFULL, mj::mjWARN_CNSTRFULL].into_iter().any(has_warned) {
            // MuJoCo advises to change the model's XML, which users do not see.
            take_warnings();
            return Err(SimulationError::TooManyContacts { time_secs });
        }
        Ok(())
    }

    /// Simulated time in seconds.
    pub fn time_secs(&self) -> f64 {
        self.raw().time
    }

    /// Generalised positions (joint angles in radians, slides in metres, quaternions w x y z).
    pub fn qpos(&self) -> &[f64] {
        // SAFETY: the array has `nq` entries and lives as long as the data.
        unsafe { std::slice::from_raw_parts(self.raw().qpos, self.model.raw().nq as usize) }
    }

    /// Generalised positions, for changing them.
    pub fn qpos_mut(&mut self) -> &mut [f64] {
        // SAFETY: the array has `nq` entries, lives as long as the data, and `self` is borrowed mutably.
        unsafe { std::slice::from_raw_parts_mut(self.raw().qpos, self.model.raw().nq as usize) }
    }

    /// Generalised velocities (rad/s, m/s).
    pub fn qvel(&self) -> &[f64] {
        // SAFETY: the array has `nv` entries and lives as long as the data.
        unsafe { std::slice::from_raw_parts(self.raw().qvel, self.model.raw().nv as usize) }
    }

    /// Generalised velocities, for changing them.
    pub fn qvel_mut(&mut self) -> &mut [f64] {
        // SAFETY: the array has `nv` entries, lives as long as the data, and `self` is borrowed mutably.
        unsafe { std::slice::from_raw_parts_mut(self.raw().qvel, self.model.raw().nv as usize) }
    }

    /// Controls, one per actuator (N·m and N for motors).
    pub fn ctrl(&self) -> &[f64] {
        // SAFETY: the array has `nu` entries and lives as long as the data.
        unsafe { std::slice::from_raw_parts(self.raw().ctrl, self.model.raw().nu as usize) }
    }

    /// Controls, one per actuator, for changing them (N·m and N for motors).
    pub fn ctrl_mut(&mut self) -> &mut [f64] {
        // SAFETY: the array has `nu` entries, lives as long as the data, and `self` is borrowed
        // mutably.
        unsafe { std::slice::from_raw_parts_mut(self.raw().ctrl, self.model.raw().nu as usize) }
    }

    /// Gravity, Coriolis and centrifugal forces that the joints have to balance (N·m, N).
    pub fn qfrc_bias(&self) -> &[f64] {
        // SAFETY: the array has `nv` entries and lives as long as the data.
        unsafe { std::slice::from_raw_parts(self.raw().qfrc_bias, self.model.raw().nv as usize) }
    }

    /// Forces of springs and dampers of the joints (N·m, N).
    pub fn qfrc_passive(&self) -> &[f64] {
        // SAFETY: the array has `nv` entries and lives as long as the data.
        unsafe { std::slice::from_raw_parts(self.raw().qfrc_passive, self.model.raw().nv as usize) }
    }

    /// Forces of contacts and joint limits on the joints in the last step (N·m, N).
    pub fn qfrc_constraint(&self) -> &[f64] {
        // SAFETY: the array has `nv` entries and lives as long as the data.
        unsafe { std::slice::from_raw_parts(self.raw().qfrc_constraint, self.model.raw().nv as usize) }
    }

    /// The joint-space inertia matrix, `nv` x `nv`.
    pub fn mass_matrix(&self) -> DMatrix<f64> {
        let nv = self.model.raw().nv as usize;
        let mut dense = DMatrix::zeros(nv, nv);
        // SAFETY: the output has nv * nv entries (symmetric, so row or column order is the same),
        // and `qM` is the data's own sparse matrix.
        unsafe { mj::mj_fullM(self.model.as_ptr(), dense.as_mut_ptr(), self.raw().qM) };
        dense
    }

    /// Pose of a body in the world.
    pub fn world_from_body(&self, body: Id<Body>) -> Isometry3<f64> {
        assert!(body.index() < Body::count(&self.model), "{body:?} is not of this model");
        // SAFETY: the arrays have 3 and 4 entries per body.
        let (position, quaternion) = unsafe {
            (
                *self.raw().xpos.add(3 * body.index()).cast::<[f64; 3]>(),
                *self.raw().xquat.add(4 * body.index()).cast::<[f64; 4]>(),
            )
        };
        isometry_from_quaternion(position, quaternion)
    }

    /// Pose of a site in the world.
    pub fn world_from_site(&self, site: Id<Site>) -> Isometry3<f64> {
        assert!(site.index() < Site::count(&self.model), "{site:?} is not of this model");
        // SAFETY: the arrays have 3 and 9 entries per site.
        unsafe { isometry_at(self.raw().site_xpos, self.raw().site_xmat, site.index()) }
    }

    /// The pose of a camera, in MuJoCo's camera frame (x right, y up, looking along -z).
    pub fn world_from_mujoco_camera(&self, camera: Id<Camera>) -> Isometry3<f64> {
        assert!(camera.index() < Camera::count(&self.model), "{camera:?} is not of this model");
        // SAFETY: the arrays have 3 and 9 entries per camera.
        unsafe { isometry_at(self.raw().cam_xpos, self.raw().cam_xmat, camera.index()) }
    }

    /// Pose of a geom in the world.
    pub fn world_from_geom(&self, geom: Id<Geom>) -> Isometry3<f64> {
        assert!(geom.index() < Geom::count(&self.model), "{geom:?} is not of this model");
        // SAFETY: the arrays have 3 and 9 entries per geom.
        unsafe { isometry_at(self.raw().geom_xpos, self.raw().geom_xmat, geom.index()) }
    }

    /// Sets the pose of a free joint (its body's pose in the world), with zero velocity.
    pub fn place(&mut self, free_joint: Id<Joint>, world_from_body: &Isometry3<f64>) {
        let (position, velocity) = (self.model.qpos_index(free_joint), self.model.qvel_index(free_joint));
        let (p, q) = (world_from_body.translation.vector, world_from_body.rotation);
        self.qpos_mut()[position..position + 7].copy_from_slice(&[p.x, p.y, p.z, q.w, q.i, q.j, q.k]);
        self.qvel_mut()[velocity..velocity + 6].fill(0.0);
    }

    /// The contacts of the last step that transmit a force.
    pub fn contacts(&self) -> impl Iterator<Item = Contact> + '_ {
        let raw = self.raw();
        // SAFETY: the array has `ncon` valid entries and lives as long as the data.
        let contacts = unsafe { std::slice::from_raw_parts(raw.contact, raw.ncon as usize) };
        contacts.iter().enumerate().filter(|(_, contact)| contact.efc_address >= 0).map(|(index, contact)| {
            let mut force = [0.0; 6];
            // SAFETY: the index is below `ncon` and the output has the six requested entries.
            unsafe { mj::mj_contactForce(self.model.as_ptr(), self.ptr, index as i32, force.as_mut_ptr()) };
            Contact {
                geom1: Id::new(contact.geom1 as usize),
                geom2: Id::new(contact.geom2 as usize),
                position: Vector3::from(contact.pos),
                distance_m: contact.dist,
                normal_force_n: force[0],
            }
        })
    }
}

impl Drop for Data {
    fn drop(&mut self) {
        // SAFETY: the pointer came from `mj_makeData` and is freed once.
        unsafe { mj::mj_deleteData(self.ptr) };
    }
}

fn isometry_from_quaternion([x, y, z]: [f64; 3], [w, i, j, k]: [f64; 4]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)))
}

/// Reads the `index`th position and row-major rotation matrix.
///
/// # Safety
/// `positions` must hold more than `index` triples, `rotations` more than `index` groups of nine.
unsafe fn isometry_at(positions: *const f64, rotations: *const f64, index: usize) -> Isometry3<f64> {
    // SAFETY: the caller promises more than `index` triples and groups of nine.
    let (position, rotation) =
        unsafe { (*positions.add(3 * index).cast::<[f64; 3]>(), *rotations.add(9 * index).cast::<[f64; 9]>()) };
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&rotation));
    Isometry3::from_parts(Translation3::from(position), UnitQuaternion::from_rotation_matrix(&rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL_ON_PLANE: &str = "<mujoco><option timestep='0.001'/><worldbody><geom name='plane' type='plane' size='1 1 1'/>\
        <body name='ball' pos='0 0 1'><freejoint name='free'/><geom name='ball' size='.05' mass='0.5'/></body></worldbody></mujoco>";

    fn data(xml: &str) -> Data {
        Data::new(Arc::new(Model::from_xml(xml, &[]).unwrap())).unwrap()
    }

    #[test]
    fn a_ball_falls_as_galileo_says() {
        let mut data = data(BALL_ON_PLANE);
        for _ in 0..300 {
            data.step().unwrap();
        }
        let ball = data.model().id::<Body>("ball").unwrap();
        data.forward().unwrap();
        let fallen = 1.0 - data.world_from_body(ball).translation.z;
        // g t^2 / 2 = 0.441 m; semi-implicit Euler adds g t dt / 2 = 1.5 mm.
        assert!((fallen - 0.5 * 9.81 * 0.09).abs() < 0.002, "{fallen}");
    }

    #[test]
    fn a_resting_ball_presses_with_its_weight() {
        let mut data = data(BALL_ON_PLANE);
        let model = data.model().clone();
        data.place(model.id("free").unwrap(), &Isometry3::translation(0.2, 0.0, 0.05));
        for _ in 0..2000 {
            data.step().unwrap();
        }
        let contacts: Vec<Contact> = data.contacts().collect();
        assert_eq!(contacts.len(), 1);
        assert!((contacts[0].normal_force_n - 0.5 * 9.81).abs() < 0.01, "{contacts:?}");
        assert!((contacts[0].position - Vector3::new(0.2, 0.0, 0.0)).norm() < 0.002);
    }

    #[test]
    fn poses_are_read_in_the_right_order() {
        let data = data(
            "<mujoco><compiler angle='degree'/><worldbody><body name='b' pos='1 2 3' euler='0 0 90'>\
             <site name='s' pos='0.5 0 0'/></body></worldbody></mujoco>",
        );
        let body = data.world_from_body(data.model().id("b").unwrap());
        let site = data.world_from_site(data.model().id("s").unwrap());
        let quarter_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        for pose in [body, site] {
            assert!(pose.rotation.angle_to(&quarter_turn) < 1e-9, "{pose}");
        }
        assert!((site.translation.vector - Vector3::new(1.0, 2.5, 3.0)).norm() < 1e-12);
    }

    #[test]
    fn divergence_is_an_error() {
        let mut data = data(BALL_ON_PLANE);
        for _ in 0..500 {
            data.step().unwrap();
        }
        data.qpos_mut()[2] = f64::NAN;
        let Err(SimulationError::Unstable { time_secs, .. }) = data.step() else { panic!("no error") };
        assert!((time_secs - 0.5).abs() < 1e-9, "{time_secs}");
    }

    #[test]
    fn a_full_list_of_contacts_is_an_error() {
        // A box on a plane has four contacts.
        let xml = "<mujoco><size njmax='100' nconmax='2'/><worldbody><geom type='plane' size='1 1 1'/>\
                   <body pos='0 0 .05'><freejoint/><geom type='box' size='.05 .05 .05'/></body></worldbody></mujoco>";
        let error = Data::new(Arc::new(Model::from_xml(xml, &[]).unwrap())).err().unwrap();
        let expected = "too many contacts for this part or scene, at 0.000 s of simulated time";
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn the_mass_matrix_of_a_pendulum_is_its_inertia() {
        let data = data(
            "<mujoco><worldbody><body><joint axis='0 1 0'/><geom size='.1' mass='2' pos='0.5 0 0'/></body></worldbody></mujoco>",
        );
        // m l^2 + 2/5 m r^2.
        assert!((data.mass_matrix()[(0, 0)] - (2.0 * 0.25 + 0.4 * 2.0 * 0.01)).abs() < 1e-9);
        // In the horizontal position, the torque of gravity is m g l.
        assert!((data.qfrc_bias()[0].abs() - 2.0 * 9.81 * 0.5).abs() < 1e-9);
    }
}
