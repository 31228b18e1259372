//! An OpenGL context that needs no display: EGL on Mesa's surfaceless platform.

use std::sync::{Mutex, OnceLock, PoisonError};

use khronos_egl as egl;

use crate::error::{Result, SimulationError};

/// `EGL_PLATFORM_SURFACELESS_MESA`, of the extension `EGL_MESA_platform_surfaceless`.
const PLATFORM_SURFACELESS_MESA: egl::Enum = 0x31DD;

type Egl = egl::DynamicInstance<egl::EGL1_5>;

/// EGL and its display. They are opened once per process and never closed, because MuJoCo keeps pointers to functions
/// of the driver.
struct Surfaceless {
    egl: Egl,
    display: egl::Display,
    config: egl::Config,
}

// SAFETY: EGL's functions may be called from any thread (EGL 1.5, section 2.2), and the handles are
// only passed back to them.
unsafe impl Send for Surfaceless {}
// SAFETY: a shared reference passes the handles to EGL's functions only, which several threads may call at once.
unsafe impl Sync for Surfaceless {}

fn surfaceless() -> Result<&'static Surfaceless> {
    static SURFACELESS: OnceLock<std::result::Result<Surfaceless, String>> = OnceLock::new();
    SURFACELESS.get_or_init(open).as_ref().map_err(|reason| SimulationError::Rendering { reason: reason.clone() })
}

/// Opens EGL and its display, once per process.
pub(crate) fn load() -> Result<()> {
    surfaceless().map(|_| ())
}

fn open() -> std::result::Result<Surfaceless, String> {
    // SAFETY: loading libEGL runs its initialisers only; Debian's has no precondition.
    let egl = unsafe { Egl::load_required() }.map_err(|error| format!("libEGL.so.1 could not be loaded ({error})"))?;
    // SAFETY: the surfaceless platform expects the default display, with an empty list of
    // attributes.
    let display =
        unsafe { egl.get_platform_display(PLATFORM_SURFACELESS_MESA, egl::DEFAULT_DISPLAY, &[egl::ATTRIB_NONE]) }
            .map_err(|error| format!("no surfaceless display ({error})"))?;
    egl.initialize(display).map_err(|error| format!("EGL could not be initialised ({error})"))?;
    egl.bind_api(egl::OPENGL_API).map_err(|error| format!("no desktop OpenGL ({error})"))?;
    let wanted = [egl::RENDERABLE_TYPE, egl::OPENGL_BIT, egl::SURFACE_TYPE, 0, egl::NONE];
    let config = egl
        .choose_first_config(display, &wanted)
        .map_err(|error| format!("no EGL configuration ({error})"))?
        .ok_or("no EGL configuration for desktop OpenGL without a surface")?;
    Ok(Surfaceless { egl, display, config })
}

/// A context that is current on no thread.
struct Unused(egl::Context);

// SAFETY: an EGL context may be made current on any thread as long as it is current on no other (EGL 1.5, section
// 3.7.3).
unsafe impl Send for Unused {}

/// Contexts that are ready for reuse. The driver compiles its shaders for each new context, which takes longer than
/// rendering a picture.
static UNUSED: Mutex<Vec<Unused>> = Mutex::new(Vec::new());

/// An OpenGL context. It is current on a thread only while a [`Current`] exists.
pub(crate) struct OffscreenContext {
    egl: &'static Surfaceless,
    context: egl::Context,
}

impl OffscreenContext {
    pub(crate) fn new() -> Result<Self> {
        let surfaceless = surfaceless()?;
        if let Some(Unused(context)) = UNUSED.lock().unwrap_or_else(PoisonError::into_inner).pop() {
            return Ok(Self { egl: surfaceless, context });
        }
        let failed = |error| SimulationError::Rendering { reason: format!("no OpenGL context ({error})") };
        // The bound API is a property of each thread.
        surfaceless.egl.bind_api(egl::OPENGL_API).map_err(failed)?;
        let context = surfaceless
            .egl
            .create_context(surfaceless.display, surfaceless.config, None, &[egl::NONE])
            .map_err(failed)?;
        Ok(Self { egl: surfaceless, context })
    }

    /// Makes the context current on this thread until the guard is dropped.
    pub(crate) fn make_current(&self) -> Result<Current> {
        let failed =
            |error| SimulationError::Rendering { reason: format!("OpenGL context not made current ({error})") };
        self.egl.egl.bind_api(egl::OPENGL_API).map_err(failed)?;
        self.egl.egl.make_current(self.egl.display, None, None, Some(self.context)).map_err(failed)?;
        Ok(Current { egl: self.egl })
    }
}

impl Drop for OffscreenContext {
    fn drop(&mut self) {
        UNUSED.lock().unwrap_or_else(PoisonError::into_inner).push(Unused(self.context));
    }
}

/// Keeps a context current on this thread, and releases it when dropped.
pub(crate) struct Current {
    egl: &'static Surfaceless,
}

impl Drop for Current {
    fn drop(&mut self) {
        // If this fails, the context stays current on this thread, and the next `make_current` reports the error.
        let _ = self.egl.egl.make_current(self.egl.display, None, None, None);
    }
}
