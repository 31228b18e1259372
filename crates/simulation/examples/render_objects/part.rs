//! The pieces of a part, and its output files.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{extrude, lying_along_x};
use sdg_simulation::shapes::texture::Texture;

/// Densities in kg/m³.
pub const STEEL: f64 = 7850.0;
pub const BRASS: f64 = 8500.0;
pub const ALUMINIUM: f64 = 2700.0;
pub const PLASTIC: f64 = 1200.0;
/// Printed plastic at the usual sparse infill.
pub const PRINTED: f64 = 900.0;
pub const RUBBER: f64 = 1200.0;

/// A visible piece of a part.
pub struct Piece {
    pub name: &'static str,
    pub mesh: TriangleMesh,
    pub density: f64,
    pub material: &'static str,
}

/// The appearance of a surface.
pub struct Finish {
    pub name: &'static str,
    pub texture: Texture,
    pub specular: f64,
    pub shininess: f64,
}

/// A part with its visible pieces, collision shapes and grasp.
pub struct Part {
    pub name: &'static str,
    pub title: &'static str,
    pub description: &'static str,
    pub pieces: Vec<Piece>,
    pub finishes: Vec<Finish>,
    /// MJCF attributes of convex collision shapes.
    pub collisions: Vec<String>,
    pub grasp_half_line: f64,
    pub jaw_width: f64,
    pub grasp_height: f64,
    pub mark_height: f64,
    /// Height of the visible surface at the marks.
    pub seen_height: f64,
    pub friction: f64,
    pub symmetry: RotationalSymmetry,
}

/// A moved mesh.
pub fn moved(mesh: TriangleMesh, x: f64, y: f64, z: f64) -> TriangleMesh {
    mesh.transformed(&Isometry3::translation(x, y, z))
}

/// Centres the texture on a piece's own origin; it repeats every `metres`.
pub fn centred_texture(mesh: TriangleMesh, metres: f64) -> TriangleMesh {
    let mut mesh = mesh.textured_from_above(metres);
    for vertex in &mut mesh.vertices {
        vertex.texcoord += nalgebra::Vector2::repeat(0.5);
    }
    mesh
}

/// Lays a solid that stands along z on its side: its axis runs from `start` in the direction `yaw`, with its former -x
/// on top.
pub fn laid(mesh: TriangleMesh, start: Point3<f64>, yaw: f64) -> TriangleMesh {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
    mesh.transformed(&(Isometry3::from_parts(Translation3::from(start), turn) * lying_along_x(0.0)))
}

/// As [`laid`], and rotated by 90° about its own axis: two flats of a hexagon are then horizontal.
pub fn laid_level(mesh: TriangleMesh, start: Point3<f64>, yaw: f64) -> TriangleMesh {
    let quarter = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2);
    laid(mesh.transformed(&Isometry3::from_parts(Translation3::identity(), quarter)), start, yaw)
}

/// Extrudes a profile (y, z), counter-clockwise seen from +x, by `length` along x, starting at `x`.
pub fn drawn_along_x(profile: &[Point2<f64>], x: f64, length: f64, chamfer: f64) -> TriangleMesh {
    // A rotation by 120° about the diagonal maps x to y, y to z and z to x.
    let diagonal = Unit::new_normalize(Vector3::repeat(1.0));
    let turn = UnitQuaternion::from_axis_angle(&diagonal, TAU / 3.0);
    extrude(profile, &[], length, chamfer).transformed(&Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), turn))
}

/// MJCF of a box by its smallest and largest corner.
pub fn box_between(low: [f64; 3], high: [f64; 3]) -> String {
    let middle = [0, 1, 2].map(|axis| (low[axis] + high[axis]) / 2.0);
    let half = [0, 1, 2].map(|axis| (high[axis] - low[axis]) / 2.0);
    format!(
        "type=\"box\" pos=\"{:.5} {:.5} {:.5}\" size=\"{:.5} {:.5} {:.5}\"",
        middle[0], middle[1], middle[2], half[0], half[1], half[2]
    )
}

/// MJCF of a cylinder by the ends of its axis.
pub fn cylinder_between(from: [f64; 3], to: [f64; 3], radius: f64) -> String {
    format!(
        "type=\"cylinder\" size=\"{radius}\" fromto=\"{:.5} {:.5} {:.5} {:.5} {:.5} {:.5}\"",
        from[0], from[1], from[2], to[0], to[1], to[2]
    )
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

/// Writes meshes, textures, MJCF and metadata into a folder.
pub fn write_part(folder: &Path, part: &Part) -> std::io::Result<()> {
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
        "seen_height_m": round(part.seen_height),
        "rest_height_m": 0.0,
        "symmetry": part.symmetry,
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
    sdg_geometry::convex_hull(points)
}
