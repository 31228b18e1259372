//! Finds libmujoco and, with feature `buildtime_bindgen`, regenerates the bindings.
//!
//! `MUJOCO_LIB_DIR` names another folder that holds `libmujoco.so`, `MUJOCO_INCLUDE_DIR` another
//! one that holds `mujoco/mujoco.h`.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

const LIBRARY: &str = "libmujoco.so";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=MUJOCO_LIB_DIR");
    println!("cargo:rerun-if-env-changed=MUJOCO_INCLUDE_DIR");

    match library_dir() {
        Some(dir) => {
            println!("cargo:rerun-if-changed={}", dir.join(LIBRARY).display());
            println!("cargo:rustc-link-search=native={}", dir.display());
        }
        None => {
            // `cargo::error` fails the build with this line alone, without a panic's backtrace.
            println!(
                "cargo::error={LIBRARY} was not found. Expected MuJoCo 2.2.2; on Debian 12 install it with \
                 `apt-get install libmujoco-dev libegl1 libgl1-mesa-dri`, or set MUJOCO_LIB_DIR to the \
                 folder that holds it."
            );
            return;
        }
    }
    println!("cargo:rustc-link-lib=dylib=mujoco");

    #[cfg(feature = "buildtime_bindgen")]
    generate();
}

/// The first folder that holds the library: the one asked for, else where the C compiler would
/// find it, else the usual places.
fn library_dir() -> Option<PathBuf> {
    if let Some(dir) = env::var_os("MUJOCO_LIB_DIR") {
        let dir = PathBuf::from(dir);
        return dir.join(LIBRARY).exists().then_some(dir);
    }
    let from_compiler = Command::new("cc")
        .arg(format!("-print-file-name={LIBRARY}"))
        .output()
        .ok()
        .and_then(|output| String::from_utf8(output.stdout).ok())
        .map(|path| PathBuf::from(path.trim()))
        .filter(|path| path.is_absolute() && path.exists())
        .and_then(|path| path.parent().map(Path::to_path_buf));
    let usual = || {
        ["/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib", "/usr/local/lib"]
            .into_iter()
            .map(PathBuf::from)
            .find(|dir| dir.join(LIBRARY).exists())
    };
    from_compiler.or_else(usual)
}

/// Writes `bindings.rs` for the installed headers into `OUT_DIR`. The committed `src/bindings.rs`
/// is this file, made from MuJoCo 2.2.2.
#[cfg(feature = "buildtime_bindgen")]
fn generate() {
    let include = env::var("MUJOCO_INCLUDE_DIR").unwrap_or_else(|_| "/usr/include".to_owned());
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join("bindings.rs");
    let generated = bindgen::Builder::default()
        .header_contents("mujoco_all.h", "#include <mujoco/mujoco.h>\n")
        .clang_arg(format!("-I{include}"))
        .allowlist_function("mj_.*|mjv_.*|mjr_.*|mju_error|mju_warning|mju_clearHandlers")
        .allowlist_var("mju_user_error|mju_user_warning|mjVERSION_HEADER|mjMINVAL|mjMAX.*|mjN.*")
        .allowlist_type("mjt.*")
        .blocklist_type("_IO_.*|FILE")
        .blocklist_function("mj_printFormatted.*|mju_print.*")
        .default_enum_style(bindgen::EnumVariation::Consts)
        .prepend_enum_name(false)
        .derive_default(false)
        .layout_tests(true)
        .merge_extern_blocks(true)
        // Our error handler unwinds out of MuJoCo instead of letting it end the process.
        .override_abi(bindgen::Abi::CUnwind, ".*")
        .use_core()
        .generate_comments(false)
        .generate()
        .expect("bindgen failed on mujoco/mujoco.h: is libclang-dev installed?");
    generated.write_to_file(out).expect("the bindings could not be written to OUT_DIR");
}
