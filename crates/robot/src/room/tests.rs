use super::*;
use crate::place::{Place, PlaceKind};
use nalgebra::Point2;
use sdg_geometry::Angle;
use sdg_kinematics::ArmGeometry;

/// Opening of the fingers beyond the part for releasing it, m.
const MARGIN_M: f64 = 0.020;

fn tray(pitch_mm: [f64; 2], yaw_rad: f64) -> Place {
    let kind = PlaceKind::Tray { cells: [4, 5], pitch_m: pitch_mm.map(|pitch| pitch * 1e-3) };
    Place { name: "tray".to_owned(), at_m: [0.32, -0.4], yaw_rad, surface_m: 0.0, kind }
}

/// A disc of a bearing's size.
fn disc(diameter_m: f64) -> PartShape {
    let corner = |index: u32| {
        let (sin, cos) = (TAU * f64::from(index) / 180.0).sin_cos();
        Point2::new(0.5 * diameter_m * cos, 0.5 * diameter_m * sin)
    };
    PartShape::new((0..180).map(corner), diameter_m, 0.015, 0.008).unwrap()
}

fn bar() -> PartShape {
    let corners = [[-0.045, -0.01], [0.045, -0.01], [0.045, 0.01], [-0.045, 0.01]].map(Point2::from);
    PartShape::new(corners, 0.020, 0.014, 0.007).unwrap()
}

fn check(pitch_mm: [f64; 2], part: &PartShape, symmetry: RotationalSymmetry) -> Result<()> {
    // A cell with neighbours on all sides, in a rotated tray: the tray's own axes count.
    tray(pitch_mm, 0.7).goal(6).unwrap().check_room(part, symmetry, MARGIN_M, &ArmGeometry::panda().hand)
}

#[test]
fn all_angles_of_a_symmetry_are_equivalent() {
    for count in 2..=360 {
        let (symmetry, turns_rad) = (RotationalSymmetry::Fold(count), same_turns_rad(RotationalSymmetry::Fold(count)));
        assert_eq!(turns_rad.len(), count.min(36) as usize, "{count}");
        for (turn, &turn_rad) in turns_rad.iter().enumerate() {
            let visible_rad = symmetry.visible(Angle::from_radians(turn_rad)).radians();
            assert!(visible_rad.abs() < 1e-9, "{count}: {turn_rad} looks rotated by {visible_rad}");
            // The angles are different, and spread over the whole circle.
            let even_rad = TAU * turn as f64 / turns_rad.len() as f64;
            assert!((turn_rad - even_rad).abs() < TAU / f64::from(count), "{count}: {turn_rad}, near {even_rad}");
        }
        assert!(turns_rad.is_sorted_by(|one, next| one < next), "{count}: {turns_rad:?}");
    }
}

#[test]
fn across_the_marked_line_fingers_need_room_for_themselves() {
    // Half of 20 mm, 10 mm of opening, 15 mm of finger, 2 mm of room, and half of the next part: 47 mm.
    check([100.0, 47.0], &bar(), RotationalSymmetry::None).unwrap();
    let found = check([100.0, 46.0], &bar(), RotationalSymmetry::None).unwrap_err().to_string();
    let expected = "\"tray, cell 6\": expected a pitch of 100 x 47 mm, found 100 x 46 mm: the part is 20 mm wide \
                    between the fingers; the fingers are 15 mm thick and, open to 40 mm to release it, come within \
                    1.0 mm of a part in a neighbouring cell; at least 2 mm are required";
    assert_eq!(found, expected);
}

#[test]
fn parts_themselves_need_room() {
    check([94.0, 60.0], &bar(), RotationalSymmetry::None).unwrap();
    let found = check([93.0, 60.0], &bar(), RotationalSymmetry::None).unwrap_err().to_string();
    assert!(found.contains("expected a pitch of 94 x 60 mm, found 93 x 60 mm"), "{found}");
    assert!(found.contains("parts in neighbouring cells are 3.0 mm apart, at least 4 mm are required"), "{found}");
    // Too narrow along both axes.
    let found = check([80.0, 15.0], &bar(), RotationalSymmetry::None).unwrap_err().to_string();
    assert!(found.contains("expected a pitch of 94 x 47 mm, found 80 x 15 mm"), "{found}");
    assert!(found.contains("overlap by 10.0 mm"), "{found}");
}

#[test]
fn a_round_part_is_let_go_where_there_is_room() {
    // Rows 60 mm apart are too close together for fingers between them, columns 100 mm apart are not.
    let narrow = [100.0, 60.0];
    let found = check(narrow, &disc(0.052), RotationalSymmetry::None).unwrap_err().to_string();
    assert!(found.contains("expected a pitch of 100 x 79 mm"), "{found}");
    check(narrow, &disc(0.052), RotationalSymmetry::Full).unwrap();
    check(narrow, &disc(0.052), RotationalSymmetry::Fold(4)).unwrap();
    let goal = tray(narrow, 0.0).goal(6).unwrap();
    let turns = vec![0.0, 0.25 * TAU, 0.5 * TAU, 0.75 * TAU];
    // The fingers must lie along the rows, not across them.
    let kept = goal.with_room_for_fingers(&disc(0.052), 0.072, turns, |&turn_rad| goal.base_from_part(0.0, turn_rad));
    assert_eq!(kept, [0.25 * TAU, 0.75 * TAU]);
    // 60 mm along both axes: only the diagonals have room.
    check([60.0, 60.0], &disc(0.052), RotationalSymmetry::Full).unwrap();
    assert!(check([60.0, 60.0], &disc(0.052), RotationalSymmetry::Fold(4)).is_err());
}

#[test]
fn bearings_of_52_mm_in_rows_of_55_mm_are_refused() {
    let found = check([100.0, 55.0], &disc(0.052), RotationalSymmetry::Full).unwrap_err().to_string();
    assert!(found.contains("expected a pitch of 100 x 56 mm, found 100 x 55 mm"), "{found}");
    assert!(found.contains("parts in neighbouring cells are 3.0 mm apart"), "{found}");
}

#[test]
fn a_tall_part_meets_the_thicker_root_of_the_fingers() {
    let tall = PartShape::new(bar().outline().to_vec(), 0.020, 0.040, 0.020).unwrap();
    check([100.0, 60.0], &tall, RotationalSymmetry::None).unwrap();
    let found = check([100.0, 55.0], &tall, RotationalSymmetry::None).unwrap_err().to_string();
    assert!(found.contains("26 mm thick"), "{found}");
}

#[test]
fn alone_there_is_always_room() {
    let single = Place { kind: PlaceKind::Pose, ..tray([1.0, 1.0], 0.0) };
    single
        .goal(1)
        .unwrap()
        .check_room(&disc(0.07), RotationalSymmetry::None, MARGIN_M, &ArmGeometry::panda().hand)
        .unwrap();
    // A single row has no neighbours across.
    let kind = PlaceKind::Tray { cells: [3, 1], pitch_m: [0.1, 0.01] };
    Place { kind, ..single }
        .goal(2)
        .unwrap()
        .check_room(&bar(), RotationalSymmetry::None, MARGIN_M, &ArmGeometry::panda().hand)
        .unwrap();
}

#[test]
fn gaps_of_polygons() {
    let square = |x: f64, y: f64| Polygon {
        vertices: [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]].map(Point2::from).to_vec(),
    };
    let gap = |x: f64, y: f64| gap_m(&square(0.0, 0.0), &square(x, y));
    assert!((gap(3.0, 0.5) - 2.0).abs() < 1e-12);
    // Distance from corner to corner.
    assert!((gap(4.0, 5.0) - 5.0).abs() < 1e-12);
    assert!((gap(0.75, 0.5) + 0.25).abs() < 1e-12);
}
