//! Distractors, drawn from figures or from pieces of the part.

use nalgebra::{Point2, Rotation2, Vector2};

use super::distance::BAND_PX;
use super::figure::Figure;
use super::mutant::Mutant;
use super::noise::NoiseTile;
use super::prepared::Prepared;
use super::random::{SampleRng, chance, direction, index_below, uniform};
use crate::raster::{PixelRect, Raster, blend, smoothstep};

/// Width of the widest frame in which the shadows of cut-outs keep the drawn softness, in pixels: the samples of usual
/// photos, on which the networks were measured, stay the same.
const MAX_USUAL_WIDTH: usize = 1100;

/// The direction of a scene's light and the softness of its shadows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lamp {
    /// Towards the light, in the image plane.
    pub towards: [f32; 2],
    /// Height of the light: the third component of the unit vector towards it.
    pub elevation: f32,
    /// Fraction of the light that a shadow removes, in `[0, 1]`.
    pub shadow: f32,
    /// Displacement of a shadow, in pixels.
    pub shadow_shift_px: f32,
    /// Half the width of a shadow's edge, in pixels.
    pub shadow_softness_px: f32,
}

impl Lamp {
    pub fn draw(rng: &mut SampleRng, output_scale: f32) -> Self {
        let elevation = uniform(rng, 0.5, 0.95);
        Self {
            towards: direction(rng),
            elevation,
            shadow: if chance(rng, 0.8) { uniform(rng, 0.15, 0.7) } else { 0.0 },
            shadow_shift_px: uniform(rng, 1.0, 9.0) * output_scale,
            shadow_softness_px: uniform(rng, 1.0, 7.0) * output_scale,
        }
    }

    /// The softness of a cut-out's shadow, whose distances from the outline are known up to `band_px`: a softer shadow
    /// does not end within the band, so that it would darken a rectangle around the cut-out.
    pub fn cut_out_softness_px(&self, band_px: f32, frame_width: usize) -> f32 {
        let limit = if frame_width > MAX_USUAL_WIDTH { band_px } else { f32::INFINITY };
        self.shadow_softness_px.min(limit)
    }
}

/// The surface of a drawn distractor.
enum Material<'a> {
    Plain {
        color: [f32; 3],
        grain: f32,
        gloss: f32,
    },
    /// The part's own surface, mapped onto the figure.
    PartSurface {
        part: &'a Prepared,
    },
}

/// A figure placed on the canvas.
pub(crate) struct Distractor<'a> {
    figure: Figure,
    material: Material<'a>,
    pub center: [f32; 2],
    /// Cosine and sine of the angle.
    turn: [f32; 2],
    /// Canvas pixels per unit of the figure.
    pub size_px: f32,
    grain_at: [f32; 2],
}

impl<'a> Distractor<'a> {
    pub fn new(figure: Figure, center: [f32; 2], size_px: f32, part: &'a Prepared, rng: &mut SampleRng) -> Self {
        let material = if chance(rng, 0.12) {
            Material::PartSurface { part }
        } else {
            let color = draw_color(part, rng);
            Material::Plain { color, grain: uniform(rng, 0.0, 0.3), gloss: uniform(rng, 0.0, 0.6) }
        };
        let grain_at = [uniform(rng, 0.0, 256.0), uniform(rng, 0.0, 256.0)];
        Self { figure, material, center, turn: direction(rng), size_px, grain_at }
    }

    /// Distance in pixels from a point on the canvas to the outline, negative inside.
    #[inline]
    pub fn distance_px(&self, x: f32, y: f32) -> f32 {
        let (u, v) = self.local(x, y);
        self.figure.distance(u, v) * self.size_px
    }

    #[inline(always)]
    fn local(&self, x: f32, y: f32) -> (f32, f32) {
        let (dx, dy) = ((x - self.center[0]) / self.size_px, (y - self.center[1]) / self.size_px);
        (dx * self.turn[0] + dy * self.turn[1], dy * self.turn[0] - dx * self.turn[1])
    }

    fn covered(&self, margin: f32, canvas: &Raster) -> PixelRect {
        let reach = 1.45 * self.size_px;
        let [x, y] = self.center;
        PixelRect::covering([x - reach, y - reach, x + reach, y + reach], margin, canvas.width, canvas.height)
    }

    /// Paints the distractor and its shadow.
    pub fn paint(&self, canvas: &mut Raster, lamp: &Lamp, noise: &NoiseTile) {
        if lamp.shadow > 0.0 {
            let (shift, soft) = (lamp.shadow_shift_px, lamp.shadow_softness_px);
            let rect = self.covered(shift + soft, canvas);
            for y in rect.y1..rect.y2 {
                for x in rect.x1..rect.x2 {
                    let (px, py) = (x as f32 + 0.5 + shift * lamp.towards[0], y as f32 + 0.5 + shift * lamp.towards[1]);
                    let dark = lamp.shadow * smoothstep(soft, -soft, self.distance_px(px, py));
                    if dark > 0.0 {
                        blend(&mut canvas.pixels[y * canvas.width + x], [0.0; 3], dark);
                    }
                }
            }
        }
        let rect = self.covered(1.0, canvas);
        for y in rect.y1..rect.y2 {
            for x in rect.x1..rect.x2 {
                let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
                let distance = self.distance_px(px, py);
                if distance < 0.7 {
                    let alpha = (0.5 - distance / 1.4).clamp(0.0, 1.0);
                    let color = self.color(px, py, distance, lamp, noise);
                    blend(&mut canvas.pixels[y * canvas.width + x], color, alpha);
                }
            }
        }
    }

    fn color(&self, x: f32, y: f32, distance: f32, lamp: &Lamp, noise: &NoiseTile) -> [f32; 3] {
        // The rim has the profile of a quarter circle; inside it the surface is flat.
        let rim = (self.figure.rim * self.size_px).max(0.5);
        let steepness = (1.0 + distance / rim).clamp(0.0, 0.95);
        let (mut diffuse, mut shine) = (lamp.elevation, 0.0);
        if steepness > 0.0 {
            const STEP: f32 = 0.5;
            let gx = (self.distance_px(x + STEP, y) - distance) / STEP;
            let gy = (self.distance_px(x, y + STEP) - distance) / STEP;
            let up = (1.0 - steepness * steepness).sqrt();
            let flat = (1.0 - lamp.elevation * lamp.elevation).sqrt();
            diffuse = (steepness * flat * (gx * lamp.towards[0] + gy * lamp.towards[1]) + up * lamp.elevation).max(0.0);
            // Vertical component of the mirrored light: the camera is above.
            let mirrored = (2.0 * diffuse * up - lamp.elevation).max(0.0);
            shine = mirrored.powi(8);
        }
        match &self.material {
            Material::Plain { color, grain, gloss } => {
                let texture = noise.at(x * 1.7 + self.grain_at[0], y * 1.7 + self.grain_at[1]) - 0.5;
                let light = (0.4 + 0.6 * diffuse / lamp.elevation) * (1.0 + grain * texture);
                color.map(|c| c * light + gloss * shine)
            }
            Material::PartSurface { part } => {
                let (u, v) = self.local(x, y);
                let reach = 0.55 * part.radius as f32;
                let scale = part.prepared_from_photo as f32;
                let at = [part.center.x as f32 + u * reach, part.center.y as f32 + v * reach];
                let [r, g, b, _] = part.photo.bilinear(at[0] * scale, at[1] * scale);
                [r, g, b].map(|c| c * (0.5 + 0.5 * diffuse / lamp.elevation))
            }
        }
    }
}

/// Steel, brass, copper, black and coloured plastic, or a colour of the part itself.
fn draw_color(part: &Prepared, rng: &mut SampleRng) -> [f32; 3] {
    let level = uniform(rng, 0.6, 1.3);
    let tint = match index_below(rng, 8) {
        0 | 1 => part.colors[index_below(rng, part.colors.len())],
        2 => [0.62, 0.64, 0.67],
        3 => [0.33, 0.34, 0.36],
        4 => [0.72, 0.6, 0.33],
        5 => [0.68, 0.44, 0.33],
        6 => [0.09, 0.09, 0.1],
        _ => [uniform(rng, 0.05, 0.8), uniform(rng, 0.05, 0.8), uniform(rng, 0.05, 0.8)],
    };
    tint.map(|c| c * level)
}

/// Paints a mutant of the part, centred at `center`, with `scale` canvas pixels per photo pixel.
pub(crate) fn paint_mutant(
    canvas: &mut Raster,
    part: &Prepared,
    mutant: &Mutant,
    center: [f32; 2],
    scale: f32,
    lamp: &Lamp,
    rng: &mut SampleRng,
) {
    let photo_from_canvas = Rotation2::new(uniform(rng, 0.0, std::f32::consts::TAU)).into_inner() / scale;
    let gain: [f32; 3] = std::array::from_fn(|_| uniform(rng, 0.85, 1.15));
    let prepared = part.prepared_from_photo as f32;
    let part_center: Point2<f32> = part.center.cast();
    // Distance inside, in canvas pixels, and the prepared pixel shown there.
    let look_up = |x: f32, y: f32| {
        let (source, kept) = mutant.source(photo_from_canvas * Vector2::new(x - center[0], y - center[1]));
        let at = (part_center + source) * prepared;
        let inside_photo =
            at.x > 0.0 && at.y > 0.0 && at.x < part.photo.width as f32 && at.y < part.photo.height as f32;
        let pixel = part.photo.bilinear(at.x, at.y);
        let inside = if inside_photo { (pixel[3] / prepared).min(kept) * scale } else { -1e6 };
        (inside, pixel)
    };
    let reach = mutant.radius * scale;
    let bounds = [center[0] - reach, center[1] - reach, center[0] + reach, center[1] + reach];
    if lamp.shadow > 0.0 {
        let shift = lamp.shadow_shift_px;
        let soft = lamp.cut_out_softness_px(BAND_PX / prepared * scale, canvas.frame_width);
        let rect = PixelRect::covering(bounds, shift + soft, canvas.width, canvas.height);
        for y in rect.y1..rect.y2 {
            for x in rect.x1..rect.x2 {
                let (px, py) = (x as f32 + 0.5 + shift * lamp.towards[0], y as f32 + 0.5 + shift * lamp.towards[1]);
                let dark = lamp.shadow * smoothstep(-soft, soft, look_up(px, py).0);
                if dark > 0.0 {
                    blend(&mut canvas.pixels[y * canvas.width + x], [0.0; 3], dark);
                }
            }
        }
    }
    let rect = PixelRect::covering(bounds, 1.0, canvas.width, canvas.height);
    for y in rect.y1..rect.y2 {
        for x in rect.x1..rect.x2 {
            let (inside, pixel) = look_up(x as f32 + 0.5, y as f32 + 0.5);
            // Edges lie slightly inside, so that no rim of the photo's background is included.
            let alpha = smoothstep(0.0, 1.4, inside);
            if alpha > 0.0 {
                let color = std::array::from_fn(|k| pixel[k] * gain[k]);
                blend(&mut canvas.pixels[y * canvas.width + x], color, alpha);
            }
        }
    }
}
