# Chooses the compiler for another kind of machine; to be sourced. Call it as `choose_compiler TARGET`.
#
# Rust's targets come from rustup. If rustup is not available, Debian's compiler is used, which has the source of the standard
# library: packages rustc-web, cargo-web, rust-web-src. The library is then compiled with the program, which the compiler allows only
# with RUSTC_BOOTSTRAP.

# Sets `cargo_for_target` (a path), `standard_library` (arguments for cargo, empty if the target is installed), `compiled_by` (rustup or
# debian, which cannot use each other's output), and exports RUSTC if cargo does not find it by itself.
choose_compiler() {
    local target=$1 unwinding=${2:-panic_unwind}
    cargo_for_target=$(command -v "${CARGO:-cargo}")
    standard_library=()
    compiled_by=rustup
    has_target() { [ -d "$(rustc --print sysroot)/lib/rustlib/$target" ]; }
    if has_target || { command -v rustup >/dev/null && timeout 120 rustup target add "$target" >&2 && has_target; }; then
        return
    fi
    if ! command -v apt-get >/dev/null; then
        echo "build: Rust's target $target is missing: rustup target add $target" >&2
        exit 1
    fi
    "$(dirname "${BASH_SOURCE[0]}")/install.sh" rustc-web cargo-web rust-web-src lld-22
    export RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1
    cargo_for_target=/usr/bin/cargo
    standard_library=("-Zbuild-std=std,$unwinding")
    compiled_by=debian
}
