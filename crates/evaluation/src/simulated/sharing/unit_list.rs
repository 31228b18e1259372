//! All units of an evaluation by name, finished or not.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;

use anyhow::{Context, Result};
use sdg_files::write_atomically;
use sdg_grasp::{ModelKind, Verification};
use sdg_simulation::objects::ObjectSpec;
use serde::{Deserialize, Serialize};

use super::super::cell::{Cell, Marks, attempts_of};
use super::super::units::Unit;

/// Maximum size of a stored list, larger than a list of a hundred thousand units.
const MAX_LIST_BYTES: u64 = 64 << 20;

/// The kind of a unit's work, which is the first word of its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnitKind {
    Teach,
    Look,
    Grasp,
    Time,
}

impl UnitKind {
    /// All kinds, in the order of the list.
    pub const ALL: [Self; 4] = [Self::Teach, Self::Look, Self::Grasp, Self::Time];

    /// The first word of the names of these units.
    pub fn name(self) -> &'static str {
        match self {
            Self::Teach => "teach",
            Self::Look => "look",
            Self::Grasp => "grasp",
            Self::Time => "time",
        }
    }

    /// Whether units of this kind render pictures: all except teaching runs, which use shipped photos.
    pub fn is_simulated(self) -> bool {
        self != Self::Teach
    }

    /// The kind of a unit, from the first word of its name.
    pub fn of(unit: &str) -> Option<Self> {
        let first = unit.split('-').next()?;
        Self::ALL.into_iter().find(|kind| kind.name() == first)
    }
}

impl fmt::Display for UnitKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The work of a unit.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Work<'a> {
    Unit(Unit<'a>),
    /// Measuring the speed of all models on a part.
    Time(&'a ObjectSpec),
}

/// A unit of work and its name.
#[derive(Debug, Clone)]
pub struct ListedUnit<'a> {
    pub name: String,
    /// Names of the units that must be done before this one.
    pub after: Vec<String>,
    /// The files that the unit may write, relative to the evaluation's folder. For a part without a model, some are not
    /// written.
    pub files: Vec<String>,
    /// The model files that the unit reads.
    pub(super) models: Vec<String>,
    pub(super) work: Work<'a>,
}

/// All units: teaching runs, pictures, grasps, grasps without the check, speed. Each unit comes after its dependencies.
pub fn all_units<'a>(models: &[ModelKind], objects: &'a [ObjectSpec], unverified: bool) -> Vec<ListedUnit<'a>> {
    let mut networks: Vec<ModelKind> = Vec::new();
    for network in models.iter().map(|model| model.taught_as()) {
        if !networks.contains(&network) {
            networks.push(network);
        }
    }
    let cells = |object: &'a ObjectSpec| models.iter().map(|&model| Cell { model, object: &object.name });
    let teaching = |cell: Cell| format!("teach-{}", cell.network());
    let teachings = |object: &'a ObjectSpec| {
        let of_network = |model: &ModelKind| teaching(Cell { model: *model, object: &object.name });
        networks.iter().map(of_network).collect::<Vec<_>>()
    };
    let models_of = |object: &'a ObjectSpec| {
        let of_network = |&model: &ModelKind| Cell { model, object: &object.name }.model_file(Marks::Shipped);
        networks.iter().map(of_network).collect::<Vec<_>>()
    };
    let mut units = Vec::new();
    for object in objects {
        for &model in &networks {
            let cell = Cell { model, object: &object.name };
            let files = vec![cell.model_file(Marks::Shipped), cell.teaching_file(Marks::Shipped)];
            units.push(ListedUnit {
                name: teaching(cell),
                after: Vec::new(),
                files,
                models: Vec::new(),
                work: Work::Unit(Unit::Teach(cell)),
            });
        }
    }
    for object in objects {
        let files = cells(object).flat_map(|cell| [cell.file("look"), cell.picture_file()]).collect();
        let work = Work::Unit(Unit::Look(object));
        let (name, after, models) = (format!("look-{}", object.name), teachings(object), models_of(object));
        units.push(ListedUnit { name, after, files, models, work });
    }
    for way in [Verification::ByShape, Verification::Off] {
        for object in objects {
            for cell in cells(object) {
                let (is_planned, suffix) = match way {
                    Verification::ByShape => (true, ""),
                    Verification::Off => (unverified && cell.model.has_network(), "-unverified"),
                };
                if is_planned {
                    units.push(ListedUnit {
                        name: format!("grasp-{cell}{suffix}"),
                        after: vec![teaching(cell)],
                        files: vec![cell.file(&attempts_of(way))],
                        models: vec![cell.model_file(Marks::Shipped)],
                        work: Work::Unit(Unit::Attempts(cell, object, way)),
                    });
                }
            }
        }
    }
    for object in objects {
        let files = cells(object).map(|cell| cell.file("speed")).collect();
        let (name, after, models) = (format!("time-{}", object.name), teachings(object), models_of(object));
        units.push(ListedUnit { name, after, files, models, work: Work::Time(object) });
    }
    units
}

/// A list of units that is stored in a folder, so that `--watch` needs no other arguments.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitList {
    pub units: Vec<SavedUnit>,
}

/// A unit of a [`UnitList`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SavedUnit {
    pub name: String,
    pub after: Vec<String>,
    /// The files that the unit may write.
    #[serde(default)]
    pub files: Vec<String>,
}

impl SavedUnit {
    /// Adds what the unit needs and writes according to another list, for other models.
    fn extend(&mut self, other: Self) {
        for (known, more) in [(&mut self.after, other.after), (&mut self.files, other.files)] {
            for name in more {
                if !known.contains(&name) {
                    known.push(name);
                }
            }
        }
    }
}

impl UnitList {
    pub fn new(units: &[ListedUnit]) -> Self {
        let saved = |unit: &ListedUnit| SavedUnit {
            name: unit.name.clone(),
            after: unit.after.clone(),
            files: unit.files.clone(),
        };
        Self { units: units.iter().map(saved).collect() }
    }

    /// Stores the list in an evaluation's folder, unless it is there already.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn save(&self, folder: &Path) -> Result<()> {
        let mut bytes = serde_json::to_vec(self)?;
        bytes.push(b'\n');
        let plans = folder.join("plans");
        // The name depends only on the content, so that each list is stored once.
        let path = plans.join(format!("{:016x}.json", fnv1a(&bytes)));
        if path.exists() {
            return Ok(());
        }
        sdg_files::prepare_folder(&plans)?;
        Ok(write_atomically(&path, &bytes)?)
    }

    /// All units of all lists in a folder; empty without a list.
    ///
    /// # Errors
    /// Lists cannot be read.
    pub fn read_all(folder: &Path) -> Result<Self> {
        let plans = folder.join("plans");
        let mut all = Self { units: Vec::new() };
        if !plans.exists() {
            return Ok(all);
        }
        let mut known: HashMap<String, usize> = HashMap::new();
        for path in sdg_files::entries(&plans)? {
            let plan: Self = serde_json::from_slice(&sdg_files::read(&path, MAX_LIST_BYTES)?)
                .with_context(|| format!("{}: expected a plan of an evaluation", path.display()))?;
            for unit in plan.units {
                match known.get(&unit.name) {
                    Some(&idx) => all.units[idx].extend(unit),
                    None => {
                        known.insert(unit.name.clone(), all.units.len());
                        all.units.push(unit);
                    }
                }
            }
        }
        Ok(all)
    }
}

/// A hash that distinguishes contents; not cryptographic (FNV-1a, 64 bits).
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn objects() -> [ObjectSpec; 2] {
        ["pendulum", "rod_end"].map(|name| ObjectSpec::by_name(name).unwrap())
    }

    #[test]
    fn units_have_names_and_wait_for_their_teachings() {
        let objects = objects();
        let units = all_units(&[ModelKind::B, ModelKind::C, ModelKind::S], &objects, true);
        let listed: Vec<String> =
            units.iter().map(|unit| format!("{} < {}", unit.name, unit.after.join(" "))).collect();
        assert_eq!(
            listed[..6],
            [
                "teach-C-pendulum < ",
                "teach-S-pendulum < ",
                "teach-C-rod_end < ",
                "teach-S-rod_end < ",
                "look-pendulum < teach-C-pendulum teach-S-pendulum",
                "look-rod_end < teach-C-rod_end teach-S-rod_end"
            ]
        );
        for expected in [
            "grasp-B-pendulum < teach-C-pendulum",
            "grasp-C-rod_end-unverified < teach-C-rod_end",
            "time-rod_end < teach-C-rod_end teach-S-rod_end",
        ] {
            assert!(listed.iter().any(|unit| unit == expected), "{expected} of {listed:?}");
        }
        // S has no network that could detect without the check.
        assert!(!listed.iter().any(|unit| unit.starts_with("grasp-S-pendulum-unverified")));
        assert_eq!(units.len(), 4 + 2 + 6 + 4 + 2);
        for (i, unit) in units.iter().enumerate() {
            assert!(unit.after.iter().all(|before| units[..i].iter().any(|known| known.name == *before)));
            assert_eq!(UnitKind::of(&unit.name).unwrap().name(), unit.name.split('-').next().unwrap());
        }
    }

    #[test]
    fn no_two_units_write_one_file() {
        let objects = objects();
        let units = all_units(&ModelKind::ALL, &objects, true);
        let mut files: Vec<&String> = units.iter().flat_map(|unit| &unit.files).collect();
        let all = files.len();
        files.sort_unstable();
        files.dedup();
        assert_eq!(files.len(), all);
    }

    #[test]
    fn plans_of_a_folder_are_one() {
        let (folder, objects) = (tempfile::tempdir().unwrap(), objects());
        assert!(UnitList::read_all(folder.path()).unwrap().units.is_empty());
        let some = UnitList::new(&all_units(&[ModelKind::S], &objects[..1], false));
        let all = UnitList::new(&all_units(&[ModelKind::S], &objects, false));
        for plan in [&some, &all, &all] {
            plan.save(folder.path()).unwrap();
        }
        assert_eq!(UnitList::read_all(folder.path()).unwrap().units.len(), all.units.len());
        // Units that several models share have the files of all of them.
        UnitList::new(&all_units(&[ModelKind::C], &objects, false)).save(folder.path()).unwrap();
        let units = UnitList::read_all(folder.path()).unwrap().units;
        let look = units.iter().find(|unit| unit.name == "look-pendulum").unwrap();
        assert_eq!((look.after.len(), look.files.len()), (2, 4));
    }
}
