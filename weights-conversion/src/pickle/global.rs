//! The globals that a pickle of weights may use.

use crate::element::ElementType;

/// A function or class that the machine emulates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Global {
    /// Makes an empty numpy array, which a state then fills.
    Reconstruct,
    /// Makes a numpy array around a buffer (protocol 5).
    FromBuffer,
    /// Makes a numpy scalar, which is not a weight.
    Scalar,
    /// The class of numpy arrays.
    NdArray,
    /// Makes a numpy element type.
    Dtype,
    /// Converts text to bytes; protocol 2 stores bytes in this way.
    CodecsEncode,
    /// Makes empty bytes (protocol 2).
    Bytes,
    /// Makes a dict.
    OrderedDict,
    /// Makes a torch tensor: storage, offset, size, stride, and training data.
    RebuildTensor,
    /// Wraps a torch tensor.
    RebuildParameter,
    /// The class of a torch storage.
    Storage(ElementType),
}

impl Global {
    /// The global with this name, if weights need it.
    pub fn resolve(module: &str, name: &str) -> Option<Self> {
        Some(match (module, name) {
            ("numpy.core.multiarray" | "numpy._core.multiarray", "_reconstruct") => Self::Reconstruct,
            ("numpy.core.multiarray" | "numpy._core.multiarray", "scalar") => Self::Scalar,
            ("numpy.core.numeric" | "numpy._core.numeric", "_frombuffer") => Self::FromBuffer,
            ("numpy", "ndarray") => Self::NdArray,
            ("numpy", "dtype") => Self::Dtype,
            ("_codecs", "encode") => Self::CodecsEncode,
            ("__builtin__" | "builtins", "bytes") => Self::Bytes,
            ("collections", "OrderedDict") => Self::OrderedDict,
            ("torch._utils", "_rebuild_tensor" | "_rebuild_tensor_v2") => Self::RebuildTensor,
            ("torch._utils", "_rebuild_parameter") => Self::RebuildParameter,
            ("torch", class) => Self::Storage(ElementType::from_torch_storage(class)?),
            _ => return None,
        })
    }
}
