//! With feature `buildtime_bindgen`, regenerates the bindings from the installed headers.
//!
//! `MUJOCO_INCLUDE_DIR` gives another folder that contains `mujoco/mujoco.h`.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=MUJOCO_INCLUDE_DIR");

    #[cfg(feature = "buildtime_bindgen")]
    generate();
}

/// Writes `bindings.rs` for the installed headers into `OUT_DIR`. The committed `src/bindings.rs`
/// is this file, made from MuJoCo 2.2.2.
#[cfg(feature = "buildtime_bindgen")]
fn generate() {
    use std::env;
    use std::path::PathBuf;

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
        // Our error handler unwinds out of MuJoCo instead of ending the process.
        .override_abi(bindgen::Abi::CUnwind, ".*")
        .use_core()
        .generate_comments(false)
        .generate()
        .expect("bindgen failed on mujoco/mujoco.h: is libclang-dev installed?");
    generated.write_to_file(out).expect("the bindings could not be written to OUT_DIR");
}
