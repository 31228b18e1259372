//! Compares sizes and offsets of the committed bindings with those that a C compiler reads from the headers.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::mem::{offset_of, size_of};
use std::process::Command;

use sdg_mujoco_sys::*;

/// Lists `(C expression, value in the bindings)` for the size of each struct, and for the offsets of some fields
/// between its start and its end.
macro_rules! layout {
    ($($name:ident { $($field:ident),* $(,)? })*) => {
        vec![$(
            (concat!("sizeof(", stringify!($name), ")"), size_of::<$name>()),
            $((concat!("offsetof(", stringify!($name), ", ", stringify!($field), ")"), offset_of!($name, $field)),)*
        )*]
    };
}

#[test]
fn bindings_have_the_layout_of_the_c_headers() {
    let expected = layout! {
        mjOption { timestep, gravity, integrator, cone, disableflags }
        mjVisual { headlight, quality }
        mjStatistic { extent, center }
        mjVFS { nfile, filename, filesize, filedata }
        mjModel {
            nq, nv, nu, nbody, njnt, ngeom, nsite, ncam, nconmax, opt, vis, stat, qpos0, jnt_range, jnt_qposadr,
            jnt_dofadr, body_mass, body_inertia, geom_bodyid, geom_friction, cam_fovy, names, name_siteadr
        }
        mjData {
            ncon, time, qpos, qvel, ctrl, qfrc_applied, qfrc_bias, xpos, xquat, xmat, site_xpos, site_xmat, cam_xpos,
            cam_xmat, contact, warning
        }
        mjContact { dist, pos, frame, geom1, geom2, efc_address }
        mjvScene { maxgeom, ngeom, geoms, camera, flags }
        mjvGeom { objtype, objid, segid, label }
        mjvCamera { fixedcamid, elevation }
        mjvOption { geomgroup, flags }
        mjvPerturb { select, scale }
        mjvGLCamera { pos, frustum_far }
        mjrContext { offWidth, offFBO, currentBuffer }
        mjrRect { left, bottom, width, height }
    };

    let dir = std::env::temp_dir().join(format!("sdg-mujoco-layout-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let mut source =
        String::from("#include <stddef.h>\n#include <stdio.h>\n#include <mujoco/mujoco.h>\nint main(void) {\n");
    for (expression, _) in &expected {
        writeln!(source, "  printf(\"%zu\\n\", (size_t)({expression}));").unwrap();
    }
    source.push_str("  return 0;\n}\n");
    std::fs::write(dir.join("layout.c"), source).unwrap();
    // Only headers are used, so that nothing has to be linked.
    let compiled = Command::new("cc").current_dir(&dir).args(["layout.c", "-o", "layout"]).status().unwrap();
    assert!(compiled.success(), "cc could not compile against mujoco/mujoco.h");
    let output = Command::new(dir.join("layout")).output().unwrap();
    std::fs::remove_dir_all(&dir).unwrap();

    let found = String::from_utf8(output.stdout).unwrap();
    let found: Vec<usize> = found.lines().map(|line| line.parse().unwrap()).collect();
    assert_eq!(found.len(), expected.len());
    for ((expression, bindings), c) in expected.iter().zip(found) {
        assert_eq!(*bindings, c, "{expression}");
    }
}
