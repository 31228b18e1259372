//! Lighting of the contacts of lines of sight.

use crate::recipe::Brushing;

use super::contents::Scene;
use super::ground::{Ground, Shadow};
use super::light::Lighting;
use super::placement::{Contact, Placement};
use super::view::{Sight, View};

/// Spacing, in pixels, of computed reflections in a smooth table; values in between are interpolated linearly.
const GLOSS_STEP_PX: usize = 4;

/// Spacing, in pixels, of computed reflections in a table with grain.
const RIPPLE_STEP_PX: usize = 2;

/// Slopes by which scratches tilt the normal of a brushed surface.
const BRUSHED_SLOPES: [f32; 3] = [-0.22, 0.0, 0.22];

/// The inputs of shading.
pub(crate) struct Shading<'a> {
    scene: &'a Scene,
    ground: Ground,
    shadows: Vec<Shadow>,
    contact_mm: f32,
    pub mm_per_px: f32,
    /// Light scattered upwards by the table.
    below: [f32; 3],
    /// For each body, its materials.
    surfaces: Vec<Vec<Surface>>,
    exposure: Exposure,
}

/// A material of a body, prepared for shading.
struct Surface {
    albedo: [f32; 3],
    reflectance: [f32; 3],
    gloss: f32,
    level: usize,
    brushing: Option<Scratches>,
}

/// Direction of scratches.
enum Scratches {
    /// Across a direction of the table.
    Across([f32; 2]),
    /// Around the body's origin.
    Around,
}

/// Positions and colours of a row of the table.
#[derive(Default)]
pub(crate) struct TableRow {
    places: Vec<[f32; 2]>,
    turned: Vec<[f32; 2]>,
    colors: Vec<[f32; 4]>,
}

impl<'a> Shading<'a> {
    /// Prepares shadows and the light on the table; the height grid has cells of `cell_px` pixels.
    pub fn new(scene: &'a Scene, cell_px: f32) -> Self {
        let mm_per_px = scene.view.mm_per_px();
        let mut ground = Ground::new(scene.view.ground(), cell_px * mm_per_px);
        scene.bodies.iter().for_each(|body| ground.put(body));
        let contact_mm = 6.0f32.max(3.0 * mm_per_px);
        ground.blur(contact_mm);
        let shadows: Vec<Shadow> =
            scene.lighting.lamps.iter().map(|lamp| ground.shadow(lamp.direction, lamp.radius)).collect();
        let exposure = Exposure::new(scene);
        ground.light_table(contact_mm, &shadows, |place, open, reached| {
            light_on_table(scene, &exposure, place, open, reached)
        });
        let surfaces = scene.bodies.iter().map(surfaces).collect();
        Self { scene, ground, shadows, contact_mm, mm_per_px, below: scene.table.mean(), surfaces, exposure }
    }

    /// Writes the light that reaches the camera from a row of the table: pixels from `first_px` on, at `py`.
    pub fn table_row(&self, view: &View, first_px: f32, py: f32, row: &mut TableRow, out: &mut [[f32; 3]]) {
        let Scene { lighting, table, .. } = self.scene;
        let sights = view.row(py);
        let sight = |k: usize| sights.at(first_px + k as f32);
        let TableRow { places, turned, colors } = row;
        places.clear();
        places.extend((0..out.len()).map(|k| sight(k).foot));
        colors.resize(out.len(), [0.0; 4]);
        table.colors(places, self.mm_per_px, turned, colors);
        if table.gloss <= 0.0 {
            for ((place, albedo), out) in places.iter().zip(colors.iter()).zip(out) {
                let light = self.ground.on_table(*place);
                *out = [0, 1, 2].map(|k| albedo[k] * light[k]);
            }
            return;
        }
        let mirrored_at = |k: usize, normal: [f32; 3]| {
            lighting.reflected(mirrored(towards_viewer(&sight(k)), normal), table.gloss_level)
        };
        let step = if table.ripple > 0.0 { RIPPLE_STEP_PX } else { GLOSS_STEP_PX };
        let surroundings_at = |x: usize| {
            if table.ripple > 0.0 {
                let slopes = table.slopes(sight(x).foot);
                mirrored_at(x, normalized([-slopes[0], -slopes[1], 1.0]))
            } else {
                mirrored_at(x, [0.0, 0.0, 1.0])
            }
        };
        let (mut seen, mut next) = ([0.0; 4], surroundings_at(0));
        for (x, ((place, albedo), out)) in places.iter().zip(colors.iter()).zip(out).enumerate() {
            let light = self.ground.on_table(*place);
            if x % step == 0 {
                seen = next;
                next = surroundings_at(x + step);
            }
            let share = (x % step) as f32 / step as f32;
            let surroundings = [0, 1, 2].map(|k| seen[k] + (next[k] - seen[k]) * share);
            *out = [0, 1, 2].map(|k| {
                let gloss = (table.gloss * (0.3 + 0.7 * albedo[k])).min(0.6);
                albedo[k] * light[k] + gloss * surroundings[k] * light[3]
            });
        }
    }

    /// The light from a point of a body to the camera.
    #[inline]
    pub fn body(&self, body: u8, contact: &Contact, sight: &Sight) -> [f32; 3] {
        let Scene { lighting, bodies, .. } = self.scene;
        let texel = &contact.texel;
        let surface = &self.surfaces[body as usize][texel.material as usize];
        let body = &bodies[body as usize];
        let place = sight.at(contact.z);
        let normal = if contact.is_on_wall() {
            normalized([contact.wall[0], contact.wall[1], 0.25])
        } else {
            let [x, y] = texel.normal.map(|n| f32::from(n) * (1.0 / 127.0));
            let [x, y] = body.direction_to_table([x, y]);
            [x, y, (1.0 - x * x - y * y).max(0.01).sqrt()]
        };
        let cell = self.ground.index(place);
        let open = self.ground.openness(cell, contact.z, self.contact_mm);
        // Vertical faces get their light from walls and from the table.
        let up = 0.5 + 0.5 * normal[2];
        let mut light = [0, 1, 2].map(|k| lighting.ambient[k] * open * (up + (1.0 - up) * 0.8 * self.below[k]));
        let mut lit = open;
        for (lamp, shadow) in lighting.lamps.iter().zip(&self.shadows) {
            let facing = dot(normal, lamp.direction).max(0.0);
            let reached = self.ground.light(shadow, cell, contact.z);
            lit *= 0.4 + 0.6 * reached;
            light = [0, 1, 2].map(|k| light[k] + lamp.color[k] * facing * reached);
        }
        let view = towards_viewer(sight);
        let seen = match &surface.brushing {
            None => self.surroundings(surface.level, view, normal),
            Some(scratches) => {
                let across = match scratches {
                    Scratches::Across(direction) => *direction,
                    Scratches::Around => {
                        let (x, y) = (place[0] - body.at[0], place[1] - body.at[1]);
                        let inverse = 1.0 / (x * x + y * y).sqrt().max(0.1);
                        [x * inverse, y * inverse]
                    }
                };
                let mut sum = [0.0f32; 3];
                for slope in BRUSHED_SLOPES {
                    let bent = [normal[0] + slope * across[0], normal[1] + slope * across[1], normal[2]];
                    let seen = self.surroundings(surface.level, view, normalized(bent));
                    (0..3).for_each(|k| sum[k] += seen[k]);
                }
                sum.map(|s| s * (1.0 / BRUSHED_SLOPES.len() as f32))
            }
        };
        let aside = 1.0 - dot(normal, view).clamp(0.0, 1.0);
        // Increase of reflectance at grazing angles by Fresnel (Schlick 1994).
        let grazing = aside * aside * (aside * aside) * aside * surface.gloss;
        let factor = self.exposure.at(place) * f32::from(texel.tone) * (1.0 / 128.0);
        [0, 1, 2].map(|k| {
            let reflectance = surface.reflectance[k] + (1.0 - surface.reflectance[k]) * grazing;
            factor * (surface.albedo[k] * light[k] + reflectance * seen[k] * lit)
        })
    }

    /// The light mirrored by a surface.
    #[inline(always)]
    fn surroundings(&self, level: usize, view: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
        let direction = mirrored(view, normal);
        let up = self.scene.lighting.reflected(direction, level);
        // Directions below the horizon hit the table.
        let sky = (direction[2] * 4.0 + 0.5).clamp(0.0, 1.0);
        [0, 1, 2].map(|k| up[k] * sky + (1.0 - sky) * self.below[k] * 0.7)
    }
}

fn surfaces(body: &Placement) -> Vec<Surface> {
    body.part
        .relief
        .materials
        .iter()
        .map(|material| Surface {
            albedo: material.albedo,
            reflectance: material.reflectance,
            gloss: 1.0 - material.roughness,
            level: Lighting::level_of(material),
            brushing: material.brushing.map(|brushing| match brushing {
                Brushing::Along(angle) => Scratches::Across(body.direction_to_table([-angle.sin(), angle.cos()])),
                Brushing::Around => Scratches::Around,
            }),
        })
        .collect()
}

/// Light on the table (red, green, blue) and a factor of its reflections.
#[inline]
fn light_on_table(scene: &Scene, exposure: &Exposure, place: [f32; 2], open: f32, reached: &[f32]) -> [f32; 4] {
    let factor = exposure.at(place);
    let [red, green, blue] = scene.lighting.ambient;
    let mut light = [red * open, green * open, blue * open, open];
    for (lamp, reached) in scene.lighting.lamps.iter().zip(reached) {
        let level = lamp.direction[2] * reached;
        light[3] *= 0.4 + 0.6 * reached;
        light[0] += lamp.color[0] * level;
        light[1] += lamp.color[1] * level;
        light[2] += lamp.color[2] * level;
    }
    [light[0] * factor, light[1] * factor, light[2] * factor, light[3] * factor]
}

/// Change of the light across the picture, and the shadow of an object outside.
struct Exposure {
    /// Relative change per millimetre in x and in y.
    gradient: [f32; 2],
    /// Coefficients of x and y, per millimetre, and a constant: their sum rises from 0 to 1 across the shadow's edge.
    edge: [f32; 3],
    strength: f32,
}

impl Exposure {
    fn new(scene: &Scene) -> Self {
        let across = scene.view.mm_per_px() * scene.view.width as f32;
        let gradient = scene.lighting.gradient.map(|g| g / across);
        let (edge, strength) = scene.far_shadow.map_or(([0.0; 3], 0.0), |(normal, distance, soft, strength)| {
            ([normal[0] / soft, normal[1] / soft, 0.5 - distance / soft], strength)
        });
        Self { gradient, edge, strength }
    }

    #[inline(always)]
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        let dark = (self.edge[0] * x + self.edge[1] * y + self.edge[2]).clamp(0.0, 1.0);
        let factor = 1.0 + self.gradient[0] * x + self.gradient[1] * y;
        (factor * (1.0 - self.strength * dark)).max(0.1)
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

/// The direction from a point on the line of sight to the camera.
#[inline(always)]
fn towards_viewer(sight: &Sight) -> [f32; 3] {
    normalized([sight.drift[0], sight.drift[1], 1.0])
}

/// The direction of the light that is mirrored towards the viewer.
#[inline(always)]
fn mirrored(view: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    let twice = 2.0 * dot(view, normal);
    [twice * normal[0] - view[0], twice * normal[1] - view[1], twice * normal[2] - view[2]]
}
