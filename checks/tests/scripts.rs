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
        // The repositories of a script are its own, without a developer's settings.
        .env("GIT_CONFIG_GLOBAL", "/dev/null")
        .env("GIT_CONFIG_SYSTEM", "/dev/null")
        .env_remove("GIT_CONFIG_PARAMETERS")
        .env_remove("GIT_DIR")
        .env_remove("GIT_WORK_TREE")
        .env_remove("GIT_INDEX_FILE")
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

#[test]
fn a_release_is_not_compared_with_its_own_tag() {
    let found = bash(
        "mkdir -p $1/scripts/packages
        cp scripts/packages/semver.sh $1/scripts/packages
        cd $1
        git init -q
        commit() { git -c user.name=a -c user.email=a commit -q --allow-empty -m a; }
        cargo() { echo $*; }
        export -f cargo
        mkdir -p target/packages/tools/bin
        ln -s /bin/true target/packages/tools/bin/cargo-semver-checks
        for tag in v0.9.0 v0.10.0; do commit; git tag $tag; scripts/packages/semver.sh geometry; done",
    );
    assert!(found.starts_with("release: interfaces not compared"), "{found}");
    assert!(found.ends_with("semver-checks --baseline-rev v0.9.0 --package=sdg-geometry\n"), "{found}");
}

#[test]
fn packages_may_be_installed_for_several_architectures() {
    // The name of a package lists the architectures for which it is installed.
    let found = bash(
        r#"id() { echo 0; }
        dpkg() { echo amd64; }
        dpkg-query() {
            name=${4%:*}
            for kind in ${name//-/ }; do
                sed -e 's/${db:Status-Status}/installed/' -e "s/\${Architecture}/$kind/" -e 's/\\n//' <<<"$3"
            done
        }
        apt-get() { :; }
        env() { :; }
        export -f id dpkg dpkg-query apt-get env
        scripts/install.sh amd64-arm64 all arm64:arm64 arm64 2>&1"#,
    );
    assert_eq!(found, "setup: installing arm64\n");
}

/// A machine for [`bash`] with a C compiler, whose apt has no simulator.
const WITHOUT_SIMULATOR: &str = "export CARGO=cargo
    id() { echo 0; }
    cargo() { echo cargo $version; }
    dpkg() { echo amd64; }
    dpkg-query() { case ${@: -1} in gcc | libc6-dev) echo installed amd64 ;; *) return 1 ;; esac; }
    apt-get() { return 100; }
    apt-cache() { return 100; }
    export -f id cargo dpkg dpkg-query apt-get apt-cache
    export version\n";

#[test]
fn a_machine_without_simulator_builds_with_one_line() {
    let found = bash(&format!("version=99.0.0\n{WITHOUT_SIMULATOR}scripts/setup.sh 2>&1"));
    let last = found.lines().next_back().unwrap();
    assert!(last.contains("libmujoco-dev") && last.ends_with("does not simulate"), "{found}");
}

#[test]
fn an_old_compiler_is_told() {
    let found = bash(&format!("version=1.9.0\n{WITHOUT_SIMULATOR}! scripts/setup.sh 2>&1"));
    assert!(found.contains(concat!("expected Rust ", env!("CARGO_PKG_RUST_VERSION"))), "{found}");
}

/// A Python of version `$version` for [`bash`] that makes environments of programs without effect.
const PYTHON: &str = "python3() {
        case $1 in
        -V) echo Python $version ;;
        -m)
            mkdir -p $3/bin
            for program in python pip cargo-zigbuild; do ln -sf /bin/true $3/bin/$program; done
            echo $3 made for $version
            ;;
        esac
    }
    export -f python3
    export version\n";

/// The last components of the environments in an output, with their versions.
fn made(found: &str) -> Vec<&str> {
    found.lines().map(|line| line.rsplit_once('/').unwrap().1).collect()
}

#[test]
fn an_environment_is_made_again_for_another_python_or_folder() {
    let found = bash(&format!(
        "{PYTHON}for version in 3.11 3.11 3.12; do scripts/python/venv.sh $1/first a==1; done
        mv $1/first $1/second
        scripts/python/venv.sh $1/second a==1"
    ));
    assert_eq!(made(&found), ["first made for 3.11", "first made for 3.12", "second made for 3.12"]);
}

#[test]
fn the_environment_of_zig_is_made_again_and_leaves_the_compiled_tools() {
    // The compiler has every target.
    let found = bash(&format!(
        "{PYTHON}cp -r scripts $1
        cd $1
        export CARGO=true
        rustc() {{ echo .; }}
        triple=machine
        mkdir -p lib/rustlib/$triple target/packages/tools/bin
        ln -s /bin/true target/packages/tools/bin/cargo-auditable
        for version in 3.11 3.11 3.12; do (source scripts/packages/zig.sh); done
        [ -x target/packages/tools/bin/cargo-auditable ]"
    ));
    assert_eq!(made(&found), ["zig made for 3.11", "zig made for 3.12"]);
}

#[test]
fn packages_are_not_built_without_git() {
    let found = bash(
        "cp -r scripts $1
        cd $1
        export GIT_CEILING_DIRECTORIES=${PWD%/*}
        for package in deb tarball image windows lay_out; do ! scripts/packages/$package.sh usr 2>&1; done",
    );
    assert_eq!(found.matches("packages: expected a git clone").count(), 5, "{found}");
}

#[test]
fn jobs_of_another_cluster_are_not_cancelled() {
    // Everything after the daemon of munge fails.
    let found = bash(
        "id() { echo 0; }
        dpkg() { echo amd64; }
        dpkg-query() { echo installed amd64; }
        munged() { echo munged; return 1; }
        squeue() { echo 7; }
        scancel() { echo cancelled $*; }
        sleep() { :; }
        export -f id dpkg dpkg-query munged squeue scancel sleep
        export CARGO_TARGET_DIR=$1 SDG=/bin/true
        ! scripts/test-slurm.sh 2>&1",
    );
    assert_eq!(found, "munged\n");
}

#[test]
fn no_programs_are_not_equal_programs() {
    // Each program contains the name of its folder, unless `same` is given.
    let found = bash(
        "git() { :; }
        tar() { :; }
        cargo() {
            mkdir -p $CARGO_TARGET_DIR/release
            cd $CARGO_TARGET_DIR/release
            for name in $programs; do pwd >$name; chmod +x $name; done
            [ -z \"$same\" ] || echo $same >sdg-bench
        }
        export -f git tar cargo
        export TMPDIR=$1 programs same
        ! programs= same= scripts/reproducible.sh 2>&1
        ! programs=sdg-bench same= scripts/reproducible.sh 2>&1 | tail -n 1
        programs='sdg-bench sdg-0123456789abcdef' same=bytes scripts/reproducible.sh 2>&1 | tail -n 1",
    );
    let lines: Vec<&str> = found.lines().collect();
    let [none, differing, equal] = lines[..] else { panic!("{found}") };
    assert!(none.ends_with("expected programs of cargo build --package sdg-fci --example hand_checks, found none"));
    assert!(differing.contains("expected equal files"), "{found}");
    assert!(equal.contains("reproducible: equal"), "{found}");
}
