//! Errors of obstacles.

/// Errors of building a collision model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CollisionError {
    /// A length is not a positive, finite number.
    #[error("{obstacle}: {what} must be {expected}, found {found}")]
    Size {
        /// Which obstacle.
        obstacle: String,
        /// Which of its lengths.
        what: &'static str,
        /// The accepted values.
        expected: &'static str,
        /// The given value, m.
        found: f64,
    },
    /// A pose holds NaN or an infinity, or its quaternion is not of unit length.
    #[error("{obstacle}: {reason}")]
    Pose {
        /// Which obstacle.
        obstacle: String,
        /// The error of its pose.
        reason: String,
    },
    /// Two obstacles with one name, which a message could not distinguish.
    #[error("two obstacles are named \"{name}\"")]
    NameTwice {
        /// The name that is given twice.
        name: String,
    },
    /// A pair that may touch names an obstacle that does not exist.
    #[error("no obstacle is named \"{name}\"; there are: {existing}")]
    UnknownObstacle {
        /// The name that was given.
        name: String,
        /// The names that exist.
        existing: String,
    },
}
