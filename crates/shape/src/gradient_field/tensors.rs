//! The structure tensors of a picture: blurred, differentiated, smoothed, row by row.

use image::RgbImage;

use crate::parallel;

/// The three channels of an image, one after the other.
#[derive(Debug, Clone)]
pub(super) struct Planes {
    pub(super) width: usize,
    pub(super) height: usize,
    channels: [Vec<u8>; 3],
}

impl Planes {
    pub(super) fn from_image(image: &RgbImage) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let (pixels, _) = image.as_raw().as_chunks::<3>();
        let channels = of_each_channel(|c| pixels.iter().map(|pixel| pixel[c]).collect());
        Self { width, height, channels }
    }

    /// Mean of 2×2 pixels; an odd last row or column is left out.
    pub(super) fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let channels = of_each_channel(|c| {
            let mut out = Vec::with_capacity(width * height);
            for row in 0..height {
                let top = &self.channels[c][2 * row * self.width..][..2 * width];
                let bottom = &self.channels[c][(2 * row + 1) * self.width..][..2 * width];
                out.extend(top.chunks_exact(2).zip(bottom.chunks_exact(2)).map(|(a, b)| {
                    let sum = u16::from(a[0]) + u16::from(a[1]) + u16::from(b[0]) + u16::from(b[1]);
                    ((sum + 2) / 4) as u8
                }));
            }
            out
        });
        Self { width, height, channels }
    }

    /// A part of the planes, given its upper left corner and its size.
    fn cut(&self, [left, top]: [usize; 2], [width, height]: [usize; 2]) -> Self {
        let mut channels = [(); 3].map(|()| Vec::with_capacity(width * height));
        for (cut, channel) in channels.iter_mut().zip(&self.channels) {
            for row in top..top + height {
                cut.extend_from_slice(&channel[row * self.width + left..][..width]);
            }
        }
        Self { width, height, channels }
    }
}

fn of_each_channel(values: impl Fn(usize) -> Vec<u8> + Sync + Send) -> [Vec<u8>; 3] {
    let mut channels = parallel::map(&[0, 1, 2], |&c| values(c)).into_iter();
    [(); 3].map(|()| channels.next().unwrap_or_default())
}

/// A tensor depends on pixels within this distance. Derived: 2 of the blur, 1 of the difference, 1 of the smoothing.
const DEPENDS_ON: usize = 4;

/// The tensors of a part of the picture, equal bit for bit to those of the whole picture.
pub(super) fn tensors_of_part(planes: &Planes, corner: [usize; 2], size: [usize; 2]) -> Vec<[f32; 4]> {
    let whole = [planes.width, planes.height];
    let first = corner.map(|at| at.saturating_sub(DEPENDS_ON));
    let end = [0, 1].map(|k| (corner[k] + size[k] + DEPENDS_ON).min(whole[k]));
    let cut = planes.cut(first, [end[0] - first[0], end[1] - first[1]]);
    let [left, top] = [corner[0] - first[0], corner[1] - first[1]];
    let rows = tensors_of_band(&cut, top, top + size[1]);
    let mut part = Vec::with_capacity(size[0] * size[1]);
    for row in rows.chunks_exact(cut.width) {
        part.extend_from_slice(&row[left..left + size[0]]);
    }
    part
}

/// Pixels repeated at each end of a row, so that the filters need no border case. Derived: the radius of the 5-tap
/// filter.
const PAD: usize = 2;
/// Gain of the 5-tap binomial filter in both directions. Derived: 16 × 16.
const BLUR_GAIN: f32 = 256.0;

/// Rows that one thread takes at a time. Chosen to save time; it does not change results.
pub(super) const BAND: usize = 64;

/// `[tr, v.x, v.y, 0]` of every pixel, row by row.
pub(super) fn structure_tensors(planes: &Planes) -> Vec<[f32; 4]> {
    let mut samples = vec![[0.0; 4]; planes.width * planes.height];
    parallel::for_each_stretch(&mut samples, BAND * planes.width.max(1), |band, samples| {
        let start = BAND * band;
        fill_band(planes, start, (start + BAND).min(planes.height), samples);
    });
    samples
}

/// The tensors of the rows from `start` to before `end`, computed through rings of three rows that stay in the cache.
fn tensors_of_band(planes: &Planes, start: usize, end: usize) -> Vec<[f32; 4]> {
    let mut samples = vec![[0.0; 4]; planes.width * (end - start)];
    fill_band(planes, start, end, &mut samples);
    samples
}

fn fill_band(planes: &Planes, start: usize, end: usize, samples: &mut [[f32; 4]]) {
    let width = planes.width;
    let mut rows_out = samples.chunks_exact_mut(width.max(1));
    let mut blurred = BlurredRows::new(width);
    let mut tensors = [(); 3].map(|()| TensorRow::new(width));
    let mut vertical = TensorRow::new(width);
    let (rows, start, end) = (planes.height as isize, start as isize, end as isize);
    let first = (start - 1).max(0);
    for row in [first - 1, first] {
        blurred.compute(planes, row.max(0));
    }
    for row in first..(end + 1).min(rows) {
        blurred.compute(planes, (row + 1).min(rows - 1));
        tensors[(row % 3) as usize].compute(&blurred, row, rows);
        if row > start {
            emit_smoothed(&tensors, row - 1, rows, &mut vertical, rows_out.next());
        }
    }
    if end == rows {
        emit_smoothed(&tensors, rows - 1, rows, &mut vertical, rows_out.next());
    }
}

/// Ring of rows smoothed with the binomial 1-4-6-4-1 in both directions, per channel.
struct BlurredRows {
    width: usize,
    rows: [[Vec<u16>; 3]; 3],
    vertical: Vec<u16>,
}

impl BlurredRows {
    fn new(width: usize) -> Self {
        Self {
            width,
            rows: [(); 3].map(|()| [(); 3].map(|()| vec![0; width + 2 * PAD])),
            vertical: vec![0; width + 2 * PAD],
        }
    }

    fn compute(&mut self, planes: &Planes, row: isize) {
        let (width, last) = (self.width, planes.height as isize - 1);
        for channel in 0..3 {
            let line = |offset: isize| {
                let y = (row + offset).clamp(0, last) as usize;
                &planes.channels[channel][y * width..][..width]
            };
            let (a, b, c, d, e) = (line(-2), line(-1), line(0), line(1), line(2));
            let inner = &mut self.vertical[PAD..PAD + width];
            for x in 0..width {
                inner[x] =
                    u16::from(a[x]) + u16::from(e[x]) + 4 * (u16::from(b[x]) + u16::from(d[x])) + 6 * u16::from(c[x]);
            }
            pad(&mut self.vertical, width);
            let out = &mut self.rows[row as usize % 3][channel];
            let source = &self.vertical;
            let (a, b, c) = (&source[..width], &source[1..][..width], &source[2..][..width]);
            let (d, e) = (&source[3..][..width], &source[4..][..width]);
            // 255 · 16 · 16 = 65280 still fits in 16 bits.
            for (x, out) in out[PAD..PAD + width].iter_mut().enumerate() {
                *out = a[x] + e[x] + 4 * (b[x] + d[x]) + 6 * c[x];
            }
            pad(out, width);
        }
    }
}

fn pad<T: Copy>(row: &mut [T], width: usize) {
    for k in 0..PAD {
        row[k] = row[PAD];
        row[PAD + width + k] = row[PAD + width - 1];
    }
}

/// One row of structure tensors, padded.
struct TensorRow {
    tr: Vec<f32>,
    vx: Vec<f32>,
    vy: Vec<f32>,
}

impl TensorRow {
    fn new(width: usize) -> Self {
        let zeros = vec![0.0; width + 2 * PAD];
        Self { tr: zeros.clone(), vx: zeros.clone(), vy: zeros }
    }

    /// Sums the three channels' tensors; differences at the border are one-sided and halved, which only weakens
    /// gradients there.
    fn compute(&mut self, blurred: &BlurredRows, row: isize, rows: isize) {
        let width = blurred.width;
        // Central difference, the blur's gain, and the mean over three channels.
        let gain = (0.5 / BLUR_GAIN).powi(2) / 3.0;
        let ring = |y: isize| &blurred.rows[y.clamp(0, rows - 1) as usize % 3];
        let (above, here, below) = (ring(row - 1), ring(row), ring(row + 1));
        for channel in 0..3 {
            let left = &here[channel][PAD - 1..][..width];
            let right = &here[channel][PAD + 1..][..width];
            let up = &above[channel][PAD..][..width];
            let down = &below[channel][PAD..][..width];
            let tr = &mut self.tr[PAD..][..width];
            let vx = &mut self.vx[PAD..][..width];
            let vy = &mut self.vy[PAD..][..width];
            let keep = if channel == 0 { 0.0 } else { 1.0 };
            for x in 0..width {
                let gx = (i32::from(right[x]) - i32::from(left[x])) as f32;
                let gy = (i32::from(down[x]) - i32::from(up[x])) as f32;
                let (xx, yy) = (gx * gx * gain, gy * gy * gain);
                tr[x] = keep * tr[x] + (xx + yy);
                vx[x] = keep * vx[x] + (xx - yy);
                vy[x] = keep * vy[x] + 2.0 * gain * gx * gy;
            }
        }
    }
}

/// Smooths the tensors of `row` with the binomial 1-2-1 in both directions into `out`.
fn emit_smoothed(
    ring: &[TensorRow; 3],
    row: isize,
    rows: isize,
    vertical: &mut TensorRow,
    out: Option<&mut [[f32; 4]]>,
) {
    let line = |y: isize| &ring[(y.clamp(0, rows - 1) % 3) as usize];
    let (above, here, below) = (line(row - 1), line(row), line(row + 1));
    let width = here.tr.len() - 2 * PAD;
    let smooth = |out: &mut Vec<f32>, a: &[f32], b: &[f32], c: &[f32]| {
        for x in PAD..PAD + width {
            out[x] = 0.25 * (a[x] + c[x]) + 0.5 * b[x];
        }
        pad(out, width);
    };
    smooth(&mut vertical.tr, &above.tr, &here.tr, &below.tr);
    smooth(&mut vertical.vx, &above.vx, &here.vx, &below.vx);
    smooth(&mut vertical.vy, &above.vy, &here.vy, &below.vy);
    let across = |v: &[f32], x: usize| 0.25 * (v[x - 1] + v[x + 1]) + 0.5 * v[x];
    for (x, sample) in (PAD..PAD + width).zip(out.into_iter().flatten()) {
        *sample = [across(&vertical.tr, x), across(&vertical.vx, x), across(&vertical.vy, x), 0.0];
    }
}
