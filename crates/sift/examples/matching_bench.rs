//! Compares brute force with a kd-tree on SIFT descriptors: the time, and how often the tree finds the same nearest
//! descriptor.
//!
//! Usage: `cargo run --release -p sdg-sift --example matching_bench -- QUERY.png TRAIN.png`

use std::num::NonZero;
use std::time::Instant;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use sdg_sift::{DESCRIPTOR_LENGTH, Features, Plane, Sift, match_features};

const REPEATS: usize = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    let [query, train] = paths.as_slice() else { return Err("expected two pictures".into()) };
    let sift = Sift::default();
    let describe = |path: &String| -> Result<Features, Box<dyn std::error::Error>> {
        Ok(sift.detect_and_describe(&Plane::from_gray(&image::open(path)?.into_luma8()), None)?)
    };
    let (query, train) = (describe(query)?, describe(train)?);
    println!("{} queries, {} candidates, {} threads", query.len(), train.len(), rayon::current_num_threads());

    // A ratio above one keeps the nearest of every query.
    let brute = best_of(|| match_features(&query, &train, 2.0));
    report("brute force, two nearest", brute.0, None);

    let build = best_of(|| ImmutableKdTree::<f32, DESCRIPTOR_LENGTH>::new_from_slice(&train.descriptors));
    report("kiddo: building", build.0, None);
    let tree = build.1.map_err(|error| format!("{error:?}"))?;
    let two = NonZero::new(2).ok_or("two")?;
    let same = |found: &[usize]| found.iter().zip(&brute.1).filter(|(j, m)| **j == m.train_idx).count();
    let exact = best_of(|| -> Vec<usize> {
        let nearest = |d| tree.query(d).nearest_n::<SquaredEuclidean<f32>>(two).execute()[0].item as usize;
        query.descriptors.iter().map(nearest).collect()
    });
    report("kiddo: two nearest, exact, one thread", exact.0, Some((same(&exact.1), query.len())));
    let approximate = best_of(|| -> Vec<usize> {
        let nearest = |d| tree.query(d).nearest_one::<SquaredEuclidean<f32>>().approx().execute().item as usize;
        query.descriptors.iter().map(nearest).collect()
    });
    report("kiddo: nearest, approximate, one thread", approximate.0, Some((same(&approximate.1), query.len())));
    Ok(())
}

fn best_of<T>(work: impl Fn() -> T) -> (f64, T) {
    let mut best = f64::MAX;
    let mut result = work();
    for _ in 0..REPEATS {
        let start = Instant::now();
        result = work();
        best = best.min(start.elapsed().as_secs_f64());
    }
    (best, result)
}

fn report(what: &str, seconds: f64, same: Option<(usize, usize)>) {
    let same = same.map_or(String::new(), |(same, of)| format!(", {same} of {of} as brute force"));
    println!("{what}: {:.2} ms{same}", 1e3 * seconds);
}
