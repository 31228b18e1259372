//! An evaluation whose units are done by many processes on machines with a common folder. The processes are tasks of
//! Slurm's job arrays, or are started by hand.
//!
//! ```text
//! all_units ─ names ─┬─ --unit NAME …  ─ UnitFolder: lock, running, receipt or failure ─ Store (shared)
//!                        ├─ --watch DIR    ─ Watch: done, running, failed, waiting, time left
//!                        └─ --collect      ─ faults, or the tables of an ordinary run
//! DIR/plans/HASH.json            all units, for --watch
//! DIR/units/NAME/lock            held by the process that does the unit
//! DIR/units/NAME/running.json    that process
//! DIR/units/NAME/done-*.json     a receipt: the process, its settings, and the SHA-256 of each file that the unit wrote
//! DIR/units/NAME/failed-*.json   the process and its error
//! DIR/units/NAME/interrupted.json   a process that was interrupted, until another one begins
//! DIR/units/NAME/models.json     the SHA-256 of each model with which the unit's results are made
//! ```
//!
//! A **unit** has a constant name and its own folder, so that a process reads and writes only a few files, however many
//! units there are. Records contain the SHA-256 of the program in addition to the settings of the ordinary run. The
//! shipped demonstrations are compiled into the program, so its hash includes them.
//!
//! Slurm, or a person, assigns the units to processes.

mod checking;
mod doing;
mod made_with;
mod near_names;
mod records;
mod slurm;
mod unit_folder;
mod unit_list;
mod watching;
mod worker;

pub use checking::{Collecting, faults};
pub use doing::Ended;
pub use near_names::near_names;
pub use records::{Failure, Receipt, Running};
pub use slurm::{SlurmJob, cores, submit_script, submitted_jobs};
pub use unit_folder::UnitFolder;
pub use unit_list::{ListedUnit, UnitKind, UnitList, all_units};
pub use watching::{Progress, Watch};
pub use worker::{Worker, own_sha256};
