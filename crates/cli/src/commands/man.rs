//! `sdg man`: manual pages, generated from the definitions of the help.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args as ClapArgs;
use clap::Command;
use clap_mangen::Man;
use sdg_files::write_atomically;

use crate::exit::Outcome;

/// `sdg man`
#[derive(Debug, ClapArgs)]
pub struct ManArgs {
    /// Write one page per command to this folder; without it, the page of sdg goes to standard output
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Prints the page of `sdg` on standard output, or writes one page per command to a folder.
pub fn run(args: &ManArgs, root: Command) -> Result<Outcome> {
    let mut root = root.disable_help_subcommand(true);
    root.build();
    let Some(folder) = &args.out else {
        std::io::stdout().lock().write_all(&render(&root)?)?;
        return Ok(Outcome::Done);
    };
    sdg_files::prepare_folder(folder)?;
    let mut commands = vec![&root];
    let mut written = 0;
    while let Some(command) = commands.pop() {
        let name = Man::new(command.clone()).get_filename();
        write_atomically(&folder.join(name), &render(command)?)?;
        written += 1;
        commands.extend(command.get_subcommands().filter(|command| !command.is_hide_set()));
    }
    println!("wrote {written} manual pages to {}", folder.display());
    Ok(Outcome::Done)
}

fn render(command: &Command) -> Result<Vec<u8>> {
    let mut page = Vec::new();
    Man::new(command.clone()).render(&mut page)?;
    Ok(page)
}
