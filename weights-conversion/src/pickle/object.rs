//! The data of the pickle machine: values, and an arena of objects.

use crate::element::ElementType;
use crate::error::Result;
use crate::error::WeightsError;
use crate::source::Span;
use crate::tensor::{Encoding, Payload, StoredTensor};

use super::global::Global;

/// A value on the stack or in an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Value {
    None,
    Bool(bool),
    Int(i64),
    /// A real number, or an integer beyond 64 bits: no weight depends on one.
    OtherNumber,
    Global(Global),
    /// An object of the arena.
    Object(u32),
}

/// A numpy element type; the byte order comes with its state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Dtype {
    pub element: ElementType,
    pub big_endian: bool,
}

/// A torch storage, by reference: its bytes are elsewhere.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StorageRef {
    pub key: Box<str>,
    pub element: ElementType,
    pub num_elements: u64,
}

/// A torch tensor, before its storage is found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TensorRef {
    pub storage: StorageRef,
    pub first_element: u64,
    pub shape: Vec<usize>,
    pub strides: Vec<usize>,
}

/// Text, or a Python 2 string, which may be text or bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Text {
    pub span: Span,
    /// The encoding of its bytes, if it represents bytes.
    pub encoding: Encoding,
    /// The text itself, if it is short enough for a name.
    pub short: Option<Box<str>>,
}

/// An object of the arena.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Object {
    Text(Box<Text>),
    Bytes(Payload),
    /// Tuple, list or set.
    Sequence(Vec<Value>),
    Dict(Vec<(Value, Value)>),
    Dtype(Dtype),
    /// A numpy array; empty until its state is set.
    Array(Option<Box<StoredTensor>>),
    Storage(Box<StorageRef>),
    Tensor(Box<TensorRef>),
    /// A numpy scalar; no weight depends on one.
    Other,
}

/// All objects of a pickle; they refer to each other by index.
#[derive(Debug, Default)]
pub(crate) struct Arena {
    objects: Vec<Object>,
}

impl Arena {
    /// Adds an object. The machine's limit of operations keeps the count far below `u32::MAX`.
    pub fn add(&mut self, object: Object) -> Value {
        self.objects.push(object);
        Value::Object((self.objects.len() - 1) as u32)
    }

    /// All objects, in the order in which they were made.
    pub fn objects(&self) -> impl Iterator<Item = &Object> {
        self.objects.iter()
    }

    /// The object of a value.
    pub fn object(&self, value: Value) -> Option<&Object> {
        match value {
            Value::Object(idx) => self.objects.get(idx as usize),
            _ => None,
        }
    }

    /// The object of a value, mutable.
    pub fn object_mut(&mut self, value: Value) -> Option<&mut Object> {
        match value {
            Value::Object(idx) => self.objects.get_mut(idx as usize),
            _ => None,
        }
    }

    /// A short text.
    pub fn text(&self, value: Value) -> Option<&str> {
        match self.object(value)? {
            Object::Text(text) => text.short.as_deref(),
            _ => None,
        }
    }

    /// Bytes, or a Python 2 string that represents bytes.
    pub fn bytes(&self, value: Value) -> Option<Payload> {
        match self.object(value)? {
            Object::Bytes(payload) => Some(*payload),
            Object::Text(text) => Some(Payload { span: text.span, encoding: text.encoding }),
            _ => None,
        }
    }

    /// The items of a tuple or list.
    pub fn sequence(&self, value: Value) -> Option<&[Value]> {
        match self.object(value)? {
            Object::Sequence(items) => Some(items),
            _ => None,
        }
    }

    /// A dict's entries.
    pub fn dict(&self, value: Value) -> Option<&[(Value, Value)]> {
        match self.object(value)? {
            Object::Dict(entries) => Some(entries),
            _ => None,
        }
    }

    /// The last entry with this key, as in Python.
    pub fn entry(&self, dict: Value, key: &str) -> Option<Value> {
        let entries = self.dict(dict)?;
        entries.iter().rev().find(|(found, _)| self.text(*found) == Some(key)).map(|(_, value)| *value)
    }

    /// A tuple of sizes or strides.
    ///
    /// # Errors
    /// Anything else, a negative number, or more axes than any layer has.
    pub fn sizes(&self, value: Value, at: u64) -> Result<Vec<usize>> {
        const MAX_AXES: usize = 8;
        let damaged = |found: String| {
            WeightsError::damaged(format!("byte {at}"), format!("a tuple of at most {MAX_AXES} sizes"), found)
        };
        let items = self.sequence(value).ok_or_else(|| damaged(self.describe(value).to_owned()))?;
        if items.len() > MAX_AXES {
            return Err(damaged(format!("{} items", items.len())));
        }
        let size = |item: &Value| match *item {
            Value::Int(size) => usize::try_from(size).map_err(|_| damaged(size.to_string())),
            other => Err(damaged(self.describe(other).to_owned())),
        };
        items.iter().map(size).collect()
    }

    /// The kind of a value, for an error.
    pub fn describe(&self, value: Value) -> &'static str {
        match value {
            Value::None => "None",
            Value::Bool(_) => "a bool",
            Value::Int(_) | Value::OtherNumber => "a number",
            Value::Global(_) => "a class",
            Value::Object(_) => match self.object(value) {
                Some(Object::Text(_)) => "text",
                Some(Object::Bytes(_)) => "bytes",
                Some(Object::Sequence(_)) => "a tuple or list",
                Some(Object::Dict(_)) => "a dict",
                Some(Object::Dtype(_)) => "an element type",
                Some(Object::Array(_) | Object::Tensor(_)) => "a tensor",
                Some(Object::Storage(_)) => "a storage",
                Some(Object::Other) | None => "something else",
            },
        }
    }
}

/// The result of a pickle.
#[derive(Debug)]
pub(crate) struct Pickle {
    pub arena: Arena,
    pub root: Value,
    /// The end of the pickle in the file.
    pub end: u64,
}
