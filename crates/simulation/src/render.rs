//! Rendering of scenes without a display.
//!
//! ```text
//! EGL (surfaceless) ── desktop OpenGL context ── mjrContext (offscreen framebuffer)
//!                                                     │
//!             Data ── mjv_updateScene ── mjvScene ── mjr_render ── mjr_readPixels ── RgbImage
//! ```
//!
//! A renderer may be used from any thread. The process renders one picture at a time, because MuJoCo keeps OpenGL's
//! function table in global variables.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use image::RgbImage;
use sdg_mujoco_sys as mj;

use crate::data::Data;
use crate::egl::OffscreenContext;
use crate::error::{Result, SimulationError};
use crate::guard::guarded;
use crate::model::{Camera, Geom, Id, Model};

/// Largest width and height of a picture, in pixels.
pub(crate) const MAX_SIDE_PX: u32 = 8192;

/// Number of triangles of round shapes and of faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tessellation {
    /// As the model says, otherwise as MuJoCo does: 28 slices and 16 stacks of a sphere, 4 × 4 squares of a face.
    Model,
    /// Fewer, for small pictures of a whole workcell: without a GPU, most of their time goes into triangles.
    Coarse,
}

/// Settings of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RenderConfig {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Samples per pixel for antialiasing; 0 for none.
    pub samples: u32,
    /// Side of the shadow map in texels; 0 for no shadows.
    pub shadow_size: u32,
    /// Whether reflective surfaces show the scene; it is then rendered twice.
    pub reflections: bool,
    /// Number of triangles of shapes.
    pub tessellation: Tessellation,
    /// Geom groups to render. By MuJoCo's convention, which the workcell follows, visible shapes are in groups 0 to 2
    /// and collision shapes in group 3.
    pub geom_groups: [bool; 6],
}

impl Default for RenderConfig {
    /// The wrist camera's 640 x 480 pixels, with antialiasing and shadows.
    fn default() -> Self {
        Self {
            width: 640,
            height: 480,
            samples: 4,
            shadow_size: 1024,
            reflections: false,
            tessellation: Tessellation::Model,
            geom_groups: [true, true, true, false, false, false],
        }
    }
}

/// The geom that each pixel shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segmentation {
    width: u32,
    height: u32,
    /// Row by row from the top.
    geoms: Vec<Option<Id<Geom>>>,
}

impl Segmentation {
    /// Width and height in pixels.
    pub fn dimensions(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The geom at a pixel; `None` for the background.
    pub fn geom_at(&self, x: u32, y: u32) -> Option<Id<Geom>> {
        assert!(x < self.width && y < self.height, "({x}, {y}) is outside {}x{}", self.width, self.height);
        self.geoms[(y * self.width + x) as usize]
    }

    /// The pixels that show a geom for which `wanted` holds.
    pub fn pixels_where(&self, wanted: impl Fn(Id<Geom>) -> bool) -> impl Iterator<Item = (u32, u32)> {
        let width = self.width;
        self.geoms.iter().enumerate().filter_map(move |(index, geom)| {
            geom.filter(|&geom| wanted(geom)).map(|_| (index as u32 % width, index as u32 / width))
        })
    }
}

static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

fn drawing_lock() -> MutexGuard<'static, ()> {
    // The lock protects no data of this crate, so that a panic in another thread does no harm.
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Renders states of one model.
pub struct Renderer {
    context: OffscreenContext,
    model: Arc<Model>,
    scene: Box<mj::mjvScene>,
    option: mj::mjvOption,
    perturb: mj::mjvPerturb,
    gl: Box<mj::mjrContext>,
    config: RenderConfig,
}

// SAFETY: the OpenGL context is current on a thread only while that thread holds the drawing lock inside a method of
// `Renderer`; between calls nothing is bound to a thread.
unsafe impl Send for Renderer {}

impl Renderer {
    /// Creates an OpenGL context and uploads the model's textures and meshes.
    ///
    /// # Errors
    /// [`SimulationError::Rendering`] if EGL or OpenGL is missing or fails, [`SimulationError::MuJoCo`] if MuJoCo
    /// fails, [`SimulationError::Configuration`] for a width or height that is not between 1 and 8192 pixels.
    pub fn new(model: &Arc<Model>, config: RenderConfig) -> Result<Self> {
        for (field, value) in [("render width", config.width), ("render height", config.height)] {
            if !(1..=MAX_SIDE_PX).contains(&value) {
                return Err(SimulationError::Configuration {
                    field,
                    expected: format!("1 to {MAX_SIDE_PX} pixels"),
                    found: value.to_string(),
                });
            }
        }

        // A bitwise copy of the struct with the renderer's settings; its arrays are still those of the model.
        let mut adjusted = *model.raw();
        adjusted.vis.global.offwidth = config.width as i32;
        adjusted.vis.global.offheight = config.height as i32;
        adjusted.vis.quality.offsamples = config.samples as i32;
        adjusted.vis.quality.shadowsize = config.shadow_size as i32;
        if config.tessellation == Tessellation::Coarse {
            let quality = &mut adjusted.vis.quality;
            (quality.numslices, quality.numstacks, quality.numquads) = (28, 8, 6);
        }

        let _lock = drawing_lock();
        let context = OffscreenContext::new()?;
        let _current = context.make_current()?;

        // SAFETY: these structs are plain C data for which all zeros is a valid value.
        let (mut scene, mut gl, mut option, mut perturb) = unsafe {
            (
                Box::<mj::mjvScene>::new_zeroed().assume_init(),
                Box::<mj::mjrContext>::new_zeroed().assume_init(),
                std::mem::zeroed::<mj::mjvOption>(),
                std::mem::zeroed::<mj::mjvPerturb>(),
            )
        };
        // SAFETY: each pointer is to a whole struct of that type.
        unsafe {
            mj::mjv_defaultScene(&raw mut *scene);
            mj::mjr_defaultContext(&raw mut *gl);
            mj::mjv_defaultOption(&raw mut option);
            mj::mjv_defaultPerturb(&raw mut perturb);
        }
        option.geomgroup = config.geom_groups.map(u8::from);
        option.sitegroup = [0; 6];

        let max_geoms = model.raw().ngeom + 100;
        guarded("mjr_makeContext", || {
            // SAFETY: the model copy shares the live model's arrays; scene and context were set to
            // their defaults; an OpenGL context is current.
            unsafe {
                mj::mjv_makeScene(&raw const adjusted, &raw mut *scene, max_geoms);
                mj::mjr_makeContext(&raw const adjusted, &raw mut *gl, mj::mjFONTSCALE_50 as i32);
                mj::mjr_setBuffer(mj::mjFB_OFFSCREEN as i32, &raw mut *gl);
            }
        })?;
        if gl.currentBuffer != mj::mjFB_OFFSCREEN as i32 {
            return Err(SimulationError::Rendering { reason: "OpenGL created no offscreen framebuffer".into() });
        }
        scene.flags[mj::mjRND_SHADOW as usize] = u8::from(config.shadow_size > 0);
        scene.flags[mj::mjRND_REFLECTION as usize] = u8::from(config.reflections);
        Ok(Self { context, model: model.clone(), scene, option, perturb, gl, config })
    }

    /// The settings of the renderer.
    pub fn config(&self) -> &RenderConfig {
        &self.config
    }

    /// The picture of a camera of the model, with y down.
    ///
    /// # Errors
    /// [`SimulationError::MuJoCo`] or [`SimulationError::Rendering`].
    pub fn image(&mut self, data: &mut Data, camera: Id<Camera>) -> Result<RgbImage> {
        let bytes = self.draw(data, camera)?;
        Ok(RgbImage::from_raw(self.config.width, self.config.height, bytes).expect("three bytes a pixel"))
    }

    /// The geom that each pixel of the camera's picture shows.
    ///
    /// # Errors
    /// As for [`Renderer::image`].
    pub fn segmentation(&mut self, data: &mut Data, camera: Id<Camera>) -> Result<Segmentation> {
        let flags = self.scene.flags;
        self.scene.flags[mj::mjRND_SEGMENT as usize] = 1;
        self.scene.flags[mj::mjRND_IDCOLOR as usize] = 1;
        let drawn = self.draw(data, camera);
        self.scene.flags = flags;
        let bytes = drawn?;

        // Colours are indices into the scene's list of objects, plus one. SAFETY: the scene's buffer has `ngeom` filled
        // entries.
        let shown = unsafe { std::slice::from_raw_parts(self.scene.geoms, self.scene.ngeom as usize) };
        let mut geom_of_color = vec![None; shown.len() + 1];
        for geom in shown {
            let is_geom = geom.objtype == mj::mjOBJ_GEOM as i32 && geom.objid >= 0;
            if let (true, Some(slot)) = (is_geom, geom_of_color.get_mut((geom.segid + 1) as usize)) {
                *slot = Some(Id::new(geom.objid as usize));
            }
        }
        let geoms = bytes
            .chunks_exact(3)
            .map(|rgb| {
                let color = usize::from(rgb[0]) | usize::from(rgb[1]) << 8 | usize::from(rgb[2]) << 16;
                geom_of_color.get(color).copied().flatten()
            })
            .collect();
        Ok(Segmentation { width: self.config.width, height: self.config.height, geoms })
    }

    /// Renders with the present flags and reads the pixels, row by row from the top.
    fn draw(&mut self, data: &mut Data, camera: Id<Camera>) -> Result<Vec<u8>> {
        let (width, height) = (self.config.width as usize, self.config.height as usize);
        let viewport = mj::mjrRect { left: 0, bottom: 0, width: width as i32, height: height as i32 };
        let mut bytes = vec![0_u8; 3 * width * height];

        // SAFETY: the struct is plain C data for which all zeros is a valid value.
        let mut view = unsafe { std::mem::zeroed::<mj::mjvCamera>() };
        // SAFETY: the pointer is to a whole struct.
        unsafe { mj::mjv_defaultCamera(&raw mut view) };
        view.type_ = mj::mjCAMERA_FIXED as i32;
        view.fixedcamid = camera.index() as i32;

        assert!(Arc::ptr_eq(data.model(), &self.model), "the renderer was made for another model");
        let _lock = drawing_lock();
        let _current = self.context.make_current()?;
        guarded("mjr_render", || {
            // SAFETY: model, data, scene and context are live and were made for this model (asserted above); this
            // renderer's OpenGL context is current; the buffer holds three bytes a pixel of the viewport, which is the
            // framebuffer's own size.
            unsafe {
                mj::mjv_updateScene(
                    self.model.as_ptr(),
                    data.as_mut_ptr(),
                    &raw const self.option,
                    &raw const self.perturb,
                    &raw mut view,
                    mj::mjCAT_ALL as i32,
                    &raw mut *self.scene,
                );
                mj::mjr_render(viewport, &raw mut *self.scene, &raw const *self.gl);
                mj::mjr_readPixels(bytes.as_mut_ptr(), std::ptr::null_mut(), viewport, &raw const *self.gl);
            }
        })?;

        // OpenGL's first row is the bottom row.
        let mut top_down = Vec::with_capacity(bytes.len());
        for row in bytes.chunks_exact(3 * width).rev() {
            top_down.extend_from_slice(row);
        }
        Ok(top_down)
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        let _lock = drawing_lock();
        // If the context cannot be made current, OpenGL's objects are not freed and stay in the context.
        if let Ok(_current) = self.context.make_current() {
            // SAFETY: the context was made by `mjr_makeContext` and is freed once.
            unsafe { mj::mjr_freeContext(&raw mut *self.gl) };
        }
        // SAFETY: the scene was made by `mjv_makeScene` and is freed once.
        unsafe { mj::mjv_freeScene(&raw mut *self.scene) };
    }
}
