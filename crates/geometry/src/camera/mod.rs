//! Cameras: from a pixel to a point on a plane above the table, and back.
//!
//! ```text
//! pixel ─ PinholeCamera: distortion removed ─ point at depth 1 ─ PosedCamera ─ Ray ─ point on the plane ─ PlanView ─ its pixel
//! ```

mod lens;
mod pinhole;
mod plan_view;
mod posed;

pub use self::lens::PlumbBob;
pub use self::pinhole::PinholeCamera;
pub use self::plan_view::{PlanView, PlanViewError, Workspace};
pub use self::posed::{PosedCamera, Ray};
