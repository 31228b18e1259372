//! `sdg workcell`: shows a workcell file.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, Subcommand};
use sdg_cell::{Reach, WorkcellMap};

use crate::exit::Outcome;
use crate::output_paths::check_ending;

/// The commands of `sdg workcell`.
#[derive(Debug, Subcommand)]
pub enum WorkcellCommand {
    /// Draw the cell from above: table, workspace, places, obstacles, look-out poses, and the area of the table that
    /// the hand reaches
    Show(ShowArgs),
}

/// `sdg workcell show`
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// The workcell file
    #[arg(value_name = "FILE")]
    pub workcell: PathBuf,
    /// Height of the tcp above the table for which reach is computed, with the hand pointing straight down
    #[arg(long, value_name = "MM", default_value_t = 20.0)]
    pub height_mm: f64,
    /// Size of a square of the map of reach
    #[arg(long, value_name = "MM", default_value_t = 25.0)]
    pub grid_mm: f64,
    /// The PNG file to write
    #[arg(long, value_name = "FILE", default_value = "workcell.png")]
    pub out: PathBuf,
}

/// Runs one of the commands.
pub fn run(command: &WorkcellCommand) -> Result<Outcome> {
    let WorkcellCommand::Show(args) = command;
    for (name, found, [min, max]) in
        [("--height-mm", args.height_mm, [5.0, 500.0]), ("--grid-mm", args.grid_mm, [5.0, 200.0])]
    {
        if !(min..=max).contains(&found) {
            let why = format!("{name}: expected a number from {min} to {max}, found {found}");
            return Err(crate::exit::Usage(why).into());
        }
    }
    check_ending("--out", &args.out, "png")?;
    let (workcell, _) = sdg_inputs::read_workcell(&args.workcell)?;
    sdg_files::check_writable(&args.out)?;
    let map = WorkcellMap::around(&workcell);
    let reach = Reach::of(&workcell, map.area_m(), args.grid_mm * 1e-3, args.height_mm * 1e-3)?;
    for line in reach.lines(&workcell) {
        println!("{line}");
    }
    sdg_files::write_drawing(&args.out, &map.draw(&workcell, &reach))?;
    println!("{}", args.out.display());
    Ok(Outcome::Done)
}
