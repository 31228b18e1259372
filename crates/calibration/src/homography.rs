//! The homography from a plane to its picture: `pixel ~ H (x, y, 1)`.

use nalgebra::{DMatrix, Matrix3, Point2, Vector3};

/// The homography from points of a plane to pixels, by least squares of the normalised linear equations. `None` if the
/// points do not determine the homography, for example if there are fewer than four, or if all are on a line.
///
/// # Source
/// Hartley and Zisserman, Multiple View Geometry, algorithm 4.2.
pub(crate) fn fit(places: &[(Point2<f64>, Point2<f64>)]) -> Option<Matrix3<f64>> {
    if places.len() < 4 {
        return None;
    }
    let from = normaliser(places.iter().map(|(from, _)| from))?;
    let to = normaliser(places.iter().map(|(_, to)| to))?;
    let mut normal = DMatrix::<f64>::zeros(9, 9);
    for (a, b) in places {
        let (a, b) = (from * a.to_homogeneous(), to * b.to_homogeneous());
        let rows = [
            [a.x, a.y, 1.0, 0.0, 0.0, 0.0, -b.x * a.x, -b.x * a.y, -b.x],
            [0.0, 0.0, 0.0, a.x, a.y, 1.0, -b.y * a.x, -b.y * a.y, -b.y],
        ];
        for row in rows {
            let row = nalgebra::DVector::from_row_slice(&row);
            normal += &row * row.transpose();
        }
    }
    let eigen = normal.symmetric_eigen();
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    // A second undetermined direction, as for points on a line.
    if eigen.eigenvalues[order[1]] < 1e-9 * eigen.eigenvalues[order[8]] {
        return None;
    }
    let h = eigen.eigenvectors.column(order[0]);
    let normalised = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    let matrix = to.try_inverse()? * normalised * from;
    // The sign places the points' centre in front of the camera.
    let middle = from.try_inverse()? * Vector3::z();
    Some(matrix * (1.0 / (matrix * middle).z))
}

/// The pixel of a point of the plane.
pub(crate) fn apply(homography: &Matrix3<f64>, place: &Point2<f64>) -> Point2<f64> {
    let h = homography * place.to_homogeneous();
    Point2::new(h.x / h.z, h.y / h.z)
}

/// The transform that moves the mean to the origin and makes the mean distance √2.
fn normaliser<'a>(points: impl Iterator<Item = &'a Point2<f64>> + Clone) -> Option<Matrix3<f64>> {
    let count = points.clone().count() as f64;
    let mean = points.clone().map(|point| point.coords).sum::<nalgebra::Vector2<f64>>() / count;
    let distance = points.map(|point| (point.coords - mean).norm()).sum::<f64>() / count;
    let scale = std::f64::consts::SQRT_2 / distance;
    scale.is_finite().then(|| Matrix3::new(scale, 0.0, -scale * mean.x, 0.0, scale, -scale * mean.y, 0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_places_and_more_give_it_back() {
        let truth = Matrix3::new(900.0, 30.0, 300.0, -20.0, -880.0, 250.0, 0.1, 0.3, 1.0);
        let places: Vec<_> = (0..12)
            .map(|k| Point2::new(f64::from(k % 4) * 0.05, f64::from(k / 4) * 0.04))
            .map(|place| (place, apply(&truth, &place)))
            .collect();
        let found = fit(&places).unwrap();
        assert!(places.iter().all(|(place, pixel)| (apply(&found, place) - pixel).norm() < 1e-8));
        assert!(fit(&places[..3]).is_none());
        assert!(fit(&places[..4]).is_none(), "four places in a row");
    }
}
