//! Proposed outlines beside drawn ones: overlap and time for each demonstration.
//!
//! ```sh
//! cargo run --release -p sdg-demonstration --example outlines -- datasets/demonstrations/*/
//! ```

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use sdg_demonstration::{Demonstration, propose_outline};
use sdg_geometry::BoundingBox;

fn main() -> Result<(), Box<dyn Error>> {
    for folder in std::env::args().skip(1) {
        let folder = Path::new(&folder);
        let read = |name: &str| std::fs::read(folder.join(name));
        let demonstration = Demonstration::decode(&read("image.png")?, &read("annotation.json")?, None)?;
        let (width, height) = demonstration.image.dimensions();
        let drawn = demonstration.annotation.require_outline()?.rasterize(width, height);
        print!("{:44}", folder.display());
        // As drawn, and as loosely as people draw boxes.
        for looseness in [0.0, 0.05, 0.1, 0.2] {
            let b = demonstration.annotation.bbox;
            let (dx, dy) = (looseness * b.width(), looseness * b.height());
            let bbox = BoundingBox { x1: b.x1 - dx, y1: b.y1 - dy, x2: b.x2 + dx, y2: b.y2 + dy };
            let start = Instant::now();
            let proposed = propose_outline(&demonstration.image, &bbox);
            let millis = start.elapsed().as_secs_f64() * 1e3;
            let overlap = proposed.rasterize(width, height).iou(&drawn);
            print!("  {overlap:.3} ({} vertices, {millis:.0} ms)", proposed.vertices.len());
        }
        println!();
    }
    Ok(())
}
