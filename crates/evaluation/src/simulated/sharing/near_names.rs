//! Finds known names that are similar to a misspelt one.

use strsim::levenshtein;

/// Maximum number of returned names.
const MAX_NAMES: usize = 3;

/// The names in `known` that are most similar to `name`, the nearest first.
pub fn near_names<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let mut near: Vec<(usize, &str)> = known.into_iter().map(|known| (levenshtein(name, known), known)).collect();
    near.sort_by_key(|(edits, _)| *edits);
    near.into_iter().take(MAX_NAMES).map(|(_, known)| known).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_counted() {
        assert_eq!(levenshtein("kitten", "sitting"), 3);
        assert_eq!(levenshtein("", "abc"), 3);
        assert_eq!(levenshtein("grasp-C-pendulum", "grasp-C-pendulum"), 0);
    }

    #[test]
    fn the_nearest_comes_first() {
        let known = ["teach-C-pendulum", "look-pendulum", "grasp-C-pendulum", "grasp-C-rod_end", "time-pendulum"];
        assert_eq!(near_names("grasp-pendulum", known)[0], "grasp-C-pendulum");
        assert_eq!(near_names("grasp-C-rodend", known)[0], "grasp-C-rod_end");
        assert_eq!(near_names("x", known).len(), MAX_NAMES);
    }
}
