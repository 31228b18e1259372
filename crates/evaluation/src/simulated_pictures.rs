//! The camera of the simulated workcell, for the finder that real arms use.

use sdg_cell::{Pictures, TakenPicture};
use sdg_simulation::Workcell;

/// The camera of the simulated workcell.
pub struct SimulatedPictures;

impl Pictures<Workcell> for SimulatedPictures {
    fn take(&mut self, cell: &mut Workcell) -> sdg_robot::Result<TakenPicture> {
        Ok(TakenPicture { picture: cell.wrist_view()?.image, taken: None })
    }
}
