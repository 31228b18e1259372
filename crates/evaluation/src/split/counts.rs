//! The three figures of a set, of a kind of picture, or of a side.

use serde::Serialize;

use crate::labelled_pictures::{DEFAULT_MIN_SCORE, Judged, Tested, Totals, judge};
use crate::statistics::Share;

/// Found, wrong and false alarms, at the minimum score of `sdg detect`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Parts found, of all that must be found.
    pub found: Share,
    /// Detections without a hit, of all accepted in pictures with the part.
    pub wrong: Share,
    /// Pictures without the part in which a detection is accepted, of all without the part.
    pub false_alarms: Share,
}

/// A figure of the counts.
pub(super) type Figure = fn(&Counts) -> Share;

/// The figures by which sides are compared.
pub(super) const FIGURES: [(&str, Figure); 3] = [
    ("parts found", |counts| counts.found),
    ("wrong, of accepted detections", |counts| counts.wrong),
    ("false alarms, of pictures without the part", |counts| counts.false_alarms),
];

impl Counts {
    pub fn of<'a>(tested: impl IntoIterator<Item = &'a Tested>) -> Self {
        let judged: Vec<Judged> = tested.into_iter().map(|tested| judge(tested, DEFAULT_MIN_SCORE)).collect();
        let totals = Totals::of(&judged);
        let accepted = totals.found.count + totals.optional.count + totals.wrong;
        Self {
            found: totals.found,
            wrong: Share { count: totals.wrong, of: accepted },
            false_alarms: totals.false_alarms,
        }
    }

    /// The figures on one line, without those whose total is zero; a dash if both totals are zero.
    pub fn in_words(&self) -> String {
        let found = format!("{} found, {} wrong", self.found, self.wrong.count);
        let false_alarms = format!("{} false alarms", self.false_alarms);
        let parts = [(self.found.of > 0, found), (self.false_alarms.of > 0, false_alarms)];
        let told: Vec<String> = parts.into_iter().filter_map(|(is_there, words)| is_there.then_some(words)).collect();
        if told.is_empty() { "–".to_owned() } else { told.join("; ") }
    }

    /// The lower fraction `found`, the higher `wrong` and the higher `false_alarms`, each on its own.
    pub fn worse_of(self, other: Self) -> Self {
        // Without a division, because a total may be zero.
        let by_fraction = |one: &Share, other: &Share| {
            let fractions = (one.count * other.of).cmp(&(other.count * one.of));
            fractions.then(one.count.cmp(&other.count))
        };
        Self {
            found: std::cmp::min_by(self.found, other.found, by_fraction),
            wrong: std::cmp::max_by(self.wrong, other.wrong, by_fraction),
            false_alarms: std::cmp::max_by(self.false_alarms, other.false_alarms, by_fraction),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_of_two_seeds_is_taken_figure_by_figure() {
        let counts = |found: usize, wrong: usize, alarms: usize| Counts {
            found: Share { count: found, of: 10 },
            wrong: Share { count: wrong, of: found + wrong },
            false_alarms: Share { count: alarms, of: 5 },
        };
        let worst = counts(8, 2, 0).worse_of(counts(7, 1, 3));
        assert_eq!((worst.found.count, worst.wrong, worst.false_alarms.count), (7, Share { count: 2, of: 10 }, 3));
        // 2 of 10 is worse than 3 of 100, and anything is worse than nothing.
        let [few, many] =
            [(2, 10), (3, 100)].map(|(count, of)| Counts { wrong: Share { count, of }, ..counts(8, 0, 0) });
        assert_eq!([few.worse_of(many).wrong, many.worse_of(few).wrong], [few.wrong; 2]);
        assert_eq!(Counts::default().worse_of(many).wrong, many.wrong);
    }
}
