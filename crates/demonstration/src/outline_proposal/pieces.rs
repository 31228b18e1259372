//! Connected pieces of a picture.

/// The connected pieces of the marked pixels, by horizontal and vertical neighbours.
pub(crate) fn pieces(marked: &[bool], width: usize) -> Vec<Vec<usize>> {
    let mut seen = vec![false; marked.len()];
    let mut pieces = Vec::new();
    for start in 0..marked.len() {
        if !marked[start] || seen[start] {
            continue;
        }
        seen[start] = true;
        let (mut piece, mut next) = (vec![start], 0);
        while next < piece.len() {
            for to in neighbours(piece[next], width, marked.len()) {
                if marked[to] && !seen[to] {
                    seen[to] = true;
                    piece.push(to);
                }
            }
            next += 1;
        }
        pieces.push(piece);
    }
    pieces
}

/// The pixels left, right, above and below.
pub(crate) fn neighbours(at: usize, width: usize, count: usize) -> impl Iterator<Item = usize> {
    let x = at % width;
    let all = [
        (x > 0).then(|| at - 1),
        (x + 1 < width).then(|| at + 1),
        (at >= width).then(|| at - width),
        (at + width < count).then(|| at + width),
    ];
    all.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_do_not_connect() {
        // X X .
        // . . X
        let pieces = pieces(&[true, true, false, false, false, true], 3);
        assert_eq!(pieces, [vec![0, 1], vec![5]]);
    }
}
