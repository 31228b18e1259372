//! Shell scripts and the Makefile, in bash with functions instead of the programs that they call.
#![allow(missing_docs, clippy::unwrap_used)]

use std::process::Command;

use crate::documents::root;

/// Runs commands of bash in the repository's root, with an empty folder as `$1`, and returns their output.
fn bash(commands: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new("bash")
        .args(["-euo", "pipefail", "-c", commands, "bash"])
        .arg(folder.path())
        .current_dir(root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn make_builds_into_the_folder_whose_programs_it_runs() {
    let found = bash(
        "export CARGO_TARGET_DIR=$1 MAKEFLAGS=
        make -s --eval 'shown: ; @echo $$CARGO_TARGET_DIR' shown",
    );
    assert_eq!(found, format!("{}\n", root().join("target").display()));
}

#[test]
fn the_c_library_is_installed_beside_other_files() {
    // The library is not built; a relative folder is one of the caller.
    bash(
        "export CARGO=true CARGO_TARGET_DIR=$1/built
        mkdir -p $1/built/release/examples $1/usr/lib
        touch $1/built/release/examples/libsdg.so $1/usr/lib/{libother.so,libsdg.so.0}
        script=$PWD/scripts/c/install.sh
        cd $1
        $script usr
        ls usr/lib/{libother.so,libsdg.so,pkgconfig/sdg.pc}
        [ ! -e usr/lib/libsdg.so.0 ]",
    );
}
