//! Renders a scene: the first contact of each pixel's line of sight, and its light.

use super::contents::{Scene, TABLE};
use super::edges::{Seen, smooth_edges};
use super::placement::Contact;
use super::shading::{Shading, TableRow};

/// Cell size of the height grid for shadows, in pixels.
const GROUND_CELL_PX: f32 = 2.0;

/// Number of neighbouring pixels of a row that are first tested together.
const GROUP_PX: i32 = 4;

/// The pixels of a body without occlusion.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Footprint {
    /// Pixels [x0, y0, x1, y1]; may extend outside the picture.
    pub bounds: [i32; 4],
    /// Whether the body covers each pixel's centre, row by row.
    pub shown: Vec<bool>,
}

/// The bodies in a rendered picture.
pub(crate) struct Rendered {
    /// The body at each pixel's centre.
    pub ids: Vec<u8>,
    /// The pixels of the bodies for which footprints were requested: the first ones.
    pub footprints: Vec<Footprint>,
}

/// Buffers for rendering, reused between pictures. Their contents do not outlive a picture.
#[derive(Default)]
pub(crate) struct Canvas {
    /// The picture in linear light, row by row.
    pub light: Vec<[f32; 3]>,
    /// A buffer of the picture's length, used by the sensor.
    pub spare: Vec<[f32; 3]>,
    contacts: Vec<Contact>,
    row: TableRow,
}

impl Scene {
    /// Renders the picture into the canvas, and the complete footprints of the first `num_footprints` bodies.
    pub fn render(&self, num_footprints: usize, canvas: &mut Canvas) -> Rendered {
        let (width, height) = (self.view.width, self.view.height);
        let shading = Shading::new(self, GROUND_CELL_PX);
        canvas.contacts.resize(width * height, Contact::default());
        canvas.light.resize(width * height, [0.0; 3]);
        let mut ids = vec![TABLE; width * height];
        let mut footprints = Vec::with_capacity(num_footprints);
        let mut boxes = Vec::with_capacity(self.bodies.len());
        for (idx, body) in self.bodies.iter().enumerate() {
            let bounds = body.picture_box(&self.view);
            let inside = clipped(bounds, width, height);
            if idx < num_footprints {
                let area = (bounds[2] - bounds[0]) * (bounds[3] - bounds[1]);
                let mut shown = Vec::with_capacity(area as usize);
                self.meet_all(idx, bounds, &mut ids, &mut canvas.contacts, |is_met| shown.push(is_met));
                footprints.push(Footprint { bounds, shown });
            } else {
                self.meet_all(idx, inside.map(|v| v as i32), &mut ids, &mut canvas.contacts, |_| {});
            }
            boxes.push(inside);
        }
        let spans = spans_of(&boxes, width, height);
        for (y, row) in canvas.light.chunks_exact_mut(width).enumerate() {
            shading.table_row(&self.view, 0.5, y as f32 + 0.5, &mut canvas.row, row);
            let sights = self.view.row(y as f32 + 0.5);
            let [first, end] = spans[y];
            for (x, pixel) in row.iter_mut().enumerate().take(end).skip(first) {
                let idx = y * width + x;
                if ids[idx] != TABLE {
                    *pixel = shading.body(ids[idx], &canvas.contacts[idx], &sights.at(x as f32 + 0.5));
                }
            }
        }
        let seen = Seen { ids: &ids, contacts: &canvas.contacts, spans: &spans };
        smooth_edges(self, &seen, &boxes, &shading, &mut canvas.light);
        Rendered { ids, footprints }
    }

    /// Intersects the lines of sight of a box of pixels with a body and keeps the nearest contacts; `tell` is called
    /// for each pixel, row by row; its argument is true if the pixel's line of sight meets the body.
    fn meet_all(
        &self,
        idx: usize,
        bounds: [i32; 4],
        ids: &mut [u8],
        contacts: &mut [Contact],
        mut tell: impl FnMut(bool),
    ) {
        let body = &self.bodies[idx];
        let (width, height) = (self.view.width as i32, self.view.height as i32);
        let spans = body.row_spans(&self.view, bounds);
        let reach = body.cells_per_px(&self.view, bounds) * 0.5 * GROUP_PX as f32;
        for (y, [first, end]) in (bounds[1]..bounds[3]).zip(spans) {
            (bounds[0]..first).for_each(|_| tell(false));
            let sights = body.grid_row(&self.view.row(y as f32 + 0.5));
            let mut clear_until = first;
            for x in first..end {
                if (x - first) % GROUP_PX == 0 && body.is_clear_around(&sights.at((x + GROUP_PX / 2) as f32), reach) {
                    clear_until = x + GROUP_PX;
                }
                let met = if x < clear_until { None } else { body.meet(&sights.at(x as f32 + 0.5)) };
                tell(met.is_some());
                if let Some(contact) = met
                    && (0..width).contains(&x)
                    && (0..height).contains(&y)
                {
                    let pixel = (y * width + x) as usize;
                    let before = if ids[pixel] == TABLE { 0.0 } else { contacts[pixel].z };
                    if contact.z > before {
                        ids[pixel] = idx as u8;
                        contacts[pixel] = contact;
                    }
                }
            }
            (end..bounds[2]).for_each(|_| tell(false));
        }
    }
}

fn clipped(b: [i32; 4], width: usize, height: usize) -> [usize; 4] {
    let x = |v: i32| v.clamp(0, width as i32) as usize;
    let y = |v: i32| v.clamp(0, height as i32) as usize;
    [x(b[0]), y(b[1]), x(b[2]), y(b[3])]
}

/// For each row, the columns [first, end) of all boxes with a margin of one pixel.
fn spans_of(boxes: &[[usize; 4]], width: usize, height: usize) -> Vec<[usize; 2]> {
    let mut spans = vec![[width, 0]; height];
    for &[x0, y0, x1, y1] in boxes {
        for span in &mut spans[y0.saturating_sub(1)..(y1 + 1).min(height)] {
            *span = [span[0].min(x0.saturating_sub(1)), span[1].max((x1 + 1).min(width))];
        }
    }
    spans
}
