//! Notices that a thread of the network ended by a panic. RustDDS does not report it: afterwards no message arrives or
//! leaves, and no call fails.

use std::panic::PanicHookInfo;
use std::sync::{Once, OnceLock};
use std::thread::JoinHandle;

use super::failure::network;
use crate::error::RosError;

/// First letters of the names of this program's threads that receive messages.
const OURS: &str = "ros2 ";
/// First letters of the names of RustDDS's threads.
const THEIRS: &str = "RustDDS";

static FIRST: OnceLock<String> = OnceLock::new();

/// Records the first panic of a thread of the network from now on, in addition to the present panic hook. For a program
/// that ends with [`network_panic`].
pub fn watch_network_threads() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            note(panic);
            before(panic);
        }));
    });
}

fn note(panic: &PanicHookInfo<'_>) {
    let thread = std::thread::current();
    if let Some(name) = thread.name().filter(|name| name.starts_with(OURS) || name.starts_with(THEIRS)) {
        let place = panic.location().map(ToString::to_string).unwrap_or_default();
        let _ = FIRST.set(format!(
            "the thread \"{name}\" ended by a panic at {place}, so no messages are received; start the program again"
        ));
    }
}

/// Starts a thread that receives messages, whose panics are recorded.
///
/// # Errors
/// [`RosError::Network`] if there can be no more threads.
pub fn network_thread(receives: &str, run: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>, RosError> {
    let name = format!("{OURS}{receives}");
    std::thread::Builder::new().name(name).spawn(run).map_err(|error| network(receives, error))
}

/// The first recorded panic.
pub fn network_panic() -> Option<RosError> {
    FIRST.get().map(|why| network("ROS 2", why))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_panics_of_the_network_count() {
        watch_network_threads();
        let panics = |name: &str| {
            let thread = std::thread::Builder::new().name(name.to_owned()).spawn(|| panic!("a test's panic")).unwrap();
            thread.join().unwrap_err();
            network_panic().map(|error| error.to_string())
        };
        assert_eq!(panics("grasp"), None);
        let told = panics("RustDDS Participant 0 event loop").unwrap();
        assert!(told.contains("RustDDS Participant 0") && told.contains("panics.rs"), "{told}");
    }
}
