//! The names that a misspelt one may have meant.

/// At most this many are told.
const MAX_NAMES: usize = 3;

/// Those of `known` that `name` resembles most, the nearest first.
pub fn near_names<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let mut near: Vec<(usize, &str)> = known.into_iter().map(|known| (edits(name, known), known)).collect();
    near.sort_by_key(|(edits, _)| *edits);
    near.into_iter().take(MAX_NAMES).map(|(_, known)| known).collect()
}

/// Letters to insert, remove or replace until one text is the other (Levenshtein's distance).
fn edits(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, letter) in from.chars().enumerate() {
        let mut before = row[0];
        row[0] = i + 1;
        for (j, other) in to.iter().enumerate() {
            let replaced = before + usize::from(letter != *other);
            before = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(before + 1);
        }
    }
    row[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_counted() {
        assert_eq!(edits("kitten", "sitting"), 3);
        assert_eq!(edits("", "abc"), 3);
        assert_eq!(edits("grasp-C-pendulum", "grasp-C-pendulum"), 0);
    }

    #[test]
    fn the_nearest_comes_first() {
        let known = ["teach-C-pendulum", "look-pendulum", "grasp-C-pendulum", "grasp-C-rod_end", "time-pendulum"];
        assert_eq!(near_names("grasp-pendulum", known)[0], "grasp-C-pendulum");
        assert_eq!(near_names("grasp-C-rodend", known)[0], "grasp-C-rod_end");
        assert_eq!(near_names("x", known).len(), MAX_NAMES);
    }
}
