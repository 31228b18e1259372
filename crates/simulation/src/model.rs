//! A compiled MuJoCo model: the data that does not change during the simulation.

use std::ffi::{CStr, CString, c_char, c_int};
use std::marker::PhantomData;
use std::sync::Mutex;

use sdg_mujoco_sys as mj;

use crate::error::{Result, SimulationError};
use crate::guard::{guarded, initialise};

/// A file named by an MJCF model, such as a texture's PNG.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Asset {
    /// File name in the MJCF, without folders.
    pub name: String,
    /// The file's bytes.
    pub bytes: Vec<u8>,
}

/// A kind of named objects in a model; implemented by the marker types [`Body`], [`Joint`], ….
pub trait Kind {
    /// MuJoCo's number of the kind.
    const TYPE: u32;
    /// The name of the kind, for messages.
    const NAME: &'static str;
    /// Number of objects of the kind in the model.
    fn count(model: &Model) -> usize;
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $constant:ident, $name:literal, $count:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub struct $kind;

        impl Kind for $kind {
            const TYPE: u32 = mj::$constant as u32;
            const NAME: &'static str = $name;
            fn count(model: &Model) -> usize {
                model.raw().$count as usize
            }
        }
    )*};
}

kinds! {
    /// A rigid body.
    Body = mjOBJ_BODY, "body", nbody;
    /// A joint.
    Joint = mjOBJ_JOINT, "joint", njnt;
    /// A geometric shape of a body.
    Geom = mjOBJ_GEOM, "geom", ngeom;
    /// A frame fixed to a body.
    Site = mjOBJ_SITE, "site", nsite;
    /// A camera.
    Camera = mjOBJ_CAMERA, "camera", ncam;
    /// An actuator.
    Actuator = mjOBJ_ACTUATOR, "actuator", nu;
}

/// Index of an object of kind `K` in the model that returned it.
pub struct Id<K> {
    index: usize,
    kind: PhantomData<fn() -> K>,
}

impl<K> Id<K> {
    pub(crate) fn new(index: usize) -> Self {
        Self { index, kind: PhantomData }
    }

    /// The index into MuJoCo's arrays of that kind.
    pub fn index(self) -> usize {
        self.index
    }
}

impl<K> Clone for Id<K> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K> Copy for Id<K> {}

impl<K> PartialEq for Id<K> {
    fn eq(&self, other: &Self) -> bool {
        self.index == other.index
    }
}

impl<K> Eq for Id<K> {}

impl<K: Kind> std::fmt::Debug for Id<K> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", K::NAME, self.index)
    }
}

/// A model compiled from MJCF.
///
/// A model is never changed after construction, so that threads may share it.
pub struct Model {
    ptr: *mut mj::mjModel,
}

// SAFETY: the model is owned by this value, is not bound to the thread that made it, and after
// `from_xml` it is only read.
unsafe impl Send for Model {}
// SAFETY: after `from_xml` nothing writes to the model: all calls pass it as `const mjModel*`.
unsafe impl Sync for Model {}

/// MuJoCo keeps the last XML in a global, and its XML reader is not known to be reentrant.
static XML_LOCK: Mutex<()> = Mutex::new(());

impl Model {
    /// Compiles an MJCF model. Files that the MJCF names are read only from `assets`, never from disk.
    ///
    /// # Errors
    /// [`SimulationError::Model`] with MuJoCo's message, [`SimulationError::Asset`] for a file that is repeated, empty
    /// or too large, or whose name is invalid, [`SimulationError::Library`] for the wrong libmujoco.
    pub fn from_xml(xml: &str, assets: &[Asset]) -> Result<Self> {
        const MODEL_FILE: &str = "model.xml";
        initialise()?;

        let mut files = VirtualFiles::new();
        files.add(MODEL_FILE, xml.as_bytes())?;
        for asset in assets {
            files.add(&asset.name, &asset.bytes)?;
        }

        let name = CString::new(MODEL_FILE).expect("the name has no NUL");
        let mut message: [c_char; 1024] = [0; 1024];
        let _one_at_a_time = XML_LOCK.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let ptr = guarded("mj_loadXML", || {
            // SAFETY: the name ends in NUL, the file system is initialised, and the buffer has the given length.
            unsafe { mj::mj_loadXML(name.as_ptr(), files.as_ptr(), message.as_mut_ptr(), message.len() as c_int) }
        })
        .map_err(|error| match error {
            SimulationError::MuJoCo { message, .. } => SimulationError::Model { message },
            other => other,
        })?;
        if ptr.is_null() {
            // SAFETY: MuJoCo ends its message with NUL inside the buffer, which began as zeros.
            let message = unsafe { CStr::from_ptr(message.as_ptr()) }.to_string_lossy().trim().to_owned();
            return Err(SimulationError::Model { message });
        }
        Ok(Self { ptr })
    }

    pub(crate) fn raw(&self) -> &mj::mjModel {
        // SAFETY: the pointer comes from `mj_loadXML`, is not null, and lives as long as `self`.
        unsafe { &*self.ptr }
    }

    pub(crate) fn as_ptr(&self) -> *const mj::mjModel {
        self.ptr
    }

    /// The object of that kind and name.
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`] with the names that exist.
    ///
    /// ```
    /// use sdg_simulation::{Body, Model};
    /// # fn main() -> Result<(), sdg_simulation::SimulationError> {
    /// let model = Model::from_xml("<mujoco><worldbody><body name='part'/></worldbody></mujoco>", &[])?;
    /// assert_eq!(model.id::<Body>("part")?.index(), 1);
    /// assert!(model.id::<Body>("prat").is_err());
    /// # Ok(())
    /// # }
    /// ```
    pub fn id<K: Kind>(&self, name: &str) -> Result<Id<K>> {
        let unknown = || SimulationError::UnknownName {
            kind: K::NAME,
            name: name.to_owned(),
            existing: self.ids::<K>().filter_map(|id| self.name(id)).collect(),
        };
        let c_name = CString::new(name).map_err(|_| unknown())?;
        // SAFETY: the model is live and the name ends in NUL.
        let index = unsafe { mj::mj_name2id(self.ptr, K::TYPE as c_int, c_name.as_ptr()) };
        usize::try_from(index).map(Id::new).map_err(|_| unknown())
    }

    /// All objects of a kind, in MuJoCo's order.
    pub fn ids<K: Kind>(&self) -> impl Iterator<Item = Id<K>> + use<K> {
        (0..K::count(self)).map(Id::new)
    }

    /// The name of an object, if it has one.
    pub fn name<K: Kind>(&self, id: Id<K>) -> Option<String> {
        // SAFETY: the model is live; MuJoCo returns null for an index that it does not have.
        let name = unsafe { mj::mj_id2name(self.ptr, K::TYPE as c_int, id.index as c_int) };
        if name.is_null() {
            return None;
        }
        // SAFETY: not null, and a NUL-terminated string inside the model's name buffer.
        let name = unsafe { CStr::from_ptr(name) }.to_string_lossy().into_owned();
        (!name.is_empty()).then_some(name)
    }

    /// The body of a geom.
    pub fn body_of(&self, geom: Id<Geom>) -> Id<Body> {
        assert!(geom.index < Geom::count(self), "{geom:?} is not of this model");
        // SAFETY: the array has `ngeom` entries.
        Id::new(unsafe { *self.raw().geom_bodyid.add(geom.index) } as usize)
    }

    /// Radius and half length of a capsule in metres, with its axis along the geom's z; `None` for other shapes.
    pub fn capsule_m(&self, geom: Id<Geom>) -> Option<(f64, f64)> {
        assert!(geom.index < Geom::count(self), "{geom:?} is not of this model");
        // SAFETY: the arrays have `ngeom` entries, and three for each.
        let (kind, size) = unsafe {
            (*self.raw().geom_type.add(geom.index), *self.raw().geom_size.add(3 * geom.index).cast::<[f64; 3]>())
        };
        (kind == mj::mjGEOM_CAPSULE as i32).then_some((size[0], size[1]))
    }

    /// Whether a geom is in MuJoCo's visual group with this number.
    pub fn is_in_group(&self, geom: Id<Geom>, group: i32) -> bool {
        assert!(geom.index < Geom::count(self), "{geom:?} is not of this model");
        // SAFETY: the array has `ngeom` entries.
        unsafe { *self.raw().geom_group.add(geom.index) == group }
    }

    /// Index of a joint's first position in `qpos`.
    pub fn qpos_index(&self, joint: Id<Joint>) -> usize {
        assert!(joint.index < Joint::count(self), "{joint:?} is not of this model");
        // SAFETY: the array has `njnt` entries.
        unsafe { *self.raw().jnt_qposadr.add(joint.index) as usize }
    }

    /// Index of a joint's first velocity in `qvel`.
    pub fn qvel_index(&self, joint: Id<Joint>) -> usize {
        assert!(joint.index < Joint::count(self), "{joint:?} is not of this model");
        // SAFETY: the array has `njnt` entries.
        unsafe { *self.raw().jnt_dofadr.add(joint.index) as usize }
    }

    /// A body's mass in kilograms.
    pub fn mass_kg(&self, body: Id<Body>) -> f64 {
        assert!(body.index < Body::count(self), "{body:?} is not of this model");
        // SAFETY: the array has `nbody` entries.
        unsafe { *self.raw().body_mass.add(body.index) }
    }

    /// A camera's vertical field of view in radians.
    pub fn vertical_field_of_view_rad(&self, camera: Id<Camera>) -> f64 {
        assert!(camera.index < Camera::count(self), "{camera:?} is not of this model");
        // SAFETY: the array has `ncam` entries; MuJoCo keeps the angle in degrees.
        unsafe { *self.raw().cam_fovy.add(camera.index) }.to_radians()
    }
}

impl Drop for Model {
    fn drop(&mut self) {
        // SAFETY: the pointer came from `mj_loadXML` and is freed once; every `Data` holds the model by an `Arc`, so
        // that none exists any more.
        unsafe { mj::mj_deleteModel(self.ptr) };
    }
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let raw = self.raw();
        write!(
            f,
            "Model {{ nq: {}, nv: {}, nu: {}, nbody: {}, ngeom: {} }}",
            raw.nq, raw.nv, raw.nu, raw.nbody, raw.ngeom
        )
    }
}

/// MuJoCo's file system in memory. It is boxed because it is a fixed table of 2000 names of 1000 bytes (2 MB).
struct VirtualFiles {
    vfs: Box<mj::mjVFS>,
}

impl VirtualFiles {
    fn new() -> Self {
        // SAFETY: `mjVFS` contains only integers, bytes and raw pointers, so that all zeros is a valid value;
        // `new_zeroed` avoids 2 MB on the stack.
        let mut vfs = unsafe { Box::<mj::mjVFS>::new_zeroed().assume_init() };
        // SAFETY: the pointer is to a whole `mjVFS`.
        unsafe { mj::mj_defaultVFS(&raw mut *vfs) };
        Self { vfs }
    }

    fn as_ptr(&self) -> *const mj::mjVFS {
        &raw const *self.vfs
    }

    fn add(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let problem = |reason: String| SimulationError::Asset { name: name.to_owned(), reason };
        let size = c_int::try_from(bytes.len()).map_err(|_| problem("larger than 2 GiB".into()))?;
        if size == 0 {
            return Err(problem("empty".into()));
        }
        if name.len() >= mj::mjMAXVFSNAME as usize {
            return Err(problem(format!("name longer than {} bytes", mj::mjMAXVFSNAME - 1)));
        }
        let c_name = CString::new(name).map_err(|_| problem("name holds a NUL byte".into()))?;
        // SAFETY: the file system is initialised and the name ends in NUL.
        match unsafe { mj::mj_makeEmptyFileVFS(&raw mut *self.vfs, c_name.as_ptr(), size) } {
            0 => {}
            1 => return Err(problem(format!("more than {} files", mj::mjMAXVFS))),
            2 => return Err(problem("given twice".into())),
            code => return Err(problem(format!("mj_makeEmptyFileVFS returned {code}"))),
        }
        let slot = self.vfs.nfile as usize - 1;
        // SAFETY: MuJoCo appended the file in the last slot, with a buffer of `size` bytes of its own, which cannot
        // overlap `bytes`.
        unsafe {
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), self.vfs.filedata[slot].cast::<u8>(), bytes.len());
        }
        Ok(())
    }
}

impl Drop for VirtualFiles {
    fn drop(&mut self) {
        // SAFETY: the file system was initialised, and its buffers are MuJoCo's own.
        unsafe { mj::mj_deleteVFS(&raw mut *self.vfs) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_ids_and_back() {
        let xml = "<mujoco><worldbody><body name='part'><joint name='turn' type='ball'/>\
                   <joint name='slide' type='slide'/><geom name='ball' size='.1' density='1000'/></body></worldbody></mujoco>";
        let model = Model::from_xml(xml, &[]).unwrap();
        let part = model.id::<Body>("part").unwrap();
        assert_eq!(model.name(part).as_deref(), Some("part"));
        assert_eq!(model.body_of(model.id::<Geom>("ball").unwrap()), part);
        // A ball joint has four positions and three velocities.
        let slide = model.id::<Joint>("slide").unwrap();
        assert_eq!((model.qpos_index(slide), model.qvel_index(slide)), (4, 3));
        // 4/3 pi 0.1^3 m^3 at 1000 kg/m^3.
        assert!((model.mass_kg(part) - 4.18879).abs() < 1e-5);
    }

    #[test]
    fn an_unknown_name_lists_the_names() {
        let model = Model::from_xml("<mujoco><worldbody><camera name='wrist'/></worldbody></mujoco>", &[]).unwrap();
        let error = model.id::<Camera>("rist").unwrap_err();
        assert_eq!(error.to_string(), "unknown camera \"rist\"; known: wrist");
    }

    #[test]
    fn mujocos_complaint_is_passed_on() {
        let error = Model::from_xml("<mujoco>\n<worldbody><geom size='-1'/></worldbody></mujoco>", &[]).unwrap_err();
        assert!(
            matches!(&error, SimulationError::Model { message } if message.contains("size") && message.contains('2')),
            "{error}"
        );
        assert!(Model::from_xml("<mujoco", &[]).is_err());
    }

    #[test]
    fn an_asset_is_read_from_memory() {
        // A custom texture of 1x2 pixels: two 32-bit integers and the RGB bytes.
        let mut bytes = Vec::new();
        bytes.extend(1_i32.to_le_bytes());
        bytes.extend(2_i32.to_le_bytes());
        bytes.extend([255, 0, 0, 0, 255, 0]);
        let xml = "<mujoco><asset><texture name='t' type='2d' file='two.txt'/></asset></mujoco>";
        let asset = Asset { name: "two.txt".into(), bytes };
        let model = Model::from_xml(xml, std::slice::from_ref(&asset)).unwrap();
        assert_eq!(model.raw().ntexdata, 6);

        let twice = Model::from_xml(xml, &[asset.clone(), asset.clone()]).unwrap_err();
        assert_eq!(twice, SimulationError::Asset { name: "two.txt".into(), reason: "given twice".into() });
        let empty = Model::from_xml(xml, &[Asset { bytes: Vec::new(), ..asset }]).unwrap_err();
        assert_eq!(empty, SimulationError::Asset { name: "two.txt".into(), reason: "empty".into() });
        assert!(matches!(Model::from_xml(xml, &[]), Err(SimulationError::Model { .. })));
    }
}
