use super::*;
use image::Rgb;
use sdg_geometry::{Angle, BoundingBox};

/// A dark plate with a bright hole.
fn plate() -> (RgbImage, Polygon) {
    let image = RgbImage::from_fn(200, 160, |x, y| {
        let on_plate = (50..150).contains(&x) && (50..110).contains(&y);
        let in_hole = (x as f32 - 125.0).hypot(y as f32 - 88.0) < 10.0;
        Rgb([if on_plate && !in_hole { 60 } else { 200 }; 3])
    });
    (image, Polygon::from_box(&BoundingBox { x1: 50.0, y1: 50.0, x2: 150.0, y2: 110.0 }))
}

#[test]
fn only_a_place_under_a_clearly_better_one_cannot_match() {
    let (image, outline) = plate();
    let search = ShapeSearch::new(&image, &outline, &SearchConfig::DEFAULT).unwrap();
    let found = |right: f64, agreement: f64| Found { pose: PlanarSimilarity::translation(right, 0.0), agreement };
    let cannot = |rough: &Found, other: Found| search.cannot_match(rough, [other].iter());
    let rough = found(0.0, 0.5);
    // Shifted by 20 of the plate's 100 pixels, then by 70.
    assert!(cannot(&rough, found(20.0, 0.7)) && !cannot(&rough, found(70.0, 0.7)));
    assert!(!cannot(&rough, found(20.0, 0.55)) && !cannot(&rough, rough));
    // A place without competitors cannot match if it would have to gain more than `MAX_GAIN` to be listed or refined.
    assert!(!search.cannot_match(&found(0.0, 0.2), [].iter()) && search.cannot_match(&found(0.0, 0.1), [].iter()));
}

#[test]
fn overlaps_are_what_counting_all_points_gives() {
    let (image, outline) = plate();
    let search = ShapeSearch::new(&image, &outline, &SearchConfig::DEFAULT).unwrap();
    let center = outline.bounds().center();
    let mut both = [0, 0];
    for (turn, right) in
        (0..12).flat_map(|turn| (0..12).map(move |right| (30.0 * f64::from(turn), 9.0 * f64::from(right))))
    {
        let to = center + Vector2::new(right, 0.4 * right);
        let pose = PlanarSimilarity::about(center, to, Angle::from_degrees(turn), 1.0);
        let share = search.surface.share_inside(&outline, &pose);
        let has = search.surface.has_inside(&outline, &pose, MAX_OVERLAP);
        assert_eq!(has, share > MAX_OVERLAP, "{turn}° and {right} px: {share}");
        both[usize::from(has)] += 1;
    }
    assert!(both[0] > 20 && both[1] > 20, "{both:?}");
}

/// A large picture is swept only where the next coarser level responds, and the same parts are found.
#[test]
fn a_screened_picture_shows_the_same_parts() {
    let (image, outline) = plate();
    let config = SearchConfig { scales: 0.9..=1.1, ..SearchConfig::DEFAULT };
    let mut search = ShapeSearch::new(&image, &outline, &config).unwrap();
    // Plates, some of them halves, among bars of another shape.
    let large = RgbImage::from_fn(2400, 1800, |x, y| {
        let (cell, [x, y]) = ([x / 200, y / 160], [x % 200, y % 160]);
        let is_bar = (60..140).contains(&x) && (70..90).contains(&y);
        match (cell[0] * 5 + cell[1] * 3) % 17 {
            0 => *image.get_pixel(x, y),
            1 if x < 100 => *image.get_pixel(x, y),
            k if k > 5 && is_bar => Rgb([60; 3]),
            _ => Rgb([200; 3]),
        }
    });
    let field = GradientField::new(&large);
    let responses = Responses::new(field.level(search.sweep_level_idx), search.bank.reach);
    let screen = search.screen.as_ref().unwrap();
    let area = screen.area(&field, &responses, config.max_starts, MIN_RESPONSE).unwrap();
    let share = area.share();
    assert!((0.02..0.6).contains(&share), "{share} of the places are swept");

    let places = |search: &ShapeSearch| {
        let found = search.search(&large).into_iter().filter(|found| found.agreement > 0.8);
        let mut places: Vec<[i64; 2]> = found
            .map(|found| found.image_from_demonstration.apply(&outline.bounds().center()))
            .map(|center| [center.x.round() as i64, center.y.round() as i64])
            .collect();
        places.sort_unstable();
        places
    };
    let screened = places(&search);
    search.screen = None;
    assert_eq!(screened, places(&search));
    assert!(screened.len() >= 6, "{screened:?}");
}
