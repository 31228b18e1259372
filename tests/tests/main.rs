//! One test binary for all files of this folder, because each binary links the whole crate.
#![allow(clippy::unwrap_used)]

mod calibrated_camera;
mod every_part_without_network;
mod network_learns;
mod one_photo_to_grasp;
mod plan_beside_a_place;
mod plan_of_a_raised_part;
mod tracking;
