//! MuJoCo's functions, in a library that [`crate::load`] loads at run time.
//!
//! A program linked to libmujoco would not start without the library, although most of the program's commands need no
//! simulator.

use std::ffi::{c_char, c_int, c_uchar};
use std::sync::OnceLock;

use libloading::Library;

use crate::bindings::{
    self, mjData, mjModel, mjOption, mjVFS, mjVisual, mjrContext, mjrRect, mjtNum, mjvCamera, mjvOption, mjvPerturb,
    mjvScene,
};
use crate::error::LibraryError;

/// File names of the library in Debian and in MuJoCo's own archives: first this version, then any.
const NAMES: [&str; 2] = ["libmujoco.so.2.2.2", "libmujoco.so"];

/// Called with MuJoCo's message.
pub type Handler = unsafe extern "C-unwind" fn(*const c_char);

static LOADED: OnceLock<Result<Functions, LibraryError>> = OnceLock::new();

/// Loads libmujoco, once per process, if `check` accepts it.
pub(crate) fn load(check: impl FnOnce(&Functions) -> Result<(), LibraryError>) -> Result<(), LibraryError> {
    let loaded = LOADED.get_or_init(|| {
        let functions = Functions::load()?;
        check(&functions)?;
        Ok(functions)
    });
    loaded.as_ref().map(|_| ()).map_err(Clone::clone)
}

/// Sets the handlers of errors and of warnings. The error handler may unwind through MuJoCo.
///
/// # Safety
/// No other thread is inside a function of MuJoCo.
///
/// # Panics
/// Unless [`crate::load`] has succeeded.
pub unsafe fn set_handlers(on_error: Handler, on_warning: Handler) {
    let functions = functions();
    // SAFETY: both point at statics of the library, which is never closed; the caller promises that no thread reads
    // them.
    unsafe {
        *functions.user_error = Some(on_error);
        *functions.user_warning = Some(on_warning);
    }
}

fn functions() -> &'static Functions {
    let loaded = LOADED.get().and_then(|loaded| loaded.as_ref().ok());
    loaded.expect("`load` is called, and succeeds, before any function of MuJoCo")
}

macro_rules! functions {
    ($(fn $name:ident($($arg:ident: $type:ty),*) $(-> $out:ty)?;)*) => {
        // Compares the signature with the header's at compile time; nothing is linked.
        $(const _: unsafe extern "C-unwind" fn($($type),*) $(-> $out)? = bindings::$name;)*

        /// Addresses in the library.
        pub(crate) struct Functions {
            $(pub(crate) $name: unsafe extern "C-unwind" fn($($type),*) $(-> $out)?,)*
            user_error: *mut Option<Handler>,
            user_warning: *mut Option<Handler>,
            // If it were unloaded, the addresses would be invalid.
            _library: Library,
        }

        impl Functions {
            fn load() -> Result<Self, LibraryError> {
                let library = open(&NAMES)?;
                // SAFETY: until the version is checked, only `mj_version` and functions that set default values are
                // called, and these symbols have the types of that version's header.
                unsafe {
                    Ok(Self {
                        $($name: *symbol(&library, stringify!($name))?,)*
                        user_error: *symbol(&library, "mju_user_error")?,
                        user_warning: *symbol(&library, "mju_user_warning")?,
                        _library: library,
                    })
                }
            }
        }

        $(
            /// MuJoCo's function of this name.
            ///
            /// # Safety
            /// See MuJoCo's documentation.
            ///
            /// # Panics
            /// Unless [`crate::load`] has succeeded.
            pub unsafe fn $name($($arg: $type),*) $(-> $out)? {
                // SAFETY: the caller keeps to MuJoCo's documentation.
                unsafe { (functions().$name)($($arg),*) }
            }
        )*
    };
}

// SAFETY: addresses of functions, and of two statics that are written through `set_handlers` alone.
unsafe impl Send for Functions {}
// SAFETY: as above; a shared reference allows nothing else.
unsafe impl Sync for Functions {}

fn open(names: &[&str]) -> Result<Library, LibraryError> {
    let mut reasons = Vec::new();
    for name in names {
        // SAFETY: loading libmujoco runs the initialisers of C++'s statics only.
        match unsafe { Library::new(name) } {
            Ok(library) => return Ok(library),
            Err(error) => reasons.push(error.to_string()),
        }
    }
    Err(LibraryError::Missing { reason: reasons.join("; ") })
}

/// Looks up a symbol of the library.
///
/// # Safety
/// `T` is the type of the symbol's address.
unsafe fn symbol<'a, T>(library: &'a Library, name: &str) -> Result<libloading::Symbol<'a, T>, LibraryError> {
    // SAFETY: the caller names the type.
    unsafe { library.get(name.as_bytes()) }.map_err(|error| LibraryError::Missing { reason: error.to_string() })
}

functions! {
    fn mj_collision(m: *const mjModel, d: *mut mjData);
    fn mj_contactForce(m: *const mjModel, d: *const mjData, id: c_int, result: *mut mjtNum);
    fn mj_defaultOption(opt: *mut mjOption);
    fn mj_defaultVFS(vfs: *mut mjVFS);
    fn mj_defaultVisual(vis: *mut mjVisual);
    fn mj_deleteData(d: *mut mjData);
    fn mj_deleteModel(m: *mut mjModel);
    fn mj_deleteVFS(vfs: *mut mjVFS);
    fn mj_forward(m: *const mjModel, d: *mut mjData);
    fn mj_fullM(m: *const mjModel, dst: *mut mjtNum, M: *const mjtNum);
    fn mj_id2name(m: *const mjModel, type_: c_int, id: c_int) -> *const c_char;
    fn mj_kinematics(m: *const mjModel, d: *mut mjData);
    fn mj_loadXML(filename: *const c_char, vfs: *const mjVFS, error: *mut c_char, error_sz: c_int) -> *mut mjModel;
    fn mj_makeData(m: *const mjModel) -> *mut mjData;
    fn mj_makeEmptyFileVFS(vfs: *mut mjVFS, filename: *const c_char, filesize: c_int) -> c_int;
    fn mj_name2id(m: *const mjModel, type_: c_int, name: *const c_char) -> c_int;
    fn mj_resetData(m: *const mjModel, d: *mut mjData);
    fn mj_step(m: *const mjModel, d: *mut mjData);
    fn mj_step1(m: *const mjModel, d: *mut mjData);
    fn mj_step2(m: *const mjModel, d: *mut mjData);
    fn mj_version() -> c_int;
    fn mjr_defaultContext(con: *mut mjrContext);
    fn mjr_freeContext(con: *mut mjrContext);
    fn mjr_makeContext(m: *const mjModel, con: *mut mjrContext, fontscale: c_int);
    fn mjr_readPixels(rgb: *mut c_uchar, depth: *mut f32, viewport: mjrRect, con: *const mjrContext);
    fn mjr_render(viewport: mjrRect, scn: *mut mjvScene, con: *const mjrContext);
    fn mjr_setBuffer(framebuffer: c_int, con: *mut mjrContext);
    fn mju_error(msg: *const c_char);
    fn mjv_defaultCamera(cam: *mut mjvCamera);
    fn mjv_defaultOption(opt: *mut mjvOption);
    fn mjv_defaultPerturb(pert: *mut mjvPerturb);
    fn mjv_defaultScene(scn: *mut mjvScene);
    fn mjv_freeScene(scn: *mut mjvScene);
    fn mjv_makeScene(m: *const mjModel, scn: *mut mjvScene, maxgeom: c_int);
    fn mjv_updateScene(m: *const mjModel, d: *mut mjData, opt: *const mjvOption, pert: *const mjvPerturb, cam: *mut mjvCamera, catmask: c_int, scn: *mut mjvScene);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_library_is_named_with_what_to_install() {
        let error = open(&["libmujoco-of-nobody.so"]).unwrap_err().to_string();
        for part in ["libmujoco-of-nobody.so", "2.2.2", "libmujoco2.2.2", "LD_LIBRARY_PATH"] {
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn a_library_without_the_functions_is_refused() {
        // The C library is loaded, but not a simulator.
        let error = open(&["libc.so.6"]).map(|library| {
            // SAFETY: nothing is called.
            unsafe { symbol::<Handler>(&library, "mj_version") }.map(|_| ()).unwrap_err().to_string()
        });
        assert!(error.as_ref().is_ok_and(|text| text.contains("mj_version")), "{error:?}");
    }
}
