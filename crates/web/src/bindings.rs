//! The JavaScript interface: the class `Model`. Errors are thrown as `Error` with the message of the Rust error.

use sdg_grasp::{Device, Verification};
use wasm_bindgen::prelude::*;

use crate::detector::Detector;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console)]
    fn error(message: &str);
}

/// Makes a panic print its position; a panic stops the module permanently.
#[wasm_bindgen(start)]
fn start() {
    std::panic::set_hook(Box::new(|panic| error(&panic.to_string())));
}

/// An opened grasp model.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Model(Detector);

#[wasm_bindgen]
impl Model {
    /// Opens a model from its file's bytes.
    ///
    /// # Errors
    /// A file that is not a grasp model, has another version, or is damaged; a browser that provides no graphics
    /// card.
    pub async fn open(bytes: Vec<u8>) -> Result<Model, JsError> {
        Ok(Self(Detector::open(&bytes, &device().await?)?))
    }

    /// The metadata of the file, as JSON; see [`Detector::summary`].
    pub fn summary(&self) -> String {
        self.0.summary()
    }

    /// Detects in a PNG or JPEG file; see [`Detector::detect_in_file`].
    ///
    /// # Errors
    /// A file that is not an image, is damaged, or is too large; an error of the search.
    #[wasm_bindgen(js_name = detectInFile)]
    pub async fn detect_in_file(&self, bytes: &[u8], verify: bool) -> Result<String, JsError> {
        Ok(self.0.detect_in_file(bytes, verification(verify)).await?)
    }

    /// Detects in the pixels of a canvas; see [`Detector::detect_in_pixels`].
    ///
    /// # Errors
    /// The number of bytes does not match the size, or the image is too large; an error of the search.
    #[wasm_bindgen(js_name = detectInPixels)]
    pub async fn detect_in_pixels(
        &self,
        rgba: &[u8],
        width: u32,
        height: u32,
        verify: bool,
    ) -> Result<String, JsError> {
        Ok(self.0.detect_in_pixels(rgba, width, height, verification(verify)).await?)
    }
}

fn verification(verify: bool) -> Verification {
    if verify { Verification::ByShape } else { Verification::Off }
}

/// The device of this module.
async fn device() -> Result<Device, JsError> {
    #[cfg(not(feature = "webgpu"))]
    return Ok(Device::flex());
    #[cfg(feature = "webgpu")]
    {
        thread_local! {
            static OPENED: std::cell::RefCell<Option<Device>> = const { std::cell::RefCell::new(None) };
        }
        if let Some(device) = OPENED.with_borrow(Clone::clone) {
            return Ok(device);
        }
        let device = Device::wgpu_options().init_async().await?;
        OPENED.set(Some(device.clone()));
        Ok(device)
    }
}
