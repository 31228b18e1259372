//! A sequence of pictures as one small GIF.
//!
//! ```text
//! frames ─ thin out to fps ─ scale down ─ one palette (NeuQuant) ─ changed pixels only ─ GIF
//!                                   └────── coarser, until it fits max_bytes ──────┘
//! ```
//!
//! All frames use one palette, so that a static background does not flicker. Each frame contains only the rectangle
//! that changed, with unchanged pixels transparent: with a fixed camera, only motion needs space.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, Frame, Repeat};
use image::RgbImage;
use image::imageops::{self, FilterType};

use crate::error::ReportError;

/// Size and speed of an animation.
#[derive(Debug, Clone, PartialEq)]
pub struct AnimationOptions {
    /// Frames per second as recorded.
    pub source_fps: f64,
    /// Maximum number of frames shown per second. Values above 50, which is the maximum in browsers, count as 50.
    pub fps: f64,
    /// Playback speed relative to the recording.
    pub speed: f64,
    /// Maximum width in pixels; wider frames are scaled down.
    pub max_width: u32,
    /// Maximum size of the file in bytes. To reach it, the accuracy of colours, then frames, then pixels are
    /// reduced. If this is not enough, the file exceeds the maximum.
    pub max_bytes: usize,
    /// Time in seconds for which the last frame is shown before the animation restarts.
    pub hold_last_secs: f64,
}

impl Default for AnimationOptions {
    fn default() -> Self {
        Self { source_fps: 12.0, fps: 12.0, speed: 1.0, max_width: 320, max_bytes: 1_900_000, hold_last_secs: 1.5 }
    }
}

/// A finished animation: the GIF, and its last frame for readers who prefer no motion.
#[derive(Debug, Clone)]
pub struct Animation {
    pub(crate) gif: Vec<u8>,
    pub(crate) still: RgbImage,
    num_frames: usize,
}

impl Animation {
    /// Encodes frames that are already in memory. For frames that arrive one by one, see [`AnimationRecorder`].
    ///
    /// # Errors
    /// The errors of [`AnimationRecorder::push`] and [`AnimationRecorder::finish`].
    pub fn encode(frames: &[RgbImage], options: &AnimationOptions) -> Result<Self, ReportError> {
        let mut recorder = AnimationRecorder::new(options.clone());
        for frame in frames {
            recorder.push(frame)?;
        }
        recorder.finish()
    }

    /// The bytes of the GIF file.
    #[must_use]
    pub fn gif(&self) -> &[u8] {
        &self.gif
    }

    /// The last frame.
    #[must_use]
    pub fn still(&self) -> &RgbImage {
        &self.still
    }

    /// Number of frames in the file.
    #[must_use]
    pub fn num_frames(&self) -> usize {
        self.num_frames
    }
}

/// Receives frames one by one and keeps only those that the GIF may show.
#[derive(Debug, Clone)]
pub struct AnimationRecorder {
    options: AnimationOptions,
    source_size: Option<(u32, u32)>,
    num_pushed: usize,
    frames: Vec<RgbImage>,
    /// The latest frame, if it was left out: the animation must show the end.
    left_out: Option<RgbImage>,
}

impl AnimationRecorder {
    /// An empty recording.
    ///
    /// # Panics
    /// If a rate, the speed or the width is not positive, or is infinite.
    #[must_use]
    pub fn new(options: AnimationOptions) -> Self {
        let rates = [options.source_fps, options.fps, options.speed];
        assert!(rates.iter().all(|rate| rate.is_finite() && *rate > 0.0), "rates are positive, found {rates:?}");
        assert!(options.max_width > 0, "an animation has columns");
        let options = AnimationOptions { fps: options.fps.min(50.0), ..options };
        Self { options, source_size: None, num_pushed: 0, frames: Vec::new(), left_out: None }
    }

    /// Adds the next frame of the recording.
    ///
    /// # Errors
    /// [`ReportError::FrameSize`] if the size differs from the first frame's, [`ReportError::PictureSize`] if the frame
    /// has no pixels.
    pub fn push(&mut self, frame: &RgbImage) -> Result<(), ReportError> {
        let found = frame.dimensions();
        if found.0 == 0 || found.1 == 0 {
            return Err(picture_size(found));
        }
        let expected = *self.source_size.get_or_insert(found);
        if found != expected {
            return Err(ReportError::FrameSize { frame_idx: self.num_pushed, expected, found });
        }
        // Frame k of the recording belongs at time k / (source_fps * speed).
        let step = (self.options.fps / (self.options.source_fps * self.options.speed)).min(1.0);
        let slot = |count: usize| (count as f64 * step + 1e-9).floor();
        let shown = self.num_pushed == 0 || slot(self.num_pushed) > slot(self.num_pushed - 1);
        self.num_pushed += 1;
        let small = fit_width(frame, self.options.max_width);
        if shown {
            self.frames.push(small);
            self.left_out = None;
        } else {
            self.left_out = Some(small);
        }
        Ok(())
    }

    /// Encodes the recording.
    ///
    /// # Errors
    /// [`ReportError::NoFrames`] if there is no frame, [`ReportError::PictureSize`] if a side exceeds GIF's limit of
    /// 65535, [`ReportError::Gif`] if the encoder rejects a frame.
    pub fn finish(mut self) -> Result<Animation, ReportError> {
        self.frames.extend(self.left_out.take());
        let Some(still) = self.frames.last().cloned() else {
            return Err(ReportError::NoFrames);
        };
        let shown_fps = self.options.fps.min(self.options.source_fps * self.options.speed);
        let mut best: Option<(Vec<u8>, usize)> = None;
        for economy in ECONOMIES {
            let candidate = encode_gif(&self.frames, shown_fps, self.options.hold_last_secs, economy)?;
            if best.as_ref().is_none_or(|(smallest, _)| candidate.0.len() < smallest.len()) {
                best = Some(candidate);
            }
            if best.as_ref().is_some_and(|(smallest, _)| smallest.len() <= self.options.max_bytes) {
                break;
            }
        }
        let (gif, num_frames) = best.ok_or(ReportError::NoFrames)?;
        Ok(Animation { gif, still, num_frames })
    }
}

/// Reductions for a smaller file.
#[derive(Debug, Clone, Copy)]
struct Economy {
    /// Maximum number of colours in the palette; one more entry means "unchanged".
    num_colors: usize,
    /// Maximum difference of each channel from the displayed value in a pixel that counts as unchanged.
    tolerance: u8,
    /// Every `stride`-th frame is kept, and the last one.
    stride: usize,
    /// Scale factor of the sides.
    scale: f64,
}

const ECONOMIES: [Economy; 7] = [
    Economy { num_colors: 255, tolerance: 4, stride: 1, scale: 1.0 },
    Economy { num_colors: 255, tolerance: 9, stride: 1, scale: 1.0 },
    Economy { num_colors: 127, tolerance: 12, stride: 1, scale: 1.0 },
    Economy { num_colors: 127, tolerance: 12, stride: 2, scale: 1.0 },
    Economy { num_colors: 127, tolerance: 14, stride: 2, scale: 0.75 },
    Economy { num_colors: 64, tolerance: 16, stride: 3, scale: 0.6 },
    Economy { num_colors: 64, tolerance: 20, stride: 5, scale: 0.5 },
];

fn picture_size((width, height): (u32, u32)) -> ReportError {
    ReportError::PictureSize { what: "a frame of an animation", width, height, limit: u32::from(u16::MAX) }
}

fn fit_width(frame: &RgbImage, max_width: u32) -> RgbImage {
    if frame.width() <= max_width {
        return frame.clone();
    }
    let height = (f64::from(frame.height()) * f64::from(max_width) / f64::from(frame.width())).round() as u32;
    imageops::resize(frame, max_width, height.max(1), FilterType::Triangle)
}

fn encode_gif(
    frames: &[RgbImage],
    fps: f64,
    hold_last_secs: f64,
    economy: Economy,
) -> Result<(Vec<u8>, usize), ReportError> {
    let last = frames.len() - 1;
    let kept: Vec<Cow<'_, RgbImage>> = frames
        .iter()
        .enumerate()
        .filter(|(idx, _)| idx % economy.stride == 0 || *idx == last)
        .map(|(_, frame)| {
            if economy.scale == 1.0 {
                return Cow::Borrowed(frame);
            }
            let width = (f64::from(frame.width()) * economy.scale).round().max(1.0) as u32;
            Cow::Owned(fit_width(frame, width))
        })
        .collect();
    let (width, height) = kept[0].dimensions();
    let (Ok(columns), Ok(rows)) = (u16::try_from(width), u16::try_from(height)) else {
        return Err(picture_size((width, height)));
    };

    let mut palette = Palette::of(&kept, economy.num_colors);
    let unchanged = palette.num_colors() as u8;
    let mut global = palette.rgb.concat();
    global.extend([0; 3]);

    let mut bytes = Vec::new();
    let failed = |source| ReportError::Gif { source };
    let mut encoder = Encoder::new(&mut bytes, columns, rows, &global).map_err(failed)?;
    encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
    let mut displayed: Vec<u8> = Vec::new();
    for (order, picture) in kept.iter().enumerate() {
        let indices: Vec<u8> = picture
            .pixels()
            .enumerate()
            .map(|(at, pixel)| match displayed.get(at) {
                Some(&shown) if palette.is_near(shown, pixel.0, economy.tolerance) => unchanged,
                Some(&shown) => Some(palette.index_of(pixel.0)).filter(|&idx| idx != shown).unwrap_or(unchanged),
                None => palette.index_of(pixel.0),
            })
            .collect();
        let (left, top, region_width, region_height) = changed_region(&indices, unchanged, columns, rows);
        let region = (0..usize::from(region_height))
            .flat_map(|row| {
                let start = (usize::from(top) + row) * usize::from(columns) + usize::from(left);
                indices[start..start + usize::from(region_width)].iter().copied()
            })
            .collect::<Vec<u8>>();
        // Delays are in hundredths of a second, and are rounded so that the total duration is kept.
        let ticks = |frame: usize| (frame as f64 * 100.0 * economy.stride as f64 / fps).round();
        let pause = if order + 1 == kept.len() { 100.0 * hold_last_secs.max(0.0) } else { 0.0 };
        let frame = Frame {
            // Browsers show a delay of less than 2 hundredths of a second as 10.
            delay: (ticks(order + 1) - ticks(order) + pause).clamp(2.0, 65_535.0) as u16,
            dispose: DisposalMethod::Keep,
            transparent: Some(unchanged),
            left,
            top,
            width: region_width,
            height: region_height,
            buffer: Cow::Owned(region),
            ..Frame::default()
        };
        encoder.write_frame(&frame).map_err(failed)?;
        if displayed.is_empty() {
            displayed = indices;
        } else {
            for (shown, &new) in displayed.iter_mut().zip(&indices).filter(|(_, new)| **new != unchanged) {
                *shown = new;
            }
        }
    }
    drop(encoder);
    Ok((bytes, kept.len()))
}

/// Left, top, width and height of the changed region; one pixel if there is no change, because a frame must not be
/// empty.
fn changed_region(indices: &[u8], unchanged: u8, columns: u16, rows: u16) -> (u16, u16, u16, u16) {
    let (mut left, mut top, mut right, mut bottom) = (columns, rows, 0, 0);
    for (row, line) in (0..rows).zip(indices.chunks_exact(usize::from(columns))) {
        let Some(first) = line.iter().position(|&idx| idx != unchanged) else {
            continue;
        };
        let past = line.iter().rposition(|&idx| idx != unchanged).map_or(first, |at| at + 1);
        left = left.min(first as u16);
        right = right.max(past as u16);
        top = top.min(row);
        bottom = row + 1;
    }
    if bottom == 0 { (0, 0, 1, 1) } else { (left, top, right - left, bottom - top) }
}

/// Colours for all frames.
struct Palette {
    rgb: Vec<[u8; 3]>,
    /// The nearest entry for each colour that was looked up.
    nearest: HashMap<[u8; 3], u8>,
}

/// The palette is computed from at most twice this number of pixels.
const PALETTE_SAMPLES: usize = 300_000;

impl Palette {
    /// The frames' own colours if there are few; otherwise a palette computed from evenly sampled pixels.
    fn of(frames: &[Cow<'_, RgbImage>], num_colors: usize) -> Self {
        let mut distinct = HashSet::new();
        let few = frames.iter().flat_map(|frame| frame.pixels()).all(|pixel| {
            distinct.insert(pixel.0);
            distinct.len() <= num_colors
        });
        let rgb = if few {
            let mut colors: Vec<[u8; 3]> = distinct.into_iter().collect();
            // Sorted, because a hash set has no fixed order and the same frames must give the same file.
            colors.sort_unstable();
            colors
        } else {
            let total: usize = frames.iter().map(|frame| frame.pixels().len()).sum();
            let step = (total / PALETTE_SAMPLES).max(1);
            let rgba: Vec<u8> = frames
                .iter()
                .flat_map(|frame| frame.pixels())
                .step_by(step)
                .flat_map(|pixel| [pixel.0[0], pixel.0[1], pixel.0[2], 255])
                .collect();
            NeuQuant::new(3, num_colors, &rgba).color_map_rgb().chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
        };
        Self { rgb, nearest: HashMap::new() }
    }

    fn num_colors(&self) -> usize {
        self.rgb.len()
    }

    fn index_of(&mut self, pixel: [u8; 3]) -> u8 {
        *self.nearest.entry(pixel).or_insert_with(|| {
            let distance = |color: &[u8; 3]| -> u32 {
                color.iter().zip(pixel).map(|(&a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
            };
            self.rgb.iter().zip(0..=u8::MAX).min_by_key(|(color, _)| distance(color)).map_or(0, |(_, idx)| idx)
        })
    }

    fn is_near(&self, index: u8, pixel: [u8; 3], tolerance: u8) -> bool {
        self.rgb[usize::from(index)].iter().zip(pixel).all(|(&a, b)| a.abs_diff(b) <= tolerance)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use image::Rgb;

    /// A square that moves two pixels per frame over a colour gradient.
    fn moving_square(num_frames: u32, width: u32, height: u32) -> Vec<RgbImage> {
        (0..num_frames)
            .map(|time| {
                RgbImage::from_fn(width, height, |x, y| {
                    if (10 + 2 * time..30 + 2 * time).contains(&x) && (10..30).contains(&y) {
                        Rgb([250, 120, 30])
                    } else {
                        Rgb([(x * 200 / width) as u8, (y * 200 / height) as u8, 90])
                    }
                })
            })
            .collect()
    }

    /// The frames as displayed, each drawn over the previous one, and their delays.
    fn decode(bytes: &[u8]) -> (Vec<RgbImage>, Vec<u16>) {
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes).unwrap();
        let (width, height) = (u32::from(decoder.width()), u32::from(decoder.height()));
        let mut screen = RgbImage::new(width, height);
        let (mut frames, mut delays) = (Vec::new(), Vec::new());
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            for (at, rgba) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, rgba)| rgba[3] > 0) {
                let (x, y) = (at as u32 % u32::from(frame.width), at as u32 / u32::from(frame.width));
                screen.put_pixel(u32::from(frame.left) + x, u32::from(frame.top) + y, Rgb([rgba[0], rgba[1], rgba[2]]));
            }
            frames.push(screen.clone());
            delays.push(frame.delay);
        }
        (frames, delays)
    }

    #[test]
    fn every_frame_comes_back_close_to_what_went_in() {
        let frames = moving_square(12, 160, 120);
        let animation = Animation::encode(&frames, &AnimationOptions::default()).unwrap();
        let (shown, delays) = decode(animation.gif());
        assert_eq!(shown.len(), 12);
        assert_eq!(animation.num_frames(), 12);
        for (before, after) in frames.iter().zip(&shown) {
            let total: u64 = before.as_raw().iter().zip(after.as_raw()).map(|(&a, &b)| u64::from(a.abs_diff(b))).sum();
            let mean = total as f64 / before.as_raw().len() as f64;
            assert!(mean < 4.0, "mean difference {mean} of 255");
        }
        // 12 frames per second: 100 hundredths of a second in total, and 150 more for the last frame.
        assert_eq!(delays.iter().map(|&d| u32::from(d)).sum::<u32>(), 250);
    }

    #[test]
    fn few_colours_come_back_exactly() {
        let frames: Vec<RgbImage> = (0..3)
            .map(|t| RgbImage::from_fn(9, 5, |x, _| if x == t { Rgb([255, 0, 7]) } else { Rgb([3, 2, 1]) }))
            .collect();
        let animation = Animation::encode(&frames, &AnimationOptions::default()).unwrap();
        assert_eq!(decode(animation.gif()).0, frames);
    }

    #[test]
    fn a_still_recording_costs_next_to_nothing() {
        let frames = vec![moving_square(1, 160, 120).remove(0); 50];
        let one = Animation::encode(&frames[..1], &AnimationOptions::default()).unwrap().gif().len();
        let fifty = Animation::encode(&frames, &AnimationOptions::default()).unwrap().gif().len();
        assert!(fifty < one + 50 * 40, "{fifty} bytes for fifty frames, {one} for one");
    }

    #[test]
    fn thinning_keeps_the_pace_and_the_last_frame() {
        let frames = moving_square(32, 80, 60);
        let options = AnimationOptions { source_fps: 30.0, fps: 10.0, hold_last_secs: 0.0, ..Default::default() };
        let animation = Animation::encode(&frames, &options).unwrap();
        // Frames 0, 3, …, 30, and 31 because it is the last.
        assert_eq!(animation.num_frames(), 12);
        assert_eq!(animation.still(), &frames[31]);
    }

    #[test]
    fn a_limit_is_kept_by_giving_up_frames_and_pixels() {
        let noisy: Vec<RgbImage> = (0..12u32)
            .map(|t| {
                RgbImage::from_fn(64, 48, |x, y| {
                    let hash = (x * 7919 + y * 104_729 + t * 1_299_709).wrapping_mul(2_654_435_761);
                    Rgb([(hash >> 24) as u8, (hash >> 16) as u8, (hash >> 8) as u8])
                })
            })
            .collect();
        let free = Animation::encode(&noisy, &AnimationOptions::default()).unwrap();
        let limit = free.gif().len() / 3;
        let tight = Animation::encode(&noisy, &AnimationOptions { max_bytes: limit, ..Default::default() }).unwrap();
        assert!(tight.gif().len() <= limit, "{} of {limit} bytes", tight.gif().len());
        assert!(tight.num_frames() < free.num_frames());
    }

    #[test]
    fn wide_frames_are_scaled_down() {
        let frames = moving_square(2, 640, 480);
        let animation = Animation::encode(&frames, &AnimationOptions::default()).unwrap();
        assert_eq!(animation.still().dimensions(), (320, 240));
        assert_eq!(decode(animation.gif()).0[0].dimensions(), (320, 240));
    }

    #[test]
    fn bad_frames_are_named() {
        let options = AnimationOptions::default();
        assert!(matches!(Animation::encode(&[], &options), Err(ReportError::NoFrames)));
        let empty = [RgbImage::new(0, 5)];
        assert!(matches!(Animation::encode(&empty, &options), Err(ReportError::PictureSize { .. })));
        let mixed = [RgbImage::new(4, 4), RgbImage::new(5, 4)];
        let message = Animation::encode(&mixed, &options).unwrap_err().to_string();
        assert!(message.contains("frame 1") && message.contains("4x4") && message.contains("5x4"), "{message}");
    }
}
