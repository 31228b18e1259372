# Cargo with zig's linker for the machine that arch.sh has chosen, with glibc 2.31 or later (Debian 11, Ubuntu 20.04). zig has the symbols
# of glibc's versions and of other machines. To be sourced after arch.sh.
#   zig_cargo zigbuild|test ARGUMENTS    in the profile for distribution; PROFILE=release, the profile of `make build`, takes a quarter of
#                                        the time, for trials
#                                        AUDITABLE=1 writes the list of its crates into the program (cargo auditable)
#   built                                the folder of the compiled programs

source scripts/other_target.sh

GLIBC=2.31
profile=${PROFILE:-ship}
tools=target/packages/tools
mkdir -p "$tools"
# Not in the folder of the tools, which are compiled and would be deleted with the environment.
zig=target/packages/zig
scripts/python/venv.sh "$zig" cargo-zigbuild==0.24.1 ziglang==0.17.1
choose_compiler "$triple"
# A separate target folder, because linker and profile are different.
zig_target=target/packages/target
[ "$compiled_by" = rustup ] || zig_target=$zig_target-$compiled_by
built=$zig_target/$triple/$profile

if [ -n "${AUDITABLE:-}" ]; then
    [ -x "$tools/bin/cargo-auditable" ] || env -u CARGO_TARGET_DIR cargo install --quiet --debug --locked --root "$tools" cargo-auditable@0.7.7
    # zigbuild calls a single program as cargo.
    printf '#!/bin/sh\nexec "%s" auditable "$@"\n' "$cargo_for_target" >"$tools/auditable-cargo"
    chmod +x "$tools/auditable-cargo"
    cargo_for_target=$PWD/$tools/auditable-cargo
fi

zig_cargo() {
    local command=$1 runner=()
    shift
    [ ${#emulated[@]} = 0 ] || runner=("CARGO_TARGET_$(tr a-z- A-Z_ <<<"$triple")_RUNNER=${emulated[*]}")
    env PATH="$PWD/$zig/bin:$PWD/$tools/bin:$PATH" CARGO="$cargo_for_target" CARGO_TARGET_DIR="$zig_target" "${runner[@]}" \
        cargo-zigbuild "$command" --locked --profile "$profile" --target "$triple.$GLIBC" "${standard_library[@]}" "$@"
}
