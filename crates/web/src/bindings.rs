//! What JavaScript sees: the class `Model`. Errors arrive there as `Error`, with the message of the Rust error.

use sdg_grasp::Verification;
use wasm_bindgen::prelude::*;

use crate::looker::Looker;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console)]
    fn error(message: &str);
}

/// Has a panic, which stops the module for good, say where it was.
#[wasm_bindgen(start)]
fn start() {
    std::panic::set_hook(Box::new(|panic| error(&panic.to_string())));
}

/// An opened grasp model.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Model(Looker);

#[wasm_bindgen]
impl Model {
    /// Opens a model from its file's bytes.
    ///
    /// # Errors
    /// No grasp model, one of another version, or a damaged one.
    #[wasm_bindgen(constructor)]
    pub fn new(bytes: &[u8]) -> Result<Model, JsError> {
        Ok(Self(Looker::open(bytes)?))
    }

    /// What the file says of itself, as JSON; see [`Looker::summary`].
    pub fn summary(&self) -> String {
        self.0.summary()
    }

    /// Looks at a PNG or JPEG file; see [`Looker::look_at_file`].
    ///
    /// # Errors
    /// No image, a damaged or an enormous one.
    #[wasm_bindgen(js_name = lookAtFile)]
    pub fn look_at_file(&self, bytes: &[u8], verify: bool) -> Result<String, JsError> {
        Ok(self.0.look_at_file(bytes, verification(verify))?)
    }

    /// Looks at the pixels of a canvas; see [`Looker::look_at_pixels`].
    ///
    /// # Errors
    /// Bytes that do not fit the size, or an enormous image.
    #[wasm_bindgen(js_name = lookAtPixels)]
    pub fn look_at_pixels(&self, rgba: &[u8], width: u32, height: u32, verify: bool) -> Result<String, JsError> {
        Ok(self.0.look_at_pixels(rgba, width, height, verification(verify))?)
    }
}

fn verification(verify: bool) -> Verification {
    if verify { Verification::ByShape } else { Verification::Off }
}
