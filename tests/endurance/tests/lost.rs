//! Tests that the simulated disk loses unsynced data and keeps synced data, and that programs are killed at the
//! requested change.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))]
#![allow(missing_docs, clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use sdg_endurance::disk::Disk;
use sdg_endurance::tracer::{Ending, Tracee};

const OLD: &str = "an old file";

/// The contents of `file` (`None` if it does not exist) after 64 power cuts, each after the shell's commands,
/// optionally killed before a change.
fn after(commands: &str, kill_at: Option<u64>) -> (Ending, BTreeSet<Option<String>>) {
    let folder = tempfile::tempdir().unwrap();
    let [root, kept] = ["root", "kept"].map(|name| folder.path().join(name));
    fs::create_dir(&root).unwrap();
    fs::create_dir(&kept).unwrap();
    fs::write(root.join("file"), OLD).unwrap();
    let mut disk = Disk::follow(&root.canonicalize().unwrap(), &kept).unwrap();
    let tracee = Tracee::start(Command::new("sh").args(["-ec", commands]).current_dir(&root)).unwrap();
    let (ending, _) = tracee.follow(&mut disk, kill_at).unwrap();
    let cut = |seed: u64| {
        let to = folder.path().join(format!("after-{seed}"));
        disk.after_power_cut(&mut Pcg64Mcg::seed_from_u64(seed), &to).unwrap();
        fs::read(to.join("file")).ok().map(|content| String::from_utf8(content).unwrap())
    };
    (ending, (0..64).map(cut).collect())
}

fn only<const N: usize>(contents: [&str; N]) -> BTreeSet<Option<String>> {
    contents.into_iter().map(|content| Some(content.to_owned())).collect()
}

#[test]
fn a_rename_of_what_was_not_synced_may_leave_an_empty_file() {
    let (ending, found) = after("printf new > t; mv t file", None);
    assert_eq!(ending, Ending::Exited(0));
    for content in [OLD, "new", ""] {
        assert!(found.contains(&Some(content.to_owned())), "expected {content:?} among {found:?}");
    }
}

#[test]
fn a_file_written_in_place_may_be_cut_short() {
    let (_, found) = after("printf new > file", None);
    assert!(found.contains(&Some("ne".to_owned())), "{found:?}");
}

#[test]
fn what_was_synced_and_renamed_is_the_old_file_or_the_new_one() {
    let synced = "printf new > t; sync t; mv t file";
    assert_eq!(after(synced, None).1, only([OLD, "new"]));
    let whole = format!("{synced}; sync .");
    assert_eq!(after(&whole, None).1, only(["new"]));
}

#[test]
fn a_program_is_killed_before_the_change_that_is_asked_for() {
    // Create, write, sync, a rename that fails if the name is taken, a rename, and the sync of the folder.
    let synced = "printf new > t; sync t; mv t file; sync .";
    assert_eq!(after(synced, Some(5)), (Ending::Killed, only([OLD])));
    assert_eq!(after(synced, Some(6)), (Ending::Killed, only([OLD, "new"])));
    assert_eq!(after(synced, Some(7)), (Ending::Exited(0), only(["new"])));
}
