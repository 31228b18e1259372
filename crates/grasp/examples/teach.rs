//! Teaches from a photo and its annotation with the library alone, without the program `sdg`: `teach IMAGE ANNOTATION
//! OUT`.

use std::ops::ControlFlow;

use sdg_demonstration::{Annotation, Demonstration, ImageFacts, ImageLimits, decode_image};
use sdg_grasp::{TeachOptions, TeachingEvent, teach};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, image_path, annotation_path, out] = &arguments[..] else {
        return Err("usage: teach IMAGE ANNOTATION OUT".into());
    };
    let image = decode_image(&std::fs::read(image_path)?, &ImageLimits::default())?;
    let facts = ImageFacts { width: image.width(), height: image.height(), file_name: None };
    let annotation = Annotation::read(&std::fs::read(annotation_path)?, &facts)?.remove(0);
    let demonstration = Demonstration { image, annotation };

    let taught = teach(&[demonstration], &TeachOptions::new(1), &mut |event| {
        match event {
            TeachingEvent::Step { record, elapsed_secs, .. } if record.step % 10 == 0 => {
                println!("{:4} {elapsed_secs:6.1} s  {:?}", record.step, record.losses);
            }
            TeachingEvent::Validated(record) => println!("{record:?}"),
            TeachingEvent::Step { .. } | TeachingEvent::OrientationStep { .. } => {}
        }
        ControlFlow::Continue(())
    })?;
    println!("{:?}", taught.model.facts());
    std::fs::write(out, taught.model.to_bytes()?)?;
    Ok(())
}
