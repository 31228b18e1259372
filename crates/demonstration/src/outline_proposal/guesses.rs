//! Several guesses of the part, each cut, and the choice of the cut that a person meant with the box.
//!
//! The constants of the choice were fitted on 30 pictures of generated parts (seeds from 2^51, boxes as drawn and looser by a twelfth), on the
//! shipped demonstrations, and on the five photographs that docs/comparison-with-tools.md reports; not on the tests' pictures.

use super::color_mixture::ColorMixture;
use super::frame::Frame;
use super::lab::Lab;
use super::pieces::pieces;

/// Minimum share of the box that remains without shadows; below it the part itself has a shadow's colour. A thin tube
/// fills about a twentieth of its box.
const MIN_UNSHADED_SHARE: f64 = 0.02;
/// Largest distance of a person's box from the part, as a share of its side, on each side.
const MAX_GAP: f64 = 0.1;
/// Cost of a side on which the part ends farther from the box than that, per share of the box's side.
const GAP_COST: f64 = 2.0;
/// Bonus of the guess without shadows: a shadow's border is an edge, too, and reaches the box.
const UNSHADED_BONUS: f64 = 0.15;
/// Bonus of the cut that uses the colours of the whole photo, if both follow edges. With 0, 0.05 and 0.1 the shipped
/// pneumatic cylinder's overlap was 0.846, 0.871, 0.871.
const ELSEWHERE_BONUS: f64 = 0.05;
/// Minimum share of a cut along edges of the picture for a part: noise can be cut, too.
const MIN_SCORE: f64 = 0.2;

/// The most likely part, cut; `None` if nothing stands out.
pub(crate) fn likeliest_cut(frame: &Frame, rounds: usize) -> Option<Vec<bool>> {
    let free = vec![None; frame.colors.len()];
    let mut best: Option<(f64, Vec<bool>)> = None;
    for (guess, bonus, elsewhere) in guesses(frame) {
        let cut = frame.cut(guess, elsewhere, &free, rounds);
        let Some((score, part)) = cut.and_then(|cut| score(frame, &cut)) else { continue };
        if score + bonus > best.as_ref().map_or(MIN_SCORE, |(best, _)| *best) {
            best = Some((score + bonus, part));
        }
    }
    best.map(|(_, part)| part)
}

/// Initial divisions of the frame, each with its prior bonus, and additional colours of the surroundings: those of the
/// whole photo identify a shadow, but colours of another object that resembles the part would make the part
/// surroundings.
fn guesses(frame: &Frame) -> Vec<(Vec<bool>, f64, &[Lab])> {
    let among = |is_part: &dyn Fn(&Lab) -> bool| -> Vec<bool> {
        frame.colors.iter().zip(&frame.candidates).map(|(color, &candidate)| candidate && is_part(color)).collect()
    };
    let count = |marks: &[bool]| marks.iter().filter(|&&mark| mark).count() as f64;
    let mut guesses = Vec::new();
    let (_, mut surroundings) = frame.colors_of(&frame.candidates);
    surroundings.extend_from_slice(&frame.elsewhere);
    if let Some(surroundings) = ColorMixture::learn(&surroundings) {
        let unshaded = among(&|color| !surroundings.explains(color) && !surroundings.explains_shaded(color));
        if count(&unshaded) >= MIN_UNSHADED_SHARE * count(&frame.candidates) {
            guesses.push((unshaded.clone(), UNSHADED_BONUS + ELSEWHERE_BONUS, &frame.elsewhere[..]));
            guesses.push((unshaded, UNSHADED_BONUS, &[]));
        }
        guesses.push((among(&|color| !surroundings.explains(color)), 0.0, &[]));
    }
    let threshold = lightness_threshold(frame);
    guesses.push((among(&|color| color.0[0] > threshold), 0.0, &[]));
    guesses.push((among(&|color| color.0[0] <= threshold), 0.0, &[]));
    guesses
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

/// The score of the largest piece of a cut: the share of its border that runs along edges of the picture, in [0, 1],
/// minus the unused part of the box. Returned with that piece.
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
