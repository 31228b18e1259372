//! Sets the soname of the shared library; its number is `SDG_ABI_VERSION`.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-link-arg=-Wl,-soname,libsdg.so.1");
}
