//! The device on which a network computes: the backends of this build, and their devices on this machine.
//!
//! `flex`, burn's CPU backend with this project's kernels, is always available. The others are optional cargo features,
//! since each takes minutes to compile: `ndarray` (burn's older CPU backend, slow, a reference), `wgpu` (any graphics
//! card, through Vulkan, Metal or DirectX 12) and `cuda` (NVIDIA cards).

use std::fmt;
use std::str::FromStr;

use burn::tensor::Device;

use crate::error::{GraspError, Result};

/// A backend, as named by `--device`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ComputeBackend {
    /// The CPU, with this project's kernels.
    #[default]
    Flex,
    /// The CPU, with burn's older backend.
    NdArray,
    /// Graphics cards of any maker.
    Wgpu,
    /// Graphics cards of NVIDIA.
    Cuda,
}

impl ComputeBackend {
    /// All backends, the default first.
    pub const ALL: [Self; 4] = [Self::Flex, Self::NdArray, Self::Wgpu, Self::Cuda];

    /// The name on the command line, which is also the cargo feature's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flex => "flex",
            Self::NdArray => "ndarray",
            Self::Wgpu => "wgpu",
            Self::Cuda => "cuda",
        }
    }

    /// Whether the backend is compiled into this build.
    pub fn is_built(self) -> bool {
        match self {
            Self::Flex => true,
            Self::NdArray => cfg!(feature = "ndarray"),
            Self::Wgpu => cfg!(feature = "wgpu"),
            Self::Cuda => cfg!(feature = "cuda"),
        }
    }

    /// The names of the backend's devices on this machine; empty if the build lacks the backend.
    pub fn devices(self) -> Vec<String> {
        let cpu = || format!("CPU, {} threads", std::thread::available_parallelism().map_or(1, usize::from));
        match self {
            Self::Flex => vec![cpu()],
            Self::NdArray if self.is_built() => vec![cpu()],
            #[cfg(feature = "wgpu")]
            Self::Wgpu => names(burn::tensor::DeviceType::Wgpu),
            #[cfg(feature = "cuda")]
            Self::Cuda => names(burn::tensor::DeviceType::Cuda),
            _ => Vec::new(),
        }
    }

    /// The backend's default device, ready to compute.
    ///
    /// # Errors
    /// A backend that this build lacks, or that finds no device on this machine.
    pub fn open(self) -> Result<Device> {
        match self {
            Self::Flex => Ok(Device::flex()),
            #[cfg(feature = "ndarray")]
            #[allow(deprecated)]
            Self::NdArray => Ok(Device::ndarray()),
            #[cfg(all(feature = "wgpu", not(target_family = "wasm")))]
            Self::Wgpu => open_wgpu(),
            // A browser gives access to a graphics card only asynchronously.
            #[cfg(all(feature = "wgpu", target_family = "wasm"))]
            Self::Wgpu => Err(self.not_there("Device::wgpu_options().init_async(), awaited")),
            #[cfg(feature = "cuda")]
            Self::Cuda if self.devices().is_empty() => {
                Err(self.not_there("an NVIDIA graphics card with its driver (libcuda)"))
            }
            #[cfg(feature = "cuda")]
            Self::Cuda => Ok(Device::cuda(0)),
            #[allow(unreachable_patterns)]
            _ => Err(GraspError::BackendNotBuilt {
                asked: self.name(),
                built: Self::ALL.into_iter().filter(|backend| backend.is_built()).map(Self::name).collect(),
            }),
        }
    }

    #[cfg(any(feature = "wgpu", feature = "cuda"))]
    fn not_there(self, expected: impl fmt::Display) -> GraspError {
        GraspError::NoSuchDevice { backend: self.name(), found: format!("none: it needs {expected}") }
    }
}

/// The names of the devices, as reported by their runtime.
#[cfg(any(feature = "wgpu", feature = "cuda"))]
fn names(of: burn::tensor::DeviceType) -> Vec<String> {
    let devices = Device::enumerate(of).into_vec();
    let name = |device: Device| device.identity().map_or_else(|| format!("{device:?}"), |identity| identity.name);
    devices.into_iter().map(name).collect()
}

/// The device, opened once because the runtime allows only one; later calls share it.
#[cfg(all(feature = "wgpu", not(target_family = "wasm")))]
fn open_wgpu() -> Result<Device> {
    use std::sync::OnceLock;

    static OPENED: OnceLock<std::result::Result<Device, String>> = OnceLock::new();
    let needed = "a graphics driver, such as Debian's mesa-vulkan-drivers";
    let backend = ComputeBackend::Wgpu;
    OPENED
        .get_or_init(|| Device::wgpu_options().init().map_err(|error| error.to_string()))
        .clone()
        .map_err(|why| backend.not_there(format!("{needed} ({why})")))
}

impl fmt::Display for ComputeBackend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for ComputeBackend {
    type Err = GraspError;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|backend| backend.name() == text).ok_or_else(|| GraspError::UnknownBackend {
            known: Self::ALL.map(Self::name).to_vec(),
            found: text.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_others_refused() {
        for backend in ComputeBackend::ALL {
            assert_eq!(backend.to_string().parse::<ComputeBackend>().unwrap(), backend);
        }
        let refused = "gpu".parse::<ComputeBackend>().unwrap_err().to_string();
        assert_eq!(refused, "expected a device out of flex, ndarray, wgpu, cuda, found \"gpu\"");
    }

    #[test]
    fn what_was_not_built_is_named_with_what_was() {
        assert_eq!(ComputeBackend::default().open().unwrap(), Device::flex());
        for backend in ComputeBackend::ALL.into_iter().filter(|backend| !backend.is_built()) {
            assert!(backend.devices().is_empty());
            let refused = backend.open().unwrap_err().to_string();
            assert!(refused.starts_with("expected a device out of flex"), "{refused}");
            assert!(refused.contains(&format!("found \"{backend}\"")), "{refused}");
        }
    }
}
