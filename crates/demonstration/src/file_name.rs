//! Names of pictures in annotation files: from another system, as a web address, or from before a conversion of the
//! picture.

/// Similarity of a name in a file to the picture's, the most certain first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NameLikeness {
    /// The last part of the path is the same.
    Same,
    /// The last part is the same if escapes of web addresses are resolved, accents composed, and letters in lower case.
    Folded,
    /// The last part is the same except for the extension: the picture was converted.
    Stem,
}

impl NameLikeness {
    pub(crate) const ALL: [Self; 3] = [Self::Same, Self::Folded, Self::Stem];

    pub(crate) fn holds(self, one: &str, other: &str) -> bool {
        let [one, other] = [base_name(one), base_name(other)];
        match self {
            Self::Same => one == other,
            Self::Folded => is_same_folded(one, other),
            Self::Stem => {
                let stem = |name: &'_ str| name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned();
                is_same_folded(&stem(one), &stem(other))
            }
        }
    }
}

/// A path's last part, for any system's separator.
pub(crate) fn base_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Number of equal parts of two paths, counted from the last, for any system's separator.
pub(crate) fn common_parts(one: &str, other: &str) -> usize {
    fn parts(path: &str) -> impl Iterator<Item = &str> {
        path.rsplit(['/', '\\']).filter(|part| !part.is_empty() && *part != ".")
    }
    parts(one).zip(parts(other)).take_while(|(one, other)| is_same_folded(one, other)).count()
}

/// Whether two names are equal across systems; one may have escapes of web addresses, or text that looks like them.
fn is_same_folded(one: &str, other: &str) -> bool {
    let folded = |name: &str| composed(name).to_lowercase();
    let [resolved_one, resolved_other] = [one, other].map(|name| folded(&without_escapes(name)));
    let [one, other] = [one, other].map(folded);
    one == other || one == resolved_other || resolved_one == other
}

/// The name with `%20` and similar escapes resolved; the unchanged name if the result is not UTF-8.
pub(crate) fn without_escapes(name: &str) -> String {
    let bytes = name.as_bytes();
    let hex = |at: usize| char::from(*bytes.get(at)?).to_digit(16);
    let (mut resolved, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        match (bytes[at], hex(at + 1), hex(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                resolved.push((16 * high + low) as u8);
                at += 3;
            }
            (byte, ..) => {
                resolved.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8(resolved).unwrap_or_else(|_| name.to_owned())
}

/// The name with the combining accents of macOS composed with their letters, for letters of European languages.
fn composed(name: &str) -> String {
    const ACCENTS: [(char, &str, &str); 6] = [
        ('\u{300}', "aeiouAEIOU", "àèìòùÀÈÌÒÙ"),
        ('\u{301}', "aeiouyAEIOUYcnsz", "áéíóúýÁÉÍÓÚÝćńśź"),
        ('\u{302}', "aeiouAEIOU", "âêîôûÂÊÎÔÛ"),
        ('\u{303}', "anoANO", "ãñõÃÑÕ"),
        ('\u{308}', "aeiouyAEIOU", "äëïöüÿÄËÏÖÜ"),
        ('\u{30a}', "aA", "åÅ"),
    ];
    let mut composed = String::with_capacity(name.len());
    for character in name.chars() {
        let accent = ACCENTS.iter().find(|(accent, ..)| *accent == character);
        let letter = composed.chars().last();
        let place = accent.zip(letter).and_then(|((_, plain, _), letter)| plain.chars().position(|one| one == letter));
        match (accent, place.and_then(|place| accent?.2.chars().nth(place))) {
            (Some(_), Some(together)) => {
                composed.pop();
                composed.push(together);
            }
            _ => composed.push(character),
        }
    }
    composed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_systems_are_the_same_name() {
        let likeness =
            |one: &str, other: &str| NameLikeness::ALL.into_iter().find(|likeness| likeness.holds(one, other));
        for (one, other, expected) in [
            ("a/photo.png", "C:\\b\\photo.png", Some(NameLikeness::Same)),
            ("my photo.png", "file:///x/my%20photo.png", Some(NameLikeness::Folded)),
            ("Schl\u{fc}ssel.png", "Schlu\u{308}ssel.png", Some(NameLikeness::Folded)),
            ("schl\u{fc}ssel.png", "Schl%C3%BCssel.PNG", Some(NameLikeness::Folded)),
            ("photo.png", "photo.jpg", Some(NameLikeness::Stem)),
            ("photo.png", "photo2.png", None),
            ("100%.png", "100%25.png", Some(NameLikeness::Folded)),
            ("100%25.png", "100%2525.png", Some(NameLikeness::Folded)),
            ("my%20photo.png", "my%20photo.jpg", Some(NameLikeness::Stem)),
            ("50%ff.png", "50%ff.png", Some(NameLikeness::Same)),
        ] {
            assert_eq!(likeness(one, other), expected, "{one}, {other}");
        }
        assert_eq!(common_parts("/data/cam%20b/x.png", "cam b\\x.png"), 2);
    }
}
