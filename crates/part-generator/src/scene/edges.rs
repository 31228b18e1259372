//! Antialiasing: pixels on edges are rendered from several samples.

use super::contents::{Scene, TABLE};
use super::placement::Contact;
use super::shading::{Shading, TableRow};

/// Sample positions in a pixel on an edge.
const EDGE_SAMPLES: [[f32; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];

/// Height difference between neighbouring pixels, in pixel widths, above which they are on an edge.
const EDGE_STEP_PX: f32 = 0.9;

/// The contacts of the pixels' centres.
pub(crate) struct Seen<'a> {
    pub ids: &'a [u8],
    /// Valid only for pixels that show a body.
    pub contacts: &'a [Contact],
    /// For each row, the columns [first, end) outside of which there is only table.
    pub spans: &'a [[usize; 2]],
}

impl Seen<'_> {
    #[inline(always)]
    fn differ(&self, a: usize, b: usize, step: f32) -> bool {
        self.ids[a] != self.ids[b] || (self.ids[a] != TABLE && !is_like(&self.contacts[a], &self.contacts[b], step))
    }
}

/// Whether two contacts with the same body are on the same smooth piece of it.
#[inline(always)]
fn is_like(a: &Contact, b: &Contact, step: f32) -> bool {
    (a.z - b.z).abs() <= step && a.texel.material == b.texel.material && a.is_on_wall() == b.is_on_wall()
}

/// Renders pixels on edges again. Between bodies, or between a body and the table, the contact of each sample is
/// computed; the light of the sample is that of a neighbouring pixel that shows the same piece, if there is one. Pixels
/// on an edge within one body get a mean of their neighbourhood.
pub(crate) fn smooth_edges(
    scene: &Scene,
    seen: &Seen,
    boxes: &[[usize; 4]],
    shading: &Shading,
    light: &mut [[f32; 3]],
) {
    let (width, height) = (scene.view.width, scene.view.height);
    let step = EDGE_STEP_PX * shading.mm_per_px;
    let mut on_edge = vec![false; seen.ids.len()];
    for (y, &[first, end]) in seen.spans.iter().enumerate() {
        for x in first..end {
            let idx = y * width + x;
            for (exists, other) in [(x + 1 < width, idx + 1), (y + 1 < height, idx + width)] {
                if exists && seen.differ(idx, other, step) {
                    on_edge[idx] = true;
                    on_edge[other] = true;
                }
            }
        }
    }
    let mut table_row = TableRow::default();
    let mut drawn: Vec<(usize, [f32; 3])> = Vec::new();
    // The pixels' row in the picture, and for each body its lines of sight at the y of each sample.
    let (mut rows_at, mut rows) = (usize::MAX, Vec::new());
    for (idx, _) in on_edge.iter().enumerate().filter(|(_, on_edge)| **on_edge) {
        let (x, y) = (idx % width, idx / width);
        // The pixel and its existing neighbours.
        let around = [
            idx,
            if x > 0 { idx - 1 } else { idx },
            if x + 1 < width { idx + 1 } else { idx },
            if y > 0 { idx - width } else { idx },
            if y + 1 < height { idx + width } else { idx },
        ];
        let mut bodies = around.map(|other| seen.ids[other]);
        if bodies[1..].iter().all(|&body| body == bodies[0]) {
            // Within a body, the mean of the neighbourhood makes no visible difference and takes a tenth of the time.
            let sum = |k: usize| around[1..].iter().map(|&other| light[other][k]).sum::<f32>();
            drawn.push((idx, [0, 1, 2].map(|k| 0.5 * light[idx][k] + 0.125 * sum(k))));
            continue;
        }
        bodies.sort_unstable();
        if rows_at != y {
            rows_at = y;
            rows.clear();
            let sights = EDGE_SAMPLES.map(|[_, dy]| scene.view.row(y as f32 + dy));
            rows.extend(scene.bodies.iter().map(|body| [0, 1, 2, 3].map(|k| body.grid_row(&sights[k]))));
        }
        let mut sum = [0.0f32; 3];
        for (sample, [dx, dy]) in EDGE_SAMPLES.into_iter().enumerate() {
            let mut nearest: Option<(u8, Contact)> = None;
            for (k, &body) in bodies.iter().enumerate() {
                if body == TABLE || (k > 0 && bodies[k - 1] == body) {
                    continue;
                }
                let [x0, y0, x1, y1] = boxes[body as usize];
                if x < x0 || x >= x1 || y < y0 || y >= y1 {
                    continue;
                }
                if let Some(contact) = scene.bodies[body as usize].meet(&rows[body as usize][sample].at(x as f32 + dx))
                    && nearest.as_ref().is_none_or(|(_, other)| contact.z > other.z)
                {
                    nearest = Some((body, contact));
                }
            }
            let same = around.into_iter().find(|&other| match &nearest {
                None => seen.ids[other] == TABLE,
                Some((body, contact)) => seen.ids[other] == *body && is_like(contact, &seen.contacts[other], step),
            });
            let sample = match (same, &nearest) {
                (Some(other), _) => light[other],
                (None, Some((body, contact))) => {
                    shading.body(*body, contact, &scene.view.row(y as f32 + dy).at(x as f32 + dx))
                }
                (None, None) => {
                    let mut one = [[0.0; 3]];
                    shading.table_row(&scene.view, x as f32 + dx, y as f32 + dy, &mut table_row, &mut one);
                    one[0]
                }
            };
            (0..3).for_each(|k| sum[k] += sample[k]);
        }
        drawn.push((idx, sum.map(|s| s * (1.0 / EDGE_SAMPLES.len() as f32))));
    }
    drawn.into_iter().for_each(|(idx, color)| light[idx] = color);
}
