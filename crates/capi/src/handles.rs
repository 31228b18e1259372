//! Objects identified by numbers, which are used only once per process.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use sdg_bindings::{Camera, Detections, Fault, FaultKind, Model, Result};

use crate::types::sdg_handle;

/// The object of a handle. If another thread frees the handle during a call, the call still holds the object.
#[derive(Debug, Clone)]
pub enum Object {
    Model(Arc<Model>),
    Camera(Camera),
    Detections(Arc<Detections>),
}

struct Table {
    objects: Option<HashMap<sdg_handle, Object>>,
    last: sdg_handle,
}

static TABLE: Mutex<Table> = Mutex::new(Table { objects: None, last: 0 });

fn with_table<T>(work: impl FnOnce(&mut Table) -> T) -> T {
    work(&mut TABLE.lock().unwrap_or_else(PoisonError::into_inner))
}

impl Object {
    fn name(&self) -> &'static str {
        match self {
            Self::Model(_) => "a model",
            Self::Camera(_) => "a camera",
            Self::Detections(_) => "detections",
        }
    }

    /// Stores the object and returns its handle.
    pub fn keep(self) -> sdg_handle {
        with_table(|table| {
            table.last += 1;
            table.objects.get_or_insert_default().insert(table.last, self);
            table.last
        })
    }
}

/// The object of a handle; `expected` is the kind named in the error.
fn object(handle: sdg_handle, expected: &str) -> Result<Object> {
    with_table(|table| match table.objects.as_ref().and_then(|objects| objects.get(&handle)) {
        Some(object) => Ok(object.clone()),
        None => Err(table.unknown(handle, expected)),
    })
}

impl Table {
    fn unknown(&self, handle: sdg_handle, expected: &str) -> Fault {
        let found = match handle {
            0 => "0, which is no handle".to_owned(),
            _ if handle <= self.last => format!("{handle}, which was freed"),
            _ => format!("{handle}, which never existed"),
        };
        Fault::new(FaultKind::Closed, format!("expected the handle of {expected}, found {found}"))
    }
}

fn other(object: &Object, handle: sdg_handle, expected: &str) -> Fault {
    let text = format!("expected the handle of {expected}, found {handle}, the handle of {}", object.name());
    Fault::new(FaultKind::Closed, text)
}

/// The model of a handle.
pub fn model(handle: sdg_handle) -> Result<Arc<Model>> {
    match object(handle, "a model")? {
        Object::Model(model) => Ok(model),
        found => Err(other(&found, handle, "a model")),
    }
}

/// The camera of a handle.
pub fn camera(handle: sdg_handle) -> Result<Camera> {
    match object(handle, "a camera")? {
        Object::Camera(camera) => Ok(camera),
        found => Err(other(&found, handle, "a camera")),
    }
}

/// The detections of a handle.
pub fn detections(handle: sdg_handle) -> Result<Arc<Detections>> {
    match object(handle, "detections")? {
        Object::Detections(detections) => Ok(detections),
        found => Err(other(&found, handle, "detections")),
    }
}

/// Frees the object of a handle.
pub fn free(handle: sdg_handle) -> Result<()> {
    let freed = with_table(|table| match table.objects.as_mut().and_then(|objects| objects.remove(&handle)) {
        Some(object) => Ok(object),
        None => Err(table.unknown(handle, "an object")),
    })?;
    // Dropped after the table's lock is released: freeing a model takes time.
    drop(freed);
    Ok(())
}
