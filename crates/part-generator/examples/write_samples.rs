//! Writes generated pictures with LabelMe marks, in the format for `sdg evaluate --pictures`.
//!
//! Usage: `cargo run --release -p sdg-part-generator --example write_samples FOLDER [PART_SEED [COUNT [CONDITION
//! [SEED]]]]`
//!
//! CONDITION is `default` or the name of one condition (`tilt`, `cover`, `dark` …). FOLDER then contains `demo.png` and
//! `demo.json`, and pictures `NNN.png` with `NNN.json` beside them: for each instance a rectangle and the points
//! `grasp_start` and `grasp_end` with a common `group_id`. Instances with a visible fraction below
//! [`MIN_VISIBLE_SHARE`] have the flag `optional`, and so have instances with a mark outside the picture, which have the
//! rectangle only; pictures without the part have an empty list of shapes.

use std::path::{Path, PathBuf};

use sdg_demonstration::{Annotation, AnnotationFormat, ImageFacts, LabelledInstance};
use sdg_part_generator::{Condition, Part, Sample, SceneConfig, Scenes};

/// Visible fraction below which an instance is optional.
const MIN_VISIBLE_SHARE: f64 = 0.5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let usage = "usage: write_samples FOLDER [PART_SEED [COUNT [CONDITION [SEED]]]]";
    let folder = PathBuf::from(arguments.first().ok_or(usage)?);
    let number = |idx: usize, default: u64| arguments.get(idx).map_or(Ok(default), |text| text.parse::<u64>());
    let (part_seed, count, seed) = (number(1, 0)?, number(2, 20)?, number(4, 1)?);
    let config = match arguments.get(3).map(String::as_str) {
        None | Some("default") => SceneConfig::default(),
        Some(name) => {
            let names = Condition::ALL.map(Condition::name).join(", ");
            let found = Condition::ALL.into_iter().find(|condition| condition.name() == name);
            SceneConfig::only(found.ok_or(format!("expected `default` or one of {names}, found `{name}`"))?)
        }
    };
    std::fs::create_dir_all(&folder)?;
    let scenes = Scenes::new(&[Part::generate(part_seed)], config, seed)?;
    let taught = &scenes.photo(0).demonstration;
    taught.image.save(folder.join("demo.png"))?;
    write_labels(
        &folder,
        "demo",
        taught.image.dimensions(),
        &[LabelledInstance::new(taught.annotation.clone(), false)],
    )?;
    for index in 0..count {
        let sample = scenes.sample(index);
        let name = format!("{index:03}");
        sample.image.save(folder.join(format!("{name}.png")))?;
        write_labels(&folder, &name, sample.image.dimensions(), &labels(&sample))?;
    }
    println!("{count} pictures in {}", folder.display());
    Ok(())
}

/// The marks of every instance in the picture, and whether it is optional.
fn labels(sample: &Sample) -> Vec<LabelledInstance> {
    let (width, height) = (f64::from(sample.image.width()), f64::from(sample.image.height()));
    let inside = |p: nalgebra::Point2<f64>| (0.0..=width).contains(&p.x) && (0.0..=height).contains(&p.y);
    sample
        .instances
        .iter()
        .filter_map(|instance| {
            let bbox = instance.bbox.clip(width, height);
            // A mark outside the picture cannot be written.
            let has_marks = inside(instance.grasp.start) && inside(instance.grasp.end);
            let marks = Annotation {
                label: "part".into(),
                bbox,
                grasp: has_marks.then_some(instance.grasp),
                jaw_width: has_marks.then_some(instance.jaw_width_px),
                outline: None,
            };
            let optional = !has_marks || instance.visible_share < MIN_VISIBLE_SHARE;
            (bbox.width() > 1.0 && bbox.height() > 1.0).then(|| LabelledInstance::new(marks, optional))
        })
        .collect()
}

fn write_labels(
    folder: &Path,
    name: &str,
    (width, height): (u32, u32),
    instances: &[LabelledInstance],
) -> Result<(), Box<dyn std::error::Error>> {
    let file_name = format!("{name}.png");
    let facts = ImageFacts { width, height, file_name: Some(&file_name) };
    let text = AnnotationFormat::LabelMe.write_labelled(&facts, instances)?.text;
    Ok(std::fs::write(folder.join(format!("{name}.json")), text)?)
}
