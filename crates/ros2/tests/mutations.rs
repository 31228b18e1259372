//! Messages that were changed on the way: a hundred thousand of them, none of which may panic.
#![allow(clippy::unwrap_used)]

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_geometry::PinholeCamera;
use sdg_ros2::messages::*;
use sdg_ros2::{Transforms, camera_info, cdr, encoding, found};

const NUM_MUTATED: usize = 100_000;

/// Reads bytes as every message that the node takes, and uses what comes out.
fn read_all(bytes: &[u8], transforms: &mut Transforms) -> usize {
    let mut num_read = 0;
    if let Ok(image) = cdr::from_bytes::<Image>(bytes) {
        num_read += usize::from(encoding::read_image(&image).is_ok());
    }
    if let Ok(image) = cdr::from_bytes::<CompressedImage>(bytes) {
        num_read += usize::from(encoding::read_compressed(&image).is_ok());
    }
    if let Ok(info) = cdr::from_bytes::<CameraInfo>(bytes) {
        num_read += usize::from(camera_info::read_camera_info(&info).is_ok());
    }
    for is_static in [false, true] {
        if let Ok(message) = cdr::from_bytes::<TfMessage>(bytes) {
            num_read += 1;
            transforms.add(&message, is_static);
            let _ = transforms.lookup("base", "camera", Time { sec: 12, nanosec: 0 });
        }
    }
    num_read += usize::from(cdr::from_bytes::<JointState>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<Detection2DArray>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<DiagnosticArray>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<FollowJointTrajectoryFeedback>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<AfterStatus<FollowJointTrajectoryResult>>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<FollowJointTrajectoryGoal>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<AfterStatus<GripperCommandResult>>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<DetectRequest>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<TeachRequest>(bytes).is_ok());
    num_read += usize::from(cdr::from_bytes::<GraspRequest>(bytes).is_ok());
    num_read
}

fn seeds() -> Vec<Vec<u8>> {
    let header = Header { stamp: Time { sec: 12, nanosec: 34 }, frame_id: "camera".into() };
    let picture = image::RgbImage::from_fn(12, 9, |x, y| image::Rgb([(x * 20) as u8, (y * 25) as u8, 7]));
    let pose = nalgebra::Isometry3::translation(0.1, 0.2, 0.3);
    let transform = |parent: &str, child: &str| {
        let header = Header { frame_id: parent.into(), ..header.clone() };
        found::to_transform(&header, child, &pose)
    };
    let part = found::FoundPart {
        name: "rod".into(),
        score: 0.9,
        corners: [nalgebra::Point2::new(1.0, 2.0), nalgebra::Point2::new(5.0, 6.0)],
        grasp: Some((pose, 0.02)),
    };
    let names = || vec!["a".to_owned(), "b".to_owned()];
    let point = JointTrajectoryPoint { positions: vec![0.1, 0.2], ..JointTrajectoryPoint::default() };
    let trajectory = JointTrajectory { joint_names: names(), points: vec![point.clone(), point], ..Default::default() };
    let goal = FollowJointTrajectoryGoal { trajectory, ..Default::default() };
    let diagnostic = DiagnosticStatus { name: "sdg".into(), values: vec![KeyValue::default()], ..Default::default() };
    vec![
        cdr::to_bytes(&encoding::to_image(&picture, header.clone())),
        cdr::to_bytes(&encoding::to_compressed(&picture, header.clone()).unwrap()),
        cdr::to_bytes(&camera_info::to_camera_info(&PinholeCamera::WRIST, header.clone())),
        cdr::to_bytes(&TfMessage { transforms: vec![transform("base", "hand"), transform("hand", "camera")] }),
        cdr::to_bytes(&JointState { name: names(), position: vec![0.0; 2], ..JointState::default() }),
        cdr::to_bytes(&found::to_detections(&header, &[part.clone(), part])),
        cdr::to_bytes(&DiagnosticArray { header, status: vec![diagnostic] }),
        cdr::to_bytes(&goal),
        cdr::to_bytes(&FollowJointTrajectoryFeedback::default()),
        cdr::to_bytes(&AfterStatus(FollowJointTrajectoryResult::default())),
        cdr::to_bytes(&TeachRequest { photo_path: "a.png".into(), ..TeachRequest::default() }),
        cdr::to_bytes(&DetectRequest::default()),
    ]
}

fn mutate(bytes: &mut Vec<u8>, random: &mut Pcg64Mcg) {
    for _ in 0..random.random_range(1..=4) {
        let length = bytes.len();
        if length < 8 {
            bytes.extend([0; 16]);
            continue;
        }
        let at = random.random_range(0..length);
        match random.random_range(0..6) {
            0 => bytes[at] ^= 1 << random.random_range(0..8),
            1 => bytes[at] = random.random(),
            2 => bytes.truncate(at),
            3 => bytes.insert(at, random.random()),
            // A length, a count or half a number.
            4 => {
                let value: u32 = [0, 1, 0x7fff_ffff, 0xffff_ffff, random.random()][random.random_range(0..5)];
                let at = at.min(length - 4) & !3;
                bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
            }
            _ => {
                let end = (at + random.random_range(1..64)).min(length);
                bytes.drain(at..end);
            }
        }
    }
}

#[test]
fn a_hundred_thousand_mutated_messages_are_read_or_refused() {
    let seeds = seeds();
    let mut random = Pcg64Mcg::seed_from_u64(22);
    let mut transforms = Transforms::new(0.5);
    let whole: usize = seeds.iter().map(|bytes| read_all(bytes, &mut transforms)).sum();
    assert!(whole >= seeds.len(), "{whole}");
    let mut num_read = 0;
    for round in 0..NUM_MUTATED {
        let mut bytes = seeds[round % seeds.len()].clone();
        mutate(&mut bytes, &mut random);
        num_read += usize::from(read_all(&bytes, &mut transforms) > 0);
    }
    // Some still are messages, and some are not: otherwise nothing was tested.
    assert!((1..NUM_MUTATED).contains(&num_read), "{num_read}");
    println!("{num_read} of {NUM_MUTATED} mutated messages were still read as some message");
}
