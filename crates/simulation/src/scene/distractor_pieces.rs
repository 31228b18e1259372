//! Shapes and materials of distractors: the pieces of each kind, with size and finish sampled by a seed.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::distractor_kind::DistractorKind;
use crate::shapes::mesh::TriangleMesh;
use crate::shapes::solids::{
    box_solid, circle, cylinder, extrude, hex_prism, hexagon, lever_outline, lying_along_x, ring, rounded_path,
    rounded_rectangle, sweep, thread,
};
use crate::shapes::texture::{Color, Texture};

/// The material of a piece of a distractor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Finish {
    color: Color,
    look: Look,
    /// Density in kg/m³.
    pub density: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Look {
    Plastic,
    Printed,
    Brushed,
    Turned,
    Cast,
    RoundBar,
}

impl Finish {
    fn metal(rng: &mut Pcg64Mcg) -> Self {
        let colors = [
            ([0.62, 0.63, 0.65], 7850.0),
            ([0.50, 0.51, 0.53], 7850.0),
            ([0.30, 0.30, 0.31], 7850.0),
            ([0.76, 0.77, 0.78], 2700.0),
            ([0.74, 0.66, 0.42], 7850.0),
            ([0.78, 0.60, 0.30], 8500.0),
            ([0.70, 0.44, 0.30], 8900.0),
        ];
        let (color, density) = colors[rng.random_range(0..colors.len())];
        let looks = [Look::Brushed, Look::Turned, Look::Cast];
        Self { color: varied(color, rng), look: looks[rng.random_range(0..looks.len())], density }
    }

    fn plastic(rng: &mut Pcg64Mcg) -> Self {
        let colors = [
            [0.86, 0.40, 0.13],
            [0.80, 0.20, 0.14],
            [0.14, 0.30, 0.62],
            [0.16, 0.50, 0.26],
            [0.86, 0.74, 0.18],
            [0.13, 0.13, 0.14],
            [0.85, 0.85, 0.83],
            [0.45, 0.46, 0.48],
        ];
        let look = if rng.random_bool(0.6) { Look::Printed } else { Look::Plastic };
        Self { color: varied(colors[rng.random_range(0..colors.len())], rng), look, density: 1000.0 }
    }

    fn any(rng: &mut Pcg64Mcg) -> Self {
        if rng.random_bool(0.65) { Self::metal(rng) } else { Self::plastic(rng) }
    }

    pub fn is_metal(&self) -> bool {
        !matches!(self.look, Look::Plastic | Look::Printed)
    }

    pub fn texture(&self, seed: u64) -> Texture {
        match self.look {
            Look::Plastic => Texture::grained(64, self.color, 0.04, seed),
            Look::Printed => Texture::printed(128, self.color, 20.0, seed),
            Look::Brushed => Texture::brushed(96, self.color, 0.12, seed),
            Look::Turned => Texture::turned(96, self.color, 0.15, seed),
            Look::Cast => Texture::cast(96, self.color, 0.08, seed),
            Look::RoundBar => Texture::round_bar(64, self.color, 0.7, seed),
        }
    }
}

fn varied(color: Color, rng: &mut Pcg64Mcg) -> Color {
    color.map(|channel| (channel * rng.random_range(0.88..1.12)).clamp(0.02, 0.98))
}

/// A closed solid of one material.
pub(super) struct Piece {
    pub mesh: TriangleMesh,
    pub finish: Finish,
}

/// Lays a standing solid on its side: its axis becomes parallel to x, at `height`, and two flats become horizontal.
fn laid(mesh: TriangleMesh, x: f64, height: f64) -> TriangleMesh {
    let quarter = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2);
    mesh.transformed(&(Isometry3::translation(x, 0.0, 0.0) * lying_along_x(height) * quarter))
}

fn raised(mesh: TriangleMesh, z: f64) -> TriangleMesh {
    mesh.transformed(&Isometry3::translation(0.0, 0.0, z))
}

/// The pieces in the distractor's frame, with all lengths multiplied by `scale`.
pub(super) fn scaled_pieces(kind: DistractorKind, seed: u64, scale: f64) -> Vec<Piece> {
    let mut pieces = pieces(kind, seed);
    if scale != 1.0 {
        for vertex in pieces.iter_mut().flat_map(|piece| &mut piece.mesh.vertices) {
            vertex.position *= scale;
        }
    }
    pieces
}

/// The pieces in the distractor's frame: z points up in the resting pose, and the origin is near the centre.
fn pieces(kind: DistractorKind, seed: u64) -> Vec<Piece> {
    let rng = &mut Pcg64Mcg::seed_from_u64(seed);
    let any = Finish::any(rng);
    let metal = Finish::metal(rng);
    let one = |mesh: TriangleMesh, finish: Finish| vec![Piece { mesh: mesh.textured_from_above(0.04), finish }];
    match kind {
        DistractorKind::Bolt => {
            let radius = rng.random_range(0.004..0.0075);
            let length = rng.random_range(0.025..0.07);
            let pitch = radius * 0.34;
            let across = radius * 3.2;
            let mut mesh = laid(hex_prism(across, radius * 1.3, 0.0), 0.0, 0.0);
            let plain = length * 0.4;
            mesh.append(&laid(cylinder(radius, plain, 0.0, 24), radius * 1.3, 0.0));
            mesh.append(&laid(thread(radius, pitch, length - plain, 14), radius * 1.3 + plain, 0.0));
            // The bolt rests on a flat of its head and on the end of its thread.
            let tilt = ((across / 2.0 - radius) / (length + radius * 1.3)).atan();
            let turn = Isometry3::from_parts(
                Translation3::identity(),
                UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt),
            );
            one(mesh.transformed(&(turn * Isometry3::translation(-length / 2.0, 0.0, 0.0))), metal)
        }
        DistractorKind::Nut => {
            let across = rng.random_range(0.013..0.030);
            let height = across * rng.random_range(0.45..0.8);
            one(hex_prism(across, height, across * 0.29), metal)
        }
        DistractorKind::Washer => {
            let outer = rng.random_range(0.008..0.02);
            one(ring(outer * rng.random_range(0.4..0.65), outer, rng.random_range(0.0015..0.003), 0.0003, 40), metal)
        }
        DistractorKind::Plate => {
            let (length, width) = (rng.random_range(0.04..0.10), rng.random_range(0.025..0.05));
            let hole: f64 = rng.random_range(0.002..0.005);
            // The holes of a narrow plate keep a distance from each other.
            let (x, y) = (length / 2.0 - 0.009, (hole + 0.0015).max(width / 2.0 - 0.009));
            let mut holes: Vec<_> = [(x, y), (-x, y), (-x, -y), (x, -y)]
                .iter()
                .map(|&(x, y)| circle(Point2::new(x, y), hole, 20))
                .collect();
            if rng.random_bool(0.5) && width > 0.035 {
                holes.push(circle(Point2::origin(), rng.random_range(0.004..0.007), 28));
            }
            one(extrude(&rounded_rectangle(length, width, 0.004), &holes, rng.random_range(0.003..0.008), 0.0006), any)
        }
        DistractorKind::Bracket => {
            let (length, width, height) =
                (rng.random_range(0.03..0.06), rng.random_range(0.02..0.04), rng.random_range(0.015..0.03));
            let hole = circle(Point2::new(0.004, 0.0), 0.0035, 24);
            let mut mesh = extrude(&rounded_rectangle(length, width, 0.003), &[hole], 0.003, 0.0004);
            let wall = box_solid(0.003, width, height, 0.0005);
            mesh.append(&wall.transformed(&Isometry3::translation(-length / 2.0 + 0.0015, 0.0, 0.0)));
            one(mesh, metal)
        }
        DistractorKind::Dowel => {
            let radius = rng.random_range(0.003..0.009);
            let length = rng.random_range(0.03..0.14);
            let path = [Point3::new(-length / 2.0, 0.0, radius), Point3::new(length / 2.0, 0.0, radius)];
            bar(&path, radius, metal, rng)
        }
        DistractorKind::Bearing => {
            let outer = rng.random_range(0.013..0.026);
            let bore = outer * rng.random_range(0.35..0.5);
            let height = outer * 0.45;
            let gap = (outer - bore) * 0.3;
            let mut races = ring(outer - gap, outer, height, 0.0006, 48);
            races.append(&ring(bore, bore + gap, height, 0.0006, 40));
            let seal = raised(ring(bore + gap * 0.95, outer - gap * 0.95, height * 0.86, 0.0002, 40), height * 0.07);
            let seal_finish = Finish { color: [0.12, 0.12, 0.13], look: Look::Plastic, density: 1500.0 };
            let steel = Finish { color: varied([0.68, 0.69, 0.71], rng), look: Look::Turned, density: 7850.0 };
            vec![
                Piece { mesh: races.textured_from_above(0.06), finish: steel },
                Piece { mesh: seal.textured_from_above(0.04), finish: seal_finish },
            ]
        }
        DistractorKind::Block => {
            let (length, width) = (rng.random_range(0.02..0.06), rng.random_range(0.018..0.04));
            let bore =
                circle(Point2::new(length * rng.random_range(-0.2..0.2), 0.0), width * rng.random_range(0.15..0.3), 28);
            one(extrude(&rounded_rectangle(length, width, 0.002), &[bore], rng.random_range(0.01..0.03), 0.001), any)
        }
        DistractorKind::Gear => {
            let teeth = rng.random_range(12..28_usize);
            let outer = rng.random_range(0.016..0.03);
            let outline = gear_outline(teeth, outer);
            let bore = circle(Point2::origin(), outer * rng.random_range(0.2..0.35), 28);
            let height = rng.random_range(0.006..0.012);
            let mut mesh = extrude(&outline, &[bore], height, 0.0);
            if rng.random_bool(0.5) {
                mesh.append(&raised(ring(outer * 0.36, outer * 0.55, 0.005, 0.0006, 32), height - 0.0005));
            }
            one(mesh, any)
        }
        DistractorKind::BentTube => {
            let radius = rng.random_range(0.003..0.005);
            let reach = rng.random_range(0.04..0.08);
            let point = |x: f64, y: f64| Point3::new(x, y, radius);
            let sides = [rng.random_range(0.02..0.05), rng.random_range(-0.05..0.05)];
            let corners =
                [point(-reach, sides[0]), point(-reach * 0.45, 0.0), point(reach * 0.5, 0.0), point(reach, sides[1])];
            bar(&rounded_path(&corners, 0.010, 6), radius, metal, rng)
        }
        DistractorKind::Lever => {
            let half = rng.random_range(0.03..0.055);
            let (left, right): (f64, f64) = (rng.random_range(0.011..0.019), rng.random_range(0.011..0.022));
            let width = left.min(right) * rng.random_range(0.7..1.2);
            let outline = lever_outline((-half, left), (half, right), width, 0.006);
            let holes =
                [circle(Point2::new(-half, 0.0), left * 0.45, 28), circle(Point2::new(half, 0.0), right * 0.5, 28)];
            one(extrude(&outline, &holes, rng.random_range(0.006..0.014), 0.0008), any)
        }
        DistractorKind::EyeBolt => {
            let outer = rng.random_range(0.014..0.022);
            let thick = outer * 0.36;
            let shank = outer * 0.3;
            let length = rng.random_range(0.035..0.06);
            let around: Vec<Point3<f64>> = (0..=28)
                .map(|step| {
                    let angle = TAU * f64::from(step % 28) / 28.0;
                    Point3::new((outer - thick / 2.0) * angle.cos(), (outer - thick / 2.0) * angle.sin(), 0.0)
                })
                .collect();
            let mut mesh = sweep(&around, thick / 2.0, 14);
            mesh.append(&laid(thread(shank, shank * 0.36, length, 14), outer - thick * 0.4, 0.0));
            one(mesh.transformed(&Isometry3::translation(-length / 2.0, 0.0, 0.0)), metal)
        }
        DistractorKind::Spring => {
            let (coil, wire) = (rng.random_range(0.006..0.011), rng.random_range(0.0009..0.0016));
            let turns = rng.random_range(6..12);
            let length = f64::from(turns) * wire * rng.random_range(2.6..3.6);
            let steps = turns * 14;
            let path: Vec<Point3<f64>> = (0..=steps)
                .map(|step| {
                    let part = f64::from(step) / f64::from(steps);
                    let angle = TAU * f64::from(turns) * part;
                    Point3::new(length * (part - 0.5), coil * angle.cos(), coil * angle.sin())
                })
                .collect();
            let finish = Finish { color: varied([0.55, 0.56, 0.58], rng), look: Look::RoundBar, density: 7850.0 };
            vec![Piece { mesh: sweep(&path, wire, 8), finish }]
        }
        DistractorKind::Shaft => {
            let big = rng.random_range(0.007..0.012);
            let small = big * rng.random_range(0.5..0.8);
            let (middle, end) = (rng.random_range(0.02..0.05), rng.random_range(0.015..0.035));
            let mut mesh = laid(cylinder(big, middle, 0.0008, 28), -middle / 2.0, big);
            mesh.append(&laid(cylinder(small, end, 0.0006, 24), middle / 2.0 - 0.0001, big));
            mesh.append(&laid(cylinder(small * 0.9, end * 0.6, 0.0006, 24), -middle / 2.0 - end * 0.6 + 0.0001, big));
            one(mesh, metal)
        }
        DistractorKind::Flange => {
            let outer = rng.random_range(0.02..0.034);
            let num_holes = rng.random_range(3..=6);
            let mut holes = vec![circle(Point2::origin(), outer * 0.32, 32)];
            holes.extend((0..num_holes).map(|idx| {
                let angle = TAU * f64::from(idx) / f64::from(num_holes);
                circle(Point2::from(Vector2::new(angle.cos(), angle.sin()) * outer * 0.74), outer * 0.1, 16)
            }));
            let mut mesh = extrude(&circle(Point2::origin(), outer, 56), &holes, 0.006, 0.0006);
            mesh.append(&raised(ring(outer * 0.32, outer * 0.52, 0.009, 0.0008, 40), 0.0055));
            one(mesh, any)
        }
        DistractorKind::Spanner => {
            let half = rng.random_range(0.045..0.06);
            let width = rng.random_range(0.009..0.012);
            let (left, right) = (width * 1.15, width * 0.95);
            let outline = lever_outline((-half, left), (half, right), width, 0.006);
            let hex: Vec<_> = hexagon(left * 1.1).iter().map(|p| p + Vector2::new(-half, 0.0)).collect();
            let holes = [hex, circle(Point2::new(half, 0.0), right * 0.5, 24)];
            one(extrude(&outline, &holes, 0.005, 0.0008), Finish { look: Look::Brushed, ..metal })
        }
    }
}

/// A round bar along a path, usually with the bands of a round bar instead of its own finish.
fn bar(path: &[Point3<f64>], radius: f64, finish: Finish, rng: &mut Pcg64Mcg) -> Vec<Piece> {
    let look = if rng.random_bool(0.8) { Look::RoundBar } else { finish.look };
    vec![Piece { mesh: sweep(path, radius, 18), finish: Finish { look, ..finish } }]
}

fn gear_outline(teeth: usize, outer: f64) -> Vec<Point2<f64>> {
    let depth = outer * (2.2 / teeth as f64).min(0.16);
    let root = outer - depth;
    let pitch_angle = TAU / teeth as f64;
    (0..teeth)
        .flat_map(|tooth| {
            let start = tooth as f64 * pitch_angle;
            [(0.0, root), (0.28, root), (0.42, outer), (0.62, outer), (0.76, root)].map(|(part, radius)| {
                let angle = start + part * pitch_angle;
                Point2::new(radius * angle.cos(), radius * angle.sin())
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// MuJoCo rejects a mesh in which two faces contain the same edge in the same direction.
    #[test]
    fn no_edge_is_walked_twice_in_one_direction() {
        for kind in DistractorKind::ALL {
            // The last seeds give tubes with nearly straight corners, and a narrow plate with large holes.
            for seed in (0..12).chain([453, 1383, 1453, 6896900381503141468]) {
                for piece in pieces(kind, seed) {
                    let obj = piece.mesh.to_obj();
                    let mut edges = std::collections::HashSet::new();
                    for line in obj.lines().filter(|line| line.starts_with("f ")) {
                        let face: Vec<&str> = line.split([' ', '/']).skip(1).step_by(3).collect();
                        for corner in 0..3 {
                            assert!(
                                edges.insert((face[corner].to_owned(), face[(corner + 1) % 3].to_owned())),
                                "{kind:?} {seed}: {line}"
                            );
                        }
                    }
                }
            }
        }
    }
}
