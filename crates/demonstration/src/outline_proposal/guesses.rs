//! Several guesses of the part, each cut, and the choice of the cut that a person meant with the box.
//!
//! The constants of the choice, except [`MIN_SHADOW`], were fitted on 30 pictures of generated parts (seeds from 2^51,
//! boxes as drawn and looser by a twelfth), the shipped demonstrations, and the five photographs of
//! docs/comparison-with-tools.md; not on the generated pictures of the tests.

use super::color_mixture::ColorMixture;
use super::frame::Frame;
use super::lab::Lab;
use super::pieces::pieces;

/// Minimum fraction of the box that remains without shadows; below it the part itself has a shadow's colour. A thin
/// tube fills about a twentieth of its box.
const MIN_UNSHADED_SHARE: f64 = 0.02;
/// Largest distance of a person's box from the part, as a fraction of the box's side, on each side.
const MAX_GAP: f64 = 0.1;
/// Factor of the largest distance beyond [`MAX_GAP`] in the cost; the distance is a fraction of the box's side.
const GAP_COST: f64 = 2.0;
/// Bonus of the guess without shadows. Without it, a cut with a shadow could have the highest score, because a shadow's
/// border is an edge, too, and reaches the box.
const UNSHADED_BONUS: f64 = 0.15;
/// Another cut also gets [`UNSHADED_BONUS`] if it leaves out a shadow that the cut of the guess without shadows
/// includes, and this shadow is more than this fraction of that cut: colours learnt from a cut often include a hard
/// shadow. Fitted on 367 proposals, of wing bolt, drill screw and the tuned rendered sets of datasets/split.toml, and
/// of generated parts (seeds from 2^51): with 0.08, 0.1, 0.12 and 0.15 the overlap of 10, 8, 8 and 5 proposals is
/// better by 0.02 or more than without this rule, and the overlap of none is worse by that much. The overlap on the
/// wing bolt's photos is 0.69, 0.69, 0.69 and 0.65; without this rule it is 0.58.
const MIN_SHADOW: f64 = 0.1;
/// Bonus of a cut that uses the colours of the whole photo: it decides between cuts that follow edges about equally
/// well. With 0, 0.05 and 0.1 the shipped pneumatic cylinder's overlap was 0.846, 0.871, 0.871.
const ELSEWHERE_BONUS: f64 = 0.05;
/// Minimum score of a cut, bonuses included, for a part: noise can be cut, too.
const MIN_SCORE: f64 = 0.2;

/// The most likely part, cut; `None` if nothing stands out.
pub(crate) fn likeliest_cut(frame: &Frame, rounds: usize) -> Option<Vec<bool>> {
    let free = vec![None; frame.colors.len()];
    let surroundings = frame.surroundings();
    let mut cuts = Vec::new();
    for Guess { division, is_unshaded, elsewhere } in guesses(frame, surroundings.as_ref()) {
        let cut = frame.cut(division, elsewhere, &free, rounds);
        let Some((score, part)) = cut.and_then(|cut| score(frame, &cut)) else { continue };
        let score = score + if elsewhere.is_empty() { 0.0 } else { ELSEWHERE_BONUS };
        let [table, shadow] = surroundings.as_ref().map_or([0.0; 2], |around| table_shares(frame, around, &part));
        cuts.push(Cut { score, is_unshaded, table, shadow, part });
    }
    let unshaded = cuts.iter().filter(|cut| cut.is_unshaded).max_by(|a, b| a.score.total_cmp(&b.score));
    let total = |cut: &Cut| {
        let is_without = cut.is_unshaded || unshaded.is_some_and(|unshaded| cut.leaves_shadow_of(unshaded));
        cut.score + if is_without { UNSHADED_BONUS } else { 0.0 }
    };
    let totals: Vec<f64> = cuts.iter().map(total).collect();
    let likeliest = totals.into_iter().zip(cuts).filter(|(total, _)| *total > MIN_SCORE);
    // Of cuts with equal scores, the first.
    likeliest.reduce(|best, other| if other.0 > best.0 { other } else { best }).map(|(_, cut)| cut.part)
}

/// An initial division of the frame.
struct Guess<'a> {
    division: Vec<bool>,
    /// Whether colours of the surroundings in shadow are excluded.
    is_unshaded: bool,
    /// Additional colours of the surroundings.
    elsewhere: &'a [Lab],
}

/// A cut from one guess.
struct Cut {
    score: f64,
    is_unshaded: bool,
    /// Fractions of its pixels with colours of the surroundings, lit and in shadow.
    table: f64,
    shadow: f64,
    part: Vec<bool>,
}

impl Cut {
    /// Whether a shadow in the other cut is left out in this one. A dark part has a shadow's colours in all cuts: only
    /// the fraction that this cut leaves out counts.
    fn leaves_shadow_of(&self, other: &Self) -> bool {
        other.shadow.min(other.table + other.shadow - self.table - self.shadow) > MIN_SHADOW
    }
}

/// Initial divisions of the frame, with and without the colours of the whole photo as surroundings. These colours
/// identify a shadow, but if another object resembles the part, they would assign the part to the surroundings.
fn guesses<'a>(frame: &'a Frame, surroundings: Option<&ColorMixture>) -> Vec<Guess<'a>> {
    let among = |is_part: &dyn Fn(&Lab) -> bool| -> Vec<bool> {
        frame.colors.iter().zip(&frame.candidates).map(|(color, &candidate)| candidate && is_part(color)).collect()
    };
    let count = |marks: &[bool]| marks.iter().filter(|&&mark| mark).count() as f64;
    let of = |division| Guess { division, is_unshaded: false, elsewhere: &[] };
    let mut guesses = Vec::new();
    if let Some(surroundings) = surroundings {
        let unshaded = among(&|color| !surroundings.explains(color) && !surroundings.explains_shaded(color));
        if count(&unshaded) >= MIN_UNSHADED_SHARE * count(&frame.candidates) {
            guesses.push(Guess { division: unshaded.clone(), is_unshaded: true, elsewhere: &frame.elsewhere });
            guesses.push(Guess { division: unshaded, is_unshaded: true, elsewhere: &[] });
        }
        guesses.push(of(among(&|color| !surroundings.explains(color))));
    }
    let threshold = lightness_threshold(frame);
    guesses.push(of(among(&|color| color.0[0] > threshold)));
    guesses.push(of(among(&|color| color.0[0] <= threshold)));
    guesses
}

/// The fractions of a part that have colours of the surroundings, lit and in shadow.
fn table_shares(frame: &Frame, surroundings: &ColorMixture, part: &[bool]) -> [f64; 2] {
    let (colors, _) = frame.colors_of(part);
    let (table, others): (Vec<&Lab>, Vec<&Lab>) = colors.iter().partition(|color| surroundings.explains(color));
    let shadow = others.iter().filter(|color| surroundings.explains_shaded(color)).count();
    [table.len(), shadow].map(|count| count as f64 / colors.len().max(1) as f64)
}

/// The lightness that divides the box's pixels into the two most different groups.
///
/// # Source
/// Otsu, "A threshold selection method from gray-level histograms", 1979.
fn lightness_threshold(frame: &Frame) -> f32 {
    const NUM_BINS: usize = 128;
    const BIN: f32 = 100.0 / NUM_BINS as f32;
    let mut histogram = [0.0f64; NUM_BINS];
    for (color, _) in frame.colors.iter().zip(&frame.candidates).filter(|(_, candidate)| **candidate) {
        histogram[((color.0[0] / BIN) as usize).min(NUM_BINS - 1)] += 1.0;
    }
    let count: f64 = histogram.iter().sum();
    let sum: f64 = histogram.iter().enumerate().map(|(bin, n)| bin as f64 * n).sum();
    let (mut below, mut sum_below, mut best) = (0.0, 0.0, (0.0, 0));
    for (bin, n) in histogram.iter().enumerate() {
        below += n;
        sum_below += bin as f64 * n;
        let above = count - below;
        if below > 0.0 && above > 0.0 {
            let apart = sum_below / below - (sum - sum_below) / above;
            let variance = below * above * apart * apart;
            if variance > best.0 {
                best = (variance, bin);
            }
        }
    }
    (best.1 + 1) as f32 * BIN
}

/// The score of the largest piece of a cut: the fraction of its border that runs along edges of the picture, in [0, 1],
/// minus the cost of its largest distance from a side of the box. Returned with that piece.
fn score(frame: &Frame, cut: &[bool]) -> Option<(f64, Vec<bool>)> {
    let width = frame.width;
    let piece = pieces(cut, width).into_iter().max_by_key(Vec::len)?;
    let mut part = vec![false; cut.len()];
    piece.iter().for_each(|&at| part[at] = true);
    let bounds = |marks: &[bool]| {
        let marked = || (0..marks.len()).filter(|&at| marks[at]).map(|at| (at % width, at / width));
        let across = marked().fold((usize::MAX, 0), |(low, high), (x, _)| (low.min(x), high.max(x)));
        let down = marked().fold((usize::MAX, 0), |(low, high), (_, y)| (low.min(y), high.max(y)));
        [across, down].map(|(low, high)| (low as f64, high as f64))
    };
    let [of_box, of_part] = [bounds(&frame.candidates), bounds(&part)];
    let gaps = of_box.iter().zip(&of_part).flat_map(|((low, high), (from, to))| {
        let side = high - low + 1.0;
        [(from - low) / side, (high - to) / side]
    });
    let gap = gaps.fold(0.0, f64::max);
    Some((frame.share_along_edges(&part) - GAP_COST * (gap - MAX_GAP).max(0.0), part))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(is_unshaded: bool, table: f64, shadow: f64) -> Cut {
        Cut { score: 0.0, is_unshaded, table, shadow, part: Vec::new() }
    }

    #[test]
    fn a_shadow_is_told_by_a_cut_without_it() {
        let with_shadow = cut(true, 0.1, 0.3);
        assert!(cut(false, 0.1, 0.05).leaves_shadow_of(&with_shadow));
        // A dark part has these colours in every cut.
        assert!(!cut(false, 0.1, 0.25).leaves_shadow_of(&with_shadow));
        // The table's own colours are no shadow.
        assert!(!cut(false, 0.0, 0.0).leaves_shadow_of(&cut(true, 0.4, 0.05)));
    }
}
