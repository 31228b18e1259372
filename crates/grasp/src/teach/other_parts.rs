//! Generated parts that lie about while a part is taught: what a workshop has besides it.
//!
//! They are none of the shipped parts, and not the ones that anything is measured on: a seed of their own draws them.

use sdg_demonstration::Demonstration;
use sdg_part_generator::{Part, PhotoConfig, demonstration};

/// Photos as large as the network's input.
const PHOTO: PhotoConfig = PhotoConfig { width: 320, height: 240, fill: [0.4, 0.6] };

/// Seeds of other parts start here, far from those of parts to measure and to pretrain on.
const FIRST_SEED: u64 = 1 << 48;

/// So many parts to learn with, and a third as many others to hold back.
pub(super) fn draw(count: usize, seed: u64) -> [Vec<Demonstration>; 2] {
    let first = FIRST_SEED.wrapping_add(seed.wrapping_mul(10_000));
    let one = |i: usize| demonstration(&Part::generate(first.wrapping_add(i as u64)), &PHOTO, 0);
    let all: Vec<Demonstration> = (0..count + count.div_ceil(3))
        .map(one)
        .filter(|demonstration| demonstration.annotation.outline.is_some())
        .collect();
    let held_back = all.len() - all.len() * 3 / 4;
    let (held_back, to_learn) = all.split_at(held_back);
    [to_learn.to_vec(), held_back.to_vec()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_back_is_not_learnt_with() {
        let [to_learn, held_back] = draw(9, 4);
        assert_eq!((to_learn.len(), held_back.len()), (9, 3));
        assert!(held_back.iter().all(|other| to_learn.iter().all(|one| one.image != other.image)));
        assert_eq!(draw(9, 4)[0][0].image, to_learn[0].image);
        assert_eq!(draw(0, 4), [vec![], vec![]]);
    }
}
