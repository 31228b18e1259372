//! The known arms, one file for each.

mod fr3;
mod franka_hand;
mod panda;

pub use franka_hand::{FINGER_HALF_WIDTH_M, HAND_OPENING_MAX_M, TCP_OFFSET_M, finger_thickness_m};
