//! A pickle reader that can build weights and nothing else.
//!
//! Python's pickle is a program for a stack machine, and a forged one may call any function. This machine supports
//! the opcodes of protocols 2 to 5 and [a dozen globals](global::Global), which it emulates; any other global ends
//! the reading with an error that names it. Large strings are not read; only their positions in the file are
//! stored.
//!
//! Objects live in one arena and refer to each other by index: an object may contain itself, and no function
//! here is recursive. The number of operations is limited, and therefore also the memory.

pub(crate) mod construct;
pub(crate) mod global;
mod machine;
pub(crate) mod object;

pub(crate) use machine::load;
pub(crate) use object::{Object, Pickle, StorageRef, Value};
