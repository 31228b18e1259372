#!/usr/bin/env bash
# Coverage of crates robot, fci and kinematics by their own tests and by those of crate simulation, which drive them. It uses
# rustc's instrumentation, read by Debian's llvm-22; all files are in target/coverage. Lines of tests are not counted: neither files
# of tests nor the lines from `#[cfg(test)]` to the end of a file.
#
#   CRATES="robot fci"   the crates that are counted
#   FILES=1              also files, with the numbers of lines that no test reaches
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install.sh llvm-22
crates=(${CRATES:-robot fci kinematics})
llvm=/usr/lib/llvm-22/bin
work=$PWD/target/coverage
mkdir -p "$work"
rm -rf "$work/profiles"

export CARGO_TARGET_DIR=$work RUSTC_WORKSPACE_WRAPPER=$PWD/scripts/hardening/instrument.sh
# One file per process would fill the disk; with %4m the processes themselves merge their counts into 4 files.
export LLVM_PROFILE_FILE=$work/profiles/%4m.profraw
packages=(-p sdg-robot -p sdg-fci -p sdg-kinematics -p sdg-simulation)
if cargo nextest --version >/dev/null 2>&1; then
    cargo nextest run --release --locked "${packages[@]}" --lib --bins --tests --no-fail-fast
else
    cargo test --release --locked "${packages[@]}" --lib --bins --tests --no-fail-fast
fi

"$llvm/llvm-profdata" merge -sparse "$work"/profiles/*.profraw -o "$work/all.profdata"
# The programs of tests, as cargo names them.
mapfile -t programs < <(cargo test --release --locked "${packages[@]}" --lib --bins --tests --no-run --message-format json 2>/dev/null |
    grep -o '"executable":"[^"]*"' | cut -d '"' -f 4 | sort -u)
objects=()
for program in "${programs[@]}"; do objects+=(-object "$program"); done
"$llvm/llvm-cov" export --format=lcov --instr-profile "$work/all.profdata" "${objects[@]}" >"$work/all.lcov"
"$llvm/llvm-cov" export --skip-expansions --instr-profile "$work/all.profdata" "${objects[@]}" >"$work/all.json"

FILES=${FILES:-} python3 scripts/coverage.py "$PWD" "$work/all.lcov" "$work/all.json" "${crates[@]}"
