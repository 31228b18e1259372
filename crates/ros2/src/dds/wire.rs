//! This crate's messages for `ros2-client`, which requires serde: a message is serialized as a tuple of its bytes,
//! which CDR writes unchanged.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{SeqAccess, Visitor};
use serde::ser::{Error as _, SerializeTuple};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::cdr::{self, Cdr, CdrError};
use crate::encoding::MAX_BYTES;

/// Maximum size of a message: a picture and the message's other fields.
const MAX_MESSAGE_BYTES: usize = MAX_BYTES + (1 << 16);

/// A message in transfer. An unreadable message is kept as an error, so that a service can still answer it.
#[derive(Debug, Clone)]
pub(super) struct Wire<T>(pub(super) Result<T, CdrError>);

impl<T: Cdr> ros2_client::Message for Wire<T> {}

impl<T: Cdr> Serialize for Wire<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let message = self.0.as_ref().map_err(S::Error::custom)?;
        let bytes = cdr::to_bytes(message);
        let mut tuple = serializer.serialize_tuple(bytes.len())?;
        bytes.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

impl<'de, T: Cdr> Deserialize<'de> for Wire<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_tuple(usize::MAX, AllBytes(PhantomData))
    }
}

struct AllBytes<T>(PhantomData<T>);

impl<'de, T: Cdr> Visitor<'de> for AllBytes<T> {
    type Value = Wire<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the bytes of a message")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut bytes: A) -> Result<Wire<T>, A::Error> {
        let mut all = Vec::new();
        // The message ends at the first missing byte.
        while let Ok(Some(byte)) = bytes.next_element::<u8>() {
            all.push(byte);
            if all.len() > MAX_MESSAGE_BYTES {
                let expected = format!("a message of at most {} MiB", MAX_BYTES >> 20);
                return Ok(Wire(Err(CdrError { expected, at: 0, length: all.len(), found: "more".to_owned() })));
            }
        }
        Ok(Wire(cdr::from_bytes(&all)))
    }
}
