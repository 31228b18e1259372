//! Draws a scene: what each pixel meets, how it is lit, edges with more samples.

use crate::recipe::{Brushing, Material};

use super::ground::{Ground, Shadow};
use super::light::Lighting;
use super::placement::{Contact, Placement};
use super::table::Table;
use super::view::{Sight, View};

/// Marks pixels that meet no body.
pub(crate) const TABLE: u8 = u8::MAX;

/// Samples of a pixel on an edge.
const EDGE_SAMPLES: [[f32; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];

/// Cells of the grid of heights that shadows are made from, in pixels.
const GROUND_CELL_PX: f32 = 1.6;

/// Neighbouring pixels whose heights differ by more than this many pixels' width lie on an edge.
const EDGE_STEP_PX: f32 = 0.9;

/// Everything that is drawn.
pub(crate) struct Scene {
    pub view: View,
    pub lighting: Lighting,
    pub table: Table,
    pub bodies: Vec<Placement>,
    /// A shadow of something outside the picture: normal of its edge, distance, width of the edge, strength.
    pub far_shadow: Option<([f32; 2], f32, f32, f32)>,
}

/// What each pixel meets first.
#[derive(Debug, Clone, Copy)]
struct Seen {
    body: u8,
    contact: Contact,
}

/// The pixels of a body as if nothing covered it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Footprint {
    /// Pixels [x0, y0, x1, y1]; may reach outside the picture.
    pub bounds: [i32; 4],
    /// Whether each pixel's centre shows the body, row by row.
    pub shown: Vec<bool>,
}

/// A picture in linear light, and what it shows.
pub(crate) struct Rendered {
    pub light: Vec<[f32; 3]>,
    /// The body that each pixel's centre shows.
    pub ids: Vec<u8>,
    /// The first bodies' pixels.
    pub footprints: Vec<Footprint>,
}

impl Scene {
    /// Draws the picture, and the whole footprints of the first `num_footprints` bodies.
    pub fn render(&self, num_footprints: usize) -> Rendered {
        let (width, height) = (self.view.width, self.view.height);
        let mm_per_px = self.view.mm_per_px();
        let mut ground = Ground::new(self.view.ground(), GROUND_CELL_PX * mm_per_px);
        self.bodies.iter().for_each(|body| ground.put(body));
        let contact_mm = 6.0f32.max(3.0 * mm_per_px);
        ground.blur(contact_mm);
        let shadows: Vec<Shadow> =
            self.lighting.lamps.iter().map(|lamp| ground.shadow(lamp.direction, lamp.radius)).collect();
        ground.light_table(contact_mm, &shadows, |place, open, reached| self.light_on_table(place, open, reached));
        let shading = Shading { scene: self, ground: &ground, shadows: &shadows, contact_mm, mm_per_px };

        let mut seen = vec![Seen { body: TABLE, contact: Contact::default() }; width * height];
        let boxes: Vec<[i32; 4]> = self.bodies.iter().map(|body| body.picture_box(&self.view)).collect();
        let mut footprints = Vec::with_capacity(num_footprints);
        for (idx, &bounds) in boxes.iter().enumerate() {
            if idx < num_footprints {
                let area = (bounds[2] - bounds[0]) * (bounds[3] - bounds[1]);
                let mut shown = Vec::with_capacity(area as usize);
                self.meet_all(idx, bounds, &mut seen, |is_met| shown.push(is_met));
                footprints.push(Footprint { bounds, shown });
            } else {
                let inside = clipped(bounds, width, height).map(|v| v as i32);
                self.meet_all(idx, inside, &mut seen, |_| {});
            }
        }
        let mut light = Vec::with_capacity(width * height);
        for (y, row) in seen.chunks_exact(width).enumerate() {
            for (x, pixel) in row.iter().enumerate() {
                let sight = self.view.sight(x as f32 + 0.5, y as f32 + 0.5);
                light.push(match pixel.body {
                    TABLE => shading.table(&sight),
                    body => shading.body(body, &pixel.contact, &sight),
                });
            }
        }
        let boxes: Vec<[usize; 4]> = boxes.into_iter().map(|bounds| clipped(bounds, width, height)).collect();
        self.smooth_edges(&seen, &boxes, &shading, &mut light);
        Rendered { light, ids: seen.iter().map(|pixel| pixel.body).collect(), footprints }
    }

    /// Follows the sights of a box of pixels to a body and keeps what is nearest; `tell` learns of each pixel, row by row,
    /// whether it meets the body.
    fn meet_all(&self, idx: usize, bounds: [i32; 4], seen: &mut [Seen], mut tell: impl FnMut(bool)) {
        let body = &self.bodies[idx];
        let (width, height) = (self.view.width as i32, self.view.height as i32);
        let spans = body.row_spans(&self.view, bounds);
        for (y, [first, end]) in (bounds[1]..bounds[3]).zip(spans) {
            (bounds[0]..first).for_each(|_| tell(false));
            for x in first..end {
                let met = body.meet(&self.view.sight(x as f32 + 0.5, y as f32 + 0.5));
                tell(met.is_some());
                if let Some(contact) = met
                    && (0..width).contains(&x)
                    && (0..height).contains(&y)
                {
                    let pixel = &mut seen[(y * width + x) as usize];
                    if contact.z > pixel.contact.z {
                        *pixel = Seen { body: idx as u8, contact };
                    }
                }
            }
            (end..bounds[2]).for_each(|_| tell(false));
        }
    }

    /// Light on the table (red, green, blue) and a factor for what it mirrors.
    fn light_on_table(&self, place: [f32; 2], open: f32, reached: &[f32]) -> [f32; 4] {
        let exposure = self.exposure(place);
        let ambient = self.lighting.ambient;
        let mut light = [ambient[0] * open, ambient[1] * open, ambient[2] * open, open];
        for (lamp, reached) in self.lighting.lamps.iter().zip(reached) {
            light[3] *= 0.4 + 0.6 * reached;
            for k in 0..3 {
                light[k] += lamp.color[k] * lamp.direction[2] * reached;
            }
        }
        light.map(|l| l * exposure)
    }

    /// Change of the light across the picture, and shadows from outside.
    #[inline]
    fn exposure(&self, place: [f32; 2]) -> f32 {
        let across = self.view.mm_per_px() * self.view.width as f32;
        let g = self.lighting.gradient;
        let mut factor = 1.0 + (g[0] * place[0] + g[1] * place[1]) / across;
        if let Some((normal, distance, soft, strength)) = self.far_shadow {
            let d = normal[0] * place[0] + normal[1] * place[1] - distance;
            factor *= 1.0 - strength * (d / soft + 0.5).clamp(0.0, 1.0);
        }
        factor.max(0.1)
    }

    /// Draws pixels on edges anew, from several samples.
    fn smooth_edges(&self, seen: &[Seen], boxes: &[[usize; 4]], shading: &Shading, light: &mut [[f32; 3]]) {
        let (width, height) = (self.view.width, self.view.height);
        let step = EDGE_STEP_PX * shading.mm_per_px;
        let differ = |a: &Seen, b: &Seen| {
            a.body != b.body
                || (a.contact.z - b.contact.z).abs() > step
                || a.contact.texel.material != b.contact.texel.material
                || a.contact.is_on_wall() != b.contact.is_on_wall()
        };
        // Away from bodies there is no edge.
        let mut spans = vec![[width, 0]; height];
        for &[x0, y0, x1, y1] in boxes {
            for span in &mut spans[y0.saturating_sub(1)..(y1 + 1).min(height)] {
                *span = [span[0].min(x0.saturating_sub(1)), span[1].max((x1 + 1).min(width))];
            }
        }
        for (y, &[first, end]) in spans.iter().enumerate() {
            for x in first..end {
                let idx = y * width + x;
                let here = &seen[idx];
                let neighbours = [
                    (x > 0).then(|| idx - 1),
                    (x + 1 < width).then(|| idx + 1),
                    (y > 0).then(|| idx - width),
                    (y + 1 < height).then(|| idx + width),
                ];
                // Bodies that the pixel may show a piece of: its own and its neighbours'.
                let mut bodies = [here.body, TABLE, TABLE, TABLE, TABLE];
                let mut on_edge = false;
                for (slot, other) in bodies[1..].iter_mut().zip(neighbours.into_iter().flatten()) {
                    on_edge |= differ(here, &seen[other]);
                    *slot = seen[other].body;
                }
                if !on_edge {
                    continue;
                }
                bodies.sort_unstable();
                let mut sum = [0.0f32; 3];
                for [dx, dy] in EDGE_SAMPLES {
                    let sight = self.view.sight(x as f32 + dx, y as f32 + dy);
                    let mut nearest: Option<(u8, Contact)> = None;
                    for (k, &body) in bodies.iter().enumerate() {
                        if body == TABLE || (k > 0 && bodies[k - 1] == body) {
                            continue;
                        }
                        let [x0, y0, x1, y1] = boxes[body as usize];
                        if x < x0 || x >= x1 || y < y0 || y >= y1 {
                            continue;
                        }
                        if let Some(contact) = self.bodies[body as usize].meet(&sight)
                            && nearest.as_ref().is_none_or(|(_, other)| contact.z > other.z)
                        {
                            nearest = Some((body, contact));
                        }
                    }
                    let sample = match &nearest {
                        Some((body, contact)) => shading.body(*body, contact, &sight),
                        None => shading.table(&sight),
                    };
                    for k in 0..3 {
                        sum[k] += sample[k];
                    }
                }
                light[idx] = sum.map(|s| s / EDGE_SAMPLES.len() as f32);
            }
        }
    }
}

fn clipped(b: [i32; 4], width: usize, height: usize) -> [usize; 4] {
    let x = |v: i32| v.clamp(0, width as i32) as usize;
    let y = |v: i32| v.clamp(0, height as i32) as usize;
    [x(b[0]), y(b[1]), x(b[2]), y(b[3])]
}

/// What shading reads.
struct Shading<'a> {
    scene: &'a Scene,
    ground: &'a Ground,
    shadows: &'a [Shadow],
    contact_mm: f32,
    mm_per_px: f32,
}

impl Shading<'_> {
    #[inline]
    fn table(&self, sight: &Sight) -> [f32; 3] {
        let Scene { lighting, table, .. } = self.scene;
        let place = sight.foot;
        let albedo = table.color(place, self.mm_per_px);
        let light = self.ground.on_table(place);
        let mut color = [albedo[0] * light[0], albedo[1] * light[1], albedo[2] * light[2]];
        if table.gloss > 0.0 {
            let slopes = table.slopes(place);
            let reflection = mirrored(towards_viewer(sight), normalized([-slopes[0], -slopes[1], 1.0]));
            let seen = lighting.reflected(reflection, table.gloss_level);
            for k in 0..3 {
                color[k] += (table.gloss * (0.3 + 0.7 * albedo[k])).min(0.6) * seen[k] * light[3];
            }
        }
        color
    }

    #[inline]
    fn body(&self, body: u8, contact: &Contact, sight: &Sight) -> [f32; 3] {
        let Scene { lighting, table, bodies, .. } = self.scene;
        let body = &bodies[body as usize];
        let texel = &contact.texel;
        let material = &body.part.relief.materials[texel.material as usize];
        let place = sight.at(contact.z);
        let normal = if contact.is_on_wall() {
            normalized([contact.wall[0], contact.wall[1], 0.25])
        } else {
            let [x, y] = texel.normal.map(|n| f32::from(n) * (1.0 / 127.0));
            let [x, y] = body.direction_to_table([x, y]);
            [x, y, (1.0 - x * x - y * y).max(0.01).sqrt()]
        };
        let open = self.ground.openness(place, contact.z, self.contact_mm);
        // What faces sideways gets its light from walls and from the table.
        let up = 0.5 + 0.5 * normal[2];
        let below = table.mean();
        let mut light = [0, 1, 2].map(|k| lighting.ambient[k] * open * (up + (1.0 - up) * 0.8 * below[k]));
        let mut lit = open;
        for (lamp, shadow) in lighting.lamps.iter().zip(self.shadows) {
            let facing = dot(normal, lamp.direction);
            let reached = self.ground.light(shadow, place, contact.z);
            lit *= 0.4 + 0.6 * reached;
            if facing > 0.0 {
                for k in 0..3 {
                    light[k] += lamp.color[k] * facing * reached;
                }
            }
        }
        let view = towards_viewer(sight);
        let seen = self.reflection(material, body, place, normal, view, below);
        let facing = dot(normal, view).clamp(0.0, 1.0);
        let grazing = (1.0 - facing).powi(5) * (1.0 - material.roughness);
        let tone = f32::from(texel.tone) * (1.0 / 128.0);
        let exposure = self.scene.exposure(place);
        [0, 1, 2].map(|k| {
            let reflectance = material.reflectance[k] + (1.0 - material.reflectance[k]) * grazing;
            exposure * tone * (material.albedo[k] * light[k] + reflectance * seen[k] * lit)
        })
    }

    /// What a surface mirrors.
    #[inline]
    fn reflection(
        &self,
        material: &Material,
        body: &Placement,
        place: [f32; 2],
        normal: [f32; 3],
        view: [f32; 3],
        below: [f32; 3],
    ) -> [f32; 3] {
        let lighting = &self.scene.lighting;
        let level = Lighting::level_of(material);
        let look = |normal: [f32; 3]| {
            let direction = mirrored(view, normal);
            let up = lighting.reflected(direction, level);
            // Directions below the horizon meet the table.
            let sky = (direction[2] * 4.0 + 0.5).clamp(0.0, 1.0);
            [0, 1, 2].map(|k| up[k] * sky + (1.0 - sky) * below[k] * 0.7)
        };
        let Some(brushing) = material.brushing else { return look(normal) };
        let across = match brushing {
            Brushing::Along(angle) => body.direction_to_table([-angle.sin(), angle.cos()]),
            Brushing::Around => {
                let (x, y) = (place[0] - body.at[0], place[1] - body.at[1]);
                let radius = (x * x + y * y).sqrt().max(0.1);
                [x / radius, y / radius]
            }
        };
        let mut sum = [0.0f32; 3];
        for spread in [-0.22f32, 0.0, 0.22] {
            let bent = normalized([normal[0] + spread * across[0], normal[1] + spread * across[1], normal[2]]);
            let seen = look(bent);
            for k in 0..3 {
                sum[k] += seen[k];
            }
        }
        sum.map(|s| s / 3.0)
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn normalized(v: [f32; 3]) -> [f32; 3] {
    let norm = 1.0 / dot(v, v).sqrt();
    v.map(|c| c * norm)
}

/// From a point on the line of sight to the camera.
#[inline(always)]
fn towards_viewer(sight: &Sight) -> [f32; 3] {
    normalized([sight.drift[0], sight.drift[1], 1.0])
}

/// The direction from which light comes that is mirrored towards the viewer.
#[inline(always)]
fn mirrored(view: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    let twice = 2.0 * dot(view, normal);
    [twice * normal[0] - view[0], twice * normal[1] - view[1], twice * normal[2] - view[2]]
}
