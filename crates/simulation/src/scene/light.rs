//! The lighting of the workcell.

use nalgebra::{Point3, Vector3};
use rand::Rng;
use rand_pcg::Pcg64Mcg;

use crate::fragment::MjcfFragment;
use crate::shapes::texture::Color;

/// A point near the centre of the camera's view, at which lamps are aimed (metres, base frame).
const AIM: Point3<f64> = Point3::new(0.5, 0.0, 0.0);

/// Radius around the aim within which shadows are rendered, in metres: slightly larger than the wrist camera's view.
const SHADOW_RADIUS_M: f64 = 0.5;

/// Fraction of a lamp's cone that its shadow map covers. The wide cone gives even light. The shadow map has the same
/// number of texels for any area: over this part of the cone, its shadows are sharp to a millimetre.
const SHADOW_PART_OF_CONE: f64 = 0.35;

/// The half angle of the cone, in degrees, for which a lamp's shadows reach [`SHADOW_RADIUS_M`].
fn cutoff_deg(distance_m: f64) -> f64 {
    ((SHADOW_RADIUS_M / distance_m).atan().to_degrees() / SHADOW_PART_OF_CONE).min(75.0)
}

/// A lamp above the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lamp {
    /// Position in the base frame, in metres.
    pub position: Point3<f64>,
    /// The point at which the lamp is aimed, in the base frame, in metres.
    pub target: Point3<f64>,
    /// Colour of the diffuse light times its strength, each channel from 0 to 1.
    pub diffuse: Color,
    /// Strength of the highlights.
    pub specular: f64,
    /// Half of the cone's angle, in degrees.
    pub cutoff_deg: f64,
    /// Whether the lamp casts shadows.
    pub casts_shadows: bool,
}

/// All light of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Lighting {
    /// Ambient light.
    pub ambient: Color,
    /// Light from the camera's direction, which represents the diffuse light of a bright hall.
    pub from_camera: Color,
    /// The lamps.
    pub lamps: Vec<Lamp>,
}

impl Lighting {
    /// The even light of demonstrations.
    pub fn nominal() -> Self {
        let lamp = |x: f64, y: f64, strength: f64, casts_shadows: bool| {
            let position = Point3::new(x, y, 1.5);
            Lamp {
                position,
                target: AIM,
                diffuse: [strength; 3],
                specular: 0.5,
                cutoff_deg: cutoff_deg((position - AIM).norm()),
                casts_shadows,
            }
        };
        Self {
            ambient: [0.32; 3],
            from_camera: [0.16; 3],
            lamps: vec![lamp(0.1, 0.7, 0.42, true), lamp(0.9, -0.6, 0.16, false)],
        }
    }

    /// Samples one to three lamps at random positions above the table, warm to cold white, strong or weak, and an
    /// amount of ambient light.
    pub fn sample(rng: &mut Pcg64Mcg) -> Self {
        let tint = |rng: &mut Pcg64Mcg| {
            let warmth = rng.random_range(-1.0..1.0);
            [1.0 + 0.08 * warmth, 1.0, 1.0 - 0.10 * warmth]
        };
        let scaled = |color: Color, strength: f64| color.map(|channel| (channel * strength).clamp(0.0, 1.0));
        // The total light stays within a camera's exposure range.
        let total = rng.random_range(0.62..1.10);
        let surrounding = rng.random_range(0.32..0.62);
        let num_lamps = rng.random_range(1..=3);
        let shares: Vec<f64> = (0..num_lamps).map(|_| rng.random_range(0.3..1.0)).collect();
        let sum: f64 = shares.iter().sum();
        let tint_of_hall = tint(rng);
        let lamps = shares
            .iter()
            .enumerate()
            .map(|(idx, share)| {
                let azimuth = rng.random_range(0.0..std::f64::consts::TAU);
                let elevation: f64 = rng.random_range(40f64..80.0).to_radians();
                let distance = rng.random_range(1.1..1.9);
                let direction =
                    Vector3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
                let aside = Vector3::new(rng.random_range(-0.12..0.12), rng.random_range(-0.12..0.12), 0.0);
                Lamp {
                    position: AIM + direction * distance,
                    target: AIM + aside,
                    diffuse: scaled(tint(rng), total * (1.0 - surrounding) * share / sum / elevation.sin()),
                    specular: rng.random_range(0.2..0.9) * share,
                    cutoff_deg: cutoff_deg(distance),
                    // Only two lamps cast shadows: a third shadow is hardly visible and costs another rendering pass.
                    casts_shadows: idx < 2,
                }
            })
            .collect();
        Self {
            ambient: scaled(tint_of_hall, total * surrounding * 0.7),
            from_camera: scaled(tint_of_hall, total * surrounding * 0.3),
            lamps,
        }
    }

    pub(super) fn fragment(&self) -> MjcfFragment {
        let rgb = |color: Color| format!("{:.4} {:.4} {:.4}", color[0], color[1], color[2]);
        let mut fragment = MjcfFragment::default();
        fragment.write(format_args!(
            "<visual><headlight ambient=\"{}\" diffuse=\"{}\" specular=\"0.05 0.05 0.05\"/>\
             <quality shadowsize=\"2048\" numquads=\"24\" offsamples=\"4\"/>\
             <map znear=\"0.005\" shadowscale=\"{SHADOW_PART_OF_CONE}\"/></visual>",
            rgb(self.ambient),
            rgb(self.from_camera)
        ));
        for (idx, lamp) in self.lamps.iter().enumerate() {
            let (p, d) = (lamp.position, (lamp.target - lamp.position).normalize());
            fragment.write(format_args!(
                "<worldbody><light name=\"lamp_{idx}\" pos=\"{:.4} {:.4} {:.4}\" dir=\"{:.5} {:.5} {:.5}\" \
                 diffuse=\"{}\" specular=\"{}\" ambient=\"0 0 0\" cutoff=\"{:.2}\" exponent=\"1\" \
                 castshadow=\"{}\"/></worldbody>",
                p.x,
                p.y,
                p.z,
                d.x,
                d.y,
                d.z,
                rgb(lamp.diffuse),
                rgb([lamp.specular; 3]),
                lamp.cutoff_deg,
                lamp.casts_shadows
            ));
        }
        fragment
    }
}
