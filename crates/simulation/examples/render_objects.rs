//! Builds the three parts under `datasets/objects`: meshes, textures, MJCF and metadata.
//!
//! `cargo run --release -p sdg-simulation --example render_objects [FOLDER]`
//!
//! Every part is of our own making. The object frame has z up, its origin on the table under the middle of the
//! grasp marks, x along the marks from `grasp_start` to `grasp_end`. All lengths below are in metres.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Translation3, UnitQuaternion, Vector3};
use sdg_simulation::scene::mesh::TriangleMesh;
use sdg_simulation::scene::solids::{
    box_solid, circle, cylinder, extrude, hex_prism, lathe, lever_outline, lying_along_x, ring, rounded_path, sweep,
    thread,
};
use sdg_simulation::scene::texture::Texture;

/// Densities in kg/m³.
const STEEL: f64 = 7850.0;
const BRASS: f64 = 8500.0;
/// Printed plastic at the usual sparse infill.
const PRINTED: f64 = 900.0;
const RUBBER: f64 = 1200.0;

/// A visible piece of a part.
struct Piece {
    name: &'static str,
    mesh: TriangleMesh,
    density: f64,
    material: &'static str,
}

/// How a surface looks.
struct Finish {
    name: &'static str,
    texture: Texture,
    specular: f64,
    shininess: f64,
}

struct Part {
    name: &'static str,
    title: &'static str,
    description: &'static str,
    pieces: Vec<Piece>,
    finishes: Vec<Finish>,
    /// MJCF attributes of convex collision shapes.
    collisions: Vec<String>,
    grasp_half_line: f64,
    jaw_width: f64,
    grasp_height: f64,
    mark_height: f64,
    friction: f64,
}

fn main() -> std::io::Result<()> {
    let default = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../datasets/objects");
    let folder = std::env::args().nth(1).map_or(default, PathBuf::from);
    for part in [pendulum(), fuel_line(), rod_end()] {
        write_part(&folder.join(part.name), &part)?;
    }
    Ok(())
}

fn moved(mesh: TriangleMesh, x: f64, y: f64, z: f64) -> TriangleMesh {
    mesh.transformed(&Isometry3::translation(x, y, z))
}

/// Centres the texture on a piece's own origin, one repeat over `metres`.
fn centred_texture(mesh: TriangleMesh, metres: f64) -> TriangleMesh {
    let mut mesh = mesh.textured_from_above(metres);
    for vertex in &mut mesh.vertices {
        vertex.texcoord += nalgebra::Vector2::repeat(0.5);
    }
    mesh
}

/// Printed lever of the Cranfield assembly: a hub with a steel bushing, an arm, a heavy bob with a brass slug.
fn pendulum() -> Part {
    let (hub, bob) = ((-0.070, 0.0155), (0.044, 0.027));
    let arm_width = 0.016;
    let body = extrude(
        &lever_outline(hub, bob, arm_width, 0.009),
        &[circle(Point2::new(hub.0, 0.0), 0.008, 32), circle(Point2::new(bob.0, 0.0), 0.009, 32)],
        0.016,
        0.0012,
    )
    .textured_from_above(0.04);
    let printed = |mesh: TriangleMesh| mesh.textured_from_above(0.04);
    let mut raised = printed(moved(ring(0.008, 0.0132, 0.007, 0.0008, 40), hub.0, 0.0, 0.0155));
    raised.append(&printed(moved(ring(0.0165, 0.0245, 0.0045, 0.0010, 56), bob.0, 0.0, 0.0155)));
    let pointer = [Point2::new(0.0685, -0.0075), Point2::new(0.081, 0.0), Point2::new(0.0685, 0.0075)];
    raised.append(&printed(extrude(&pointer, &[], 0.010, 0.0010)));
    Part {
        name: "pendulum",
        title: "Pendulum",
        description: "Pendulum after the Cranfield assembly benchmark: printed lever, 166 mm long, with a bushed hub, \
                      a bob weighted by a brass slug, and a pointer",
        pieces: vec![
            Piece { name: "body", mesh: body, density: PRINTED, material: "printed" },
            Piece { name: "raised", mesh: raised, density: PRINTED, material: "printed" },
            Piece {
                name: "bushing",
                mesh: centred_texture(ring(0.006, 0.0082, 0.0238, 0.0006, 32), 0.02)
                    .transformed(&Isometry3::translation(hub.0, 0.0, 0.0)),
                density: STEEL,
                material: "steel",
            },
            Piece {
                name: "slug",
                mesh: centred_texture(cylinder(0.0091, 0.0172, 0.0007, 32), 0.02)
                    .transformed(&Isometry3::translation(bob.0, 0.0, 0.0)),
                density: BRASS,
                material: "brass",
            },
        ],
        finishes: vec![
            Finish {
                name: "printed",
                texture: Texture::printed(256, [0.86, 0.40, 0.13], 26.0, 11),
                specular: 0.15,
                shininess: 0.2,
            },
            Finish {
                name: "steel",
                texture: Texture::turned(64, [0.68, 0.69, 0.71], 0.18, 12),
                specular: 0.6,
                shininess: 0.5,
            },
            Finish {
                name: "brass",
                texture: Texture::turned(64, [0.80, 0.64, 0.32], 0.16, 13),
                specular: 0.5,
                shininess: 0.5,
            },
        ],
        collisions: vec![
            format!("type=\"box\" pos=\"-0.013 0 0.008\" size=\"0.050 {} 0.008\"", arm_width / 2.0),
            format!("type=\"cylinder\" pos=\"{} 0 0.01125\" size=\"{} 0.01125\"", hub.0, hub.1),
            format!("type=\"cylinder\" pos=\"{} 0 0.010\" size=\"{} 0.010\"", bob.0, bob.1),
        ],
        grasp_half_line: 0.024,
        jaw_width: arm_width,
        grasp_height: 0.009,
        mark_height: 0.016,
        friction: 0.6,
    }
}

/// Injection line of a Diesel engine: a bent steel tube with two union nuts of different make and a clip.
fn fuel_line() -> Part {
    let height = 0.0095;
    let point = |x: f64, y: f64| Point3::new(x, y, height);
    let corners =
        [point(-0.088, 0.046), point(-0.050, 0.0), point(0.042, 0.0), point(0.064, -0.040), point(0.098, -0.040)];
    let tube_radius = 0.004;
    let path = rounded_path(&corners, 0.014, 8);
    let tube = sweep(&path, tube_radius, 20);

    // A lying solid's +x turned to the direction of a straight piece of the tube, `along` metres from its start.
    let on_tube = |from: usize, along: f64| {
        let direction = (corners[from + 1] - corners[from]).normalize();
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), direction.y.atan2(direction.x));
        Isometry3::from_parts(Translation3::from(corners[from] + direction * along), yaw)
    };
    let last = corners.len() - 2;
    let last_length = (corners[last + 1] - corners[last]).norm();
    // The quarter turn lays two of the flats level.
    let lying = lying_along_x(0.0) * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI / 2.0);
    let lay = |mesh: TriangleMesh, along: f64| mesh.transformed(&(Isometry3::translation(along, 0.0, 0.0) * lying));

    // Male union at the start: cone, thread, hexagon. Female union nut at the end: hexagon and a round collar.
    let mut nuts = lay(hex_prism(0.019, 0.012, 0.0), 0.004).transformed(&on_tube(0, 0.0));
    nuts.append(&lay(cylinder(0.0078, 0.004, 0.0008, 32), 0.016).transformed(&on_tube(0, 0.0)));
    nuts.append(&lay(hex_prism(0.019, 0.017, 0.0), -0.009).transformed(&on_tube(last, last_length)));
    nuts.append(&lay(cylinder(0.0082, 0.006, 0.0010, 32), -0.015).transformed(&on_tube(last, last_length)));
    let mut ends = lay(thread(0.0068, 0.0022, 0.010, 20), -0.0055).transformed(&on_tube(0, 0.0));
    let cone = lathe(&[(0.0, 0.0), (0.0032, 0.0), (0.0050, 0.004), (0.0, 0.004)], 24);
    ends.append(&lay(cone, -0.0092).transformed(&on_tube(0, 0.0)));
    ends.append(&lay(ring(0.0035, 0.0066, 0.0015, 0.0004, 28), 0.0075).transformed(&on_tube(last, last_length)));

    let clip_place = on_tube(2, 0.0225);
    let mut clip = box_solid(0.013, 0.017, 0.0150, 0.0015).textured_from_above(0.03);
    clip.append(&moved(box_solid(0.009, 0.006, 0.0035, 0.0006), 0.0, 0.0065, 0.0148));
    let flat = Isometry3::translation(0.0, 0.0, -height);
    let clip = clip.transformed(&(clip_place * flat));

    let capsule = |a: Point3<f64>, b: Point3<f64>| {
        format!(
            "type=\"capsule\" size=\"{tube_radius}\" fromto=\"{:.5} {:.5} {:.5} {:.5} {:.5} {:.5}\"",
            a.x, a.y, a.z, b.x, b.y, b.z
        )
    };
    // Every fourth point of the path: straight pieces whole, bends in two chords.
    let mut knots: Vec<Point3<f64>> = vec![path[0]];
    knots.extend(path[1..path.len() - 1].chunks(9).flat_map(|bend| [bend[0], bend[4], bend[8]]));
    knots.push(path[path.len() - 1]);
    let mut collisions: Vec<String> = knots.windows(2).map(|pair| capsule(pair[0], pair[1])).collect();
    let boxed = |place: Isometry3<f64>, half: [f64; 3]| {
        let (p, q) = (place.translation.vector, place.rotation);
        format!(
            "type=\"box\" pos=\"{:.5} {:.5} {:.5}\" quat=\"{:.6} {:.6} {:.6} {:.6}\" size=\"{} {} {}\"",
            p.x, p.y, p.z, q.w, q.i, q.j, q.k, half[0], half[1], half[2]
        )
    };
    collisions.push(boxed(on_tube(0, 0.0095), [0.0105, 0.0075, 0.0095]));
    collisions.push(boxed(on_tube(last, last_length - 0.0035), [0.0115, 0.0075, 0.0095]));
    collisions.push(boxed(clip_place * Isometry3::translation(0.0, 0.0, -0.002), [0.0065, 0.0085, 0.0075]));

    Part {
        name: "fuel_line",
        title: "Fuel line",
        description: "Injection line of a Diesel engine: bent steel tube of 8 mm, 196 mm from end to end, with a male \
                      and a female union nut and a plastic clip",
        pieces: vec![
            Piece { name: "tube", mesh: tube, density: STEEL * 0.86, material: "tube" },
            Piece { name: "nuts", mesh: nuts.textured_from_above(0.04), density: STEEL * 0.75, material: "zinc" },
            Piece { name: "ends", mesh: ends.textured_from_above(0.03), density: STEEL * 0.75, material: "steel" },
            Piece { name: "clip", mesh: clip, density: RUBBER, material: "plastic" },
        ],
        finishes: vec![
            Finish {
                name: "tube",
                texture: Texture::round_bar(64, [0.58, 0.60, 0.63], 0.8, 21),
                specular: 0.4,
                shininess: 0.5,
            },
            Finish {
                name: "zinc",
                texture: Texture::brushed(128, [0.74, 0.66, 0.42], 0.10, 22),
                specular: 0.5,
                shininess: 0.4,
            },
            Finish {
                name: "steel",
                texture: Texture::brushed(64, [0.55, 0.55, 0.56], 0.12, 23),
                specular: 0.5,
                shininess: 0.4,
            },
            Finish {
                name: "plastic",
                texture: Texture::grained(64, [0.13, 0.13, 0.14], 0.08, 24),
                specular: 0.2,
                shininess: 0.3,
            },
        ],
        collisions,
        grasp_half_line: 0.026,
        jaw_width: 2.0 * tube_radius,
        grasp_height: 0.0085,
        mark_height: height,
        friction: 0.6,
    }
}

/// Male rod end: spherical bearing in a forged eye, threaded shank with a lock nut, grease nipple.
fn rod_end() -> Part {
    let eye = -0.042;
    let (half_ball, ball_radius, bore): (f64, f64, f64) = (0.0135, 0.017, 0.009);
    let (half_eye, eye_radius): (f64, f64) = (0.0085, 0.024);
    let shank_radius = 0.009;

    // The eye: race inside, a slightly barrelled rim outside.
    let race = (ball_radius * ball_radius - half_eye * half_eye).sqrt() + 0.0002;
    let rim = |z: f64| eye_radius - 0.0022 * (z / half_eye).powi(2);
    let mut profile = vec![(race, -half_eye)];
    profile.push((rim(half_eye) - 0.001, -half_eye));
    profile.extend((-3..=3).map(|step| {
        let z = f64::from(step) / 3.0 * (half_eye - 0.0008);
        (rim(z), z)
    }));
    profile.push((rim(half_eye) - 0.001, half_eye));
    profile.push((race, half_eye));
    profile.push((ball_radius + 0.0001, 0.0));
    let housing = centred_texture(lathe(&profile, 64), 0.06).transformed(&Isometry3::translation(eye, 0.0, half_ball));

    let liner = moved(
        ring(race - 0.0006, race + 0.0016, 2.0 * half_eye + 0.0006, 0.0003, 56),
        eye,
        0.0,
        half_ball - half_eye - 0.0003,
    );

    let flat = (ball_radius * ball_radius - half_ball * half_ball).sqrt();
    let mut profile = vec![(bore, -half_ball + 0.0006), (bore + 0.0006, -half_ball), (flat, -half_ball)];
    profile.extend((-5..=5).map(|step| {
        let z = f64::from(step) / 6.0 * half_ball;
        ((ball_radius * ball_radius - z * z).sqrt(), z)
    }));
    profile.extend([(flat, half_ball), (bore + 0.0006, half_ball), (bore, half_ball - 0.0006)]);
    let ball = centred_texture(lathe(&profile, 48), 0.04).transformed(&Isometry3::translation(eye, 0.0, half_ball));

    // Neck and bare shank, turned about x: starts inside the eye's wall.
    let lying = lying_along_x(half_ball);
    let along = |mesh: TriangleMesh, x: f64| mesh.transformed(&(Isometry3::translation(x, 0.0, 0.0) * lying));
    let neck_profile = [
        (0.0, 0.0),
        (0.0082, 0.0),
        (0.0118, 0.003),
        (0.0108, 0.007),
        (0.0096, 0.011),
        (0.0090, 0.015),
        (0.0090, 0.030),
        (0.0078, 0.0312),
        (0.0, 0.0312),
    ];
    let neck = along(lathe(&neck_profile, 36), eye + 0.0185);
    let neck_end = eye + 0.0185 + 0.030;
    let shank_end = 0.064;
    let screw = along(thread(shank_radius, 0.0025, shank_end - neck_end, 18), neck_end);

    let level = lying * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI / 2.0);
    let nut_x = 0.029;
    let nut = hex_prism(0.027, 0.010, 0.0).transformed(&(Isometry3::translation(nut_x, 0.0, 0.0) * level));

    let nipple_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 135f64.to_radians());
    let nipple_profile = [
        (0.0, 0.0),
        (0.0036, 0.0),
        (0.0036, 0.0035),
        (0.0022, 0.0038),
        (0.0022, 0.0058),
        (0.0029, 0.0068),
        (0.0020, 0.0086),
        (0.0, 0.0088),
    ];
    let nipple = lathe(&nipple_profile, 20).transformed(
        &(Isometry3::from_parts(Translation3::new(eye, 0.0, half_ball), nipple_turn)
            * Isometry3::translation(eye_radius - 0.0012, 0.0, 0.0)
            * lying_along_x(0.0)),
    );
    let mut plated = nut.textured_from_above(0.05);
    plated.append(&nipple.textured_from_above(0.05));

    Part {
        name: "rod_end",
        title: "Rod end",
        description: "Male rod end, M18 by 2.5: spherical plain bearing with an 18 mm bore in a forged eye of 48 mm, \
                      threaded shank with a lock nut, grease nipple",
        pieces: vec![
            Piece { name: "housing", mesh: housing, density: STEEL, material: "forged" },
            Piece { name: "liner", mesh: liner.textured_from_above(0.04), density: BRASS, material: "bronze" },
            Piece { name: "ball", mesh: ball, density: STEEL, material: "polished" },
            Piece { name: "neck", mesh: neck.textured_from_above(0.06), density: STEEL, material: "forged" },
            Piece { name: "screw", mesh: screw, density: STEEL, material: "rolled" },
            Piece { name: "plated", mesh: plated, density: STEEL * 0.8, material: "plated" },
        ],
        finishes: vec![
            Finish {
                name: "forged",
                texture: Texture::cast(128, [0.50, 0.51, 0.53], 0.07, 31),
                specular: 0.35,
                shininess: 0.3,
            },
            Finish {
                name: "bronze",
                texture: Texture::grained(64, [0.66, 0.47, 0.26], 0.06, 32),
                specular: 0.4,
                shininess: 0.4,
            },
            Finish {
                name: "polished",
                texture: Texture::turned(128, [0.74, 0.75, 0.77], 0.22, 33),
                specular: 0.9,
                shininess: 0.8,
            },
            Finish {
                name: "rolled",
                texture: Texture::round_bar(64, [0.48, 0.49, 0.50], 0.45, 34),
                specular: 0.5,
                shininess: 0.5,
            },
            Finish {
                name: "plated",
                texture: Texture::brushed(128, [0.70, 0.70, 0.68], 0.10, 35),
                specular: 0.6,
                shininess: 0.5,
            },
        ],
        collisions: vec![
            format!("type=\"cylinder\" pos=\"{eye} 0 {half_ball}\" size=\"{eye_radius} {half_eye}\""),
            format!("type=\"cylinder\" pos=\"{eye} 0 {half_ball}\" size=\"{flat:.5} {half_ball}\""),
            format!(
                "type=\"cylinder\" size=\"{shank_radius}\" fromto=\"-0.020 0 {half_ball} {shank_end} 0 {half_ball}\""
            ),
            format!("type=\"box\" pos=\"{} 0 {half_ball}\" size=\"0.005 0.0117 {half_ball}\"", nut_x + 0.005),
        ],
        grasp_half_line: 0.020,
        jaw_width: 2.0 * shank_radius,
        grasp_height: 0.012,
        mark_height: half_ball,
        friction: 0.6,
    }
}

/// Mass, centre of mass and inertia about it, summed over the pieces.
fn mass_of(part: &Part) -> (f64, Point3<f64>, Matrix3<f64>) {
    let pieces: Vec<_> = part.pieces.iter().map(|piece| (piece.density, piece.mesh.mass_properties())).collect();
    let mass: f64 = pieces.iter().map(|(density, properties)| density * properties.volume).sum();
    let moment: Vector3<f64> =
        pieces.iter().map(|(density, properties)| properties.centre.coords * (density * properties.volume)).sum();
    let centre = Point3::from(moment / mass);
    let mut inertia = Matrix3::zeros();
    for (density, properties) in &pieces {
        let arm = properties.centre - centre;
        let shift = Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
        inertia += (properties.inertia + shift * properties.volume) * *density;
    }
    (mass, centre, inertia)
}

fn write_part(folder: &Path, part: &Part) -> std::io::Result<()> {
    fs::create_dir_all(folder)?;
    let (mass, centre, inertia) = mass_of(part);
    let mut assets = String::new();
    for finish in &part.finishes {
        let file = format!("{}_{}.png", part.name, finish.name);
        finish.texture.image.save(folder.join(&file)).map_err(std::io::Error::other)?;
        let name = finish.name;
        let _ = writeln!(assets, "    <texture name=\"object_{name}\" type=\"2d\" file=\"{file}\"/>");
        let _ = writeln!(
            assets,
            "    <material name=\"object_{name}\" texture=\"object_{name}\" specular=\"{}\" shininess=\"{}\"/>",
            finish.specular, finish.shininess
        );
    }
    let mut geoms = String::new();
    for (idx, piece) in part.pieces.iter().enumerate() {
        let file = format!("{}_{}.obj", part.name, piece.name);
        fs::write(folder.join(&file), piece.mesh.to_obj())?;
        let _ = writeln!(assets, "    <mesh name=\"object_{}\" file=\"{file}\"/>", piece.name);
        let _ = writeln!(
            geoms,
            "      <geom name=\"object_visual_{idx}\" type=\"mesh\" mesh=\"object_{}\" material=\"object_{}\" \
             contype=\"0\" conaffinity=\"0\" group=\"1\"/>",
            piece.name, piece.material
        );
    }
    for (idx, shape) in part.collisions.iter().enumerate() {
        let _ = writeln!(
            geoms,
            "      <geom name=\"object_collision_{idx}\" {shape} friction=\"{} 0.005 0.0002\" condim=\"4\" group=\"3\"/>",
            part.friction
        );
    }
    let i = inertia;
    let mjcf = format!(
        "<mujoco model=\"{}\">\n  <asset>\n{assets}  </asset>\n  <worldbody>\n    <body name=\"object\">\n      \
         <freejoint name=\"object_joint\"/>\n      <inertial pos=\"{:.6} {:.6} {:.6}\" mass=\"{mass:.5}\" \
         fullinertia=\"{:.4e} {:.4e} {:.4e} {:.4e} {:.4e} {:.4e}\"/>\n{geoms}    </body>\n  </worldbody>\n</mujoco>\n",
        part.name,
        centre.x,
        centre.y,
        centre.z,
        i[(0, 0)],
        i[(1, 1)],
        i[(2, 2)],
        i[(0, 1)],
        i[(0, 2)],
        i[(1, 2)]
    );
    fs::write(folder.join("object.xml"), mjcf)?;
    let footprint: Vec<[f64; 2]> = hull(part).iter().map(|p| [round(p.x), round(p.y)]).collect();
    let metadata = serde_json::json!({
        "format": 1,
        "name": part.name,
        "title": part.title,
        "description": part.description,
        "mass_kg": round(mass),
        "friction": part.friction,
        "grasp_start": [-part.grasp_half_line, 0.0, part.mark_height],
        "grasp_end": [part.grasp_half_line, 0.0, part.mark_height],
        "jaw_width_m": part.jaw_width,
        "grasp_height_m": part.grasp_height,
        "mark_height_m": part.mark_height,
        "rest_height_m": 0.0,
        "symmetry": "none",
        "footprint": footprint,
        "mjcf": "object.xml",
    });
    fs::write(folder.join("object.json"), format!("{metadata:#}\n"))?;
    println!("{}: {mass:.3} kg, centre of mass ({:.4}, {:.4}, {:.4})", part.name, centre.x, centre.y, centre.z);
    Ok(())
}

fn round(value: f64) -> f64 {
    (value * 1e5).round() / 1e5
}

/// The convex hull of a part seen from above, counter-clockwise.
fn hull(part: &Part) -> Vec<Point2<f64>> {
    let points = part.pieces.iter().flat_map(|piece| piece.mesh.vertices.iter().map(|vertex| vertex.position.xy()));
    sdg_simulation::scene::footprint::convex_hull(points)
}
