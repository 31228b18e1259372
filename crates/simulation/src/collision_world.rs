//! MuJoCo's collisions of all shapes of the arm with each other and with obstacles, as a reference for the collision
//! model of `sdg-kinematics`.

use std::sync::Arc;

use sdg_kinematics::JointVector;
use sdg_kinematics::collision::Obstacle;

use crate::data::Data;
use crate::error::Result;
use crate::model::{Asset, Geom, Id, Model};
use crate::obstacles::{obstacle_of_geom, obstacles_mjcf};
use crate::panda::{PANDA_FILE, PandaIds, panda_asset};

/// Two overlapping bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlap {
    /// Names of bodies of the arm, or of an obstacle.
    pub between: [String; 2],
    /// Depth, m.
    pub depth_m: f64,
}

/// The simulated Panda among obstacles, without dynamics.
///
/// All visible shapes of the arm collide with each other and with the obstacles; the simpler collision shapes of grasp
/// attempts collide with the obstacles only.
pub struct CollisionWorld {
    data: Data,
    ids: PandaIds,
    names: Vec<String>,
}

/// Bodies that touch by construction: neighbours, and the fingers when closed. MuJoCo itself excludes pairs of parent
/// and child, except for children of the world.
const EXCLUDED: &str = "<contact><exclude body1=\"link0\" body2=\"link1\"/>\
                        <exclude body1=\"left_finger\" body2=\"right_finger\"/></contact>";

impl CollisionWorld {
    /// The arm with its fingers at an opening (m), among obstacles.
    ///
    /// # Errors
    /// As for [`Model::from_xml`].
    pub fn new(obstacles: &[Obstacle], opening_m: f64) -> Result<Self> {
        // Collision bits: 1 for obstacles, 2 for visible shapes of the arm.
        let text = String::from_utf8_lossy(&panda_asset().bytes)
            .replace("contype=\"2\" conaffinity=\"1\"", "contype=\"0\" conaffinity=\"1\"")
            .replace("contype=\"0\" conaffinity=\"0\"", "contype=\"2\" conaffinity=\"3\"");
        let geoms = obstacles_mjcf(obstacles, "contype=\"1\" conaffinity=\"0\"");
        let xml = format!(
            "<mujoco><compiler angle=\"radian\"/><size njmax=\"1500\" nconmax=\"1000\" nstack=\"1000000\"/>\
             <include file=\"{PANDA_FILE}\"/>{EXCLUDED}<worldbody>{geoms}</worldbody></mujoco>"
        );
        let model =
            Arc::new(Model::from_xml(&xml, &[Asset { name: PANDA_FILE.to_owned(), bytes: text.into_bytes() }])?);
        let ids = PandaIds::find(&model)?;
        let names = model
            .ids::<Geom>()
            .map(|geom| match model.name(model.body_of(geom)).as_deref() {
                None | Some("world") => {
                    model.name(geom).map(|name| obstacle_of_geom(&name).to_owned()).unwrap_or_default()
                }
                Some(body) => body.to_owned(),
            })
            .collect();
        let mut data = Data::new(model)?;
        ids.set_finger_position_m(&mut data, 0.5 * opening_m);
        Ok(Self { data, ids, names })
    }

    /// All overlaps at a configuration.
    ///
    /// # Errors
    /// [`crate::SimulationError::Unstable`] for positions that are not finite, and
    /// [`crate::SimulationError::TooManyContacts`].
    pub fn overlaps(&mut self, q: &JointVector) -> Result<Vec<Overlap>> {
        self.ids.set_position(&mut self.data, q);
        self.data.collide()?;
        let name = |geom: Id<Geom>| self.names[geom.index()].clone();
        Ok(self
            .data
            .overlaps()
            .map(|(one, other, depth_m)| Overlap { between: [name(one), name(other)], depth_m })
            .collect())
    }

    /// The deepest overlap at a configuration, if there is any.
    ///
    /// # Errors
    /// As for [`CollisionWorld::overlaps`].
    pub fn deepest(&mut self, q: &JointVector) -> Result<Option<Overlap>> {
        Ok(self.overlaps(q)?.into_iter().max_by(|a, b| a.depth_m.total_cmp(&b.depth_m)))
    }
}
