//! The rate of false alarms of model S on generated pictures without the part: `false_alarms [PARTS] [PICTURES]
//! [SEED]`.
//!
//! Teaches each of PARTS (100; rounded up to a multiple of 5) generated parts. Searches PICTURES (25) of 640×480
//! pixels, with other objects but no look-alikes, under each of four conditions. SEED (4041) decides the parts; nothing
//! was fitted on parts of seed 4041. The same arguments give the same output.

mod drawn;

use std::ops::ControlFlow;

use rayon::prelude::*;
use sdg_grasp::fitting::FitPart;
use sdg_grasp::{ModelKind, TeachOptions, Verification, teach};
use sdg_part_generator::Condition;

use crate::drawn::{Result, absent, draw_parts};

/// Conditions under which other objects are visible.
const CONDITIONS: [Condition; 4] = [Condition::Nominal, Condition::Clutter, Condition::Dark, Condition::Glare];
/// Parts drawn together: all of them are in memory with their pictures.
const PARTS_AT_ONCE: usize = 5;
const SIZE: [u32; 2] = [640, 480];

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| arguments.next().map_or(Ok(default), |text| text.parse::<u64>());
    let (parts, pictures, seed) = (number(100)?, number(25)?, number(4041)?);
    let kinds = CONDITIONS.map(|condition| (absent(condition), pictures));
    let mut counts = [[0u64; 2]; CONDITIONS.len()];
    for chunk in 0..parts.div_ceil(PARTS_AT_ONCE as u64) {
        let drawn = draw_parts(PARTS_AT_ONCE, SIZE, &kinds, seed.wrapping_mul(1000).wrapping_add(chunk))?;
        for part in &drawn {
            for (counts, alarms) in counts.iter_mut().zip(false_alarms(part, pictures as usize)?) {
                counts[0] += alarms;
                counts[1] += pictures;
            }
        }
        let [alarms, all] = counts.iter().fold([0, 0], |sum, counts| [sum[0] + counts[0], sum[1] + counts[1]]);
        eprintln!("{} parts: {alarms} of {all}", (chunk + 1) * PARTS_AT_ONCE as u64);
    }
    for (condition, [alarms, all]) in CONDITIONS.iter().zip(counts) {
        println!("{condition:?}: {alarms} of {all} pictures without the part have a false alarm");
    }
    Ok(())
}

/// The number of pictures with an accepted detection, for each condition.
fn false_alarms(part: &FitPart, a_condition: usize) -> Result<Vec<u64>> {
    let mut options = TeachOptions::new(1);
    options.kind = ModelKind::S;
    let taught = teach(std::slice::from_ref(&part.demonstration), &options, &mut |_| ControlFlow::Continue(()))?;
    let is_alarm = |image| -> std::result::Result<bool, String> {
        let found = taught.model.detect(image, Verification::ByShape).map_err(|error| error.to_string())?;
        Ok(found.iter().any(|detection| detection.is_accepted()))
    };
    let alarms =
        part.pictures.par_iter().map(|picture| is_alarm(&picture.image)).collect::<std::result::Result<Vec<_>, _>>()?;
    Ok(alarms.chunks(a_condition).map(|alarms| alarms.iter().filter(|alarm| **alarm).count() as u64).collect())
}
