"""Lets PyPI's torch for Linux start without the CUDA packages, 2.5 GB that a CPU never runs.

That torch is linked against CUDA's libraries, so it does not load without them, although it computes on the CPU with
the same code (oneDNN and MKL, both inside libtorch_cpu.so) as any other build. This script writes a replacement for
each missing library, in which every function returns "no device" (CUDA's error 100), as the real ones do on a machine
without a device. The code that runs on the CPU is torch's own, unchanged.

usage: without_cuda.py SITE_PACKAGES
"""

import pathlib
import re
import subprocess
import sys
import tempfile

# CUDA's own libraries; every Linux has the other libraries that torch needs.
CUDA_LIBRARY = re.compile(r"^lib(cu|nv|nccl)")
CUDA_FUNCTION = re.compile(r"^_*(cu|nv|nccl)[A-Za-z]")


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def symbols(library, which):
    lines = output("nm", "-D", which, str(library)).splitlines()
    return {line.split()[-1].split("@")[0] for line in lines}


def build(library, source, *libraries):
    with tempfile.NamedTemporaryFile("w", suffix=".c") as file:
        file.write(source)
        file.flush()
        flags = ["-shared", "-fPIC", "-fno-builtin", "-w", f"-Wl,-soname,{library.name}"]
        output("gcc", *flags, "-o", str(library), file.name, *libraries)


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: without_cuda.py SITE_PACKAGES")
    folder = pathlib.Path(sys.argv[1]) / "torch" / "lib"
    libraries = [path for path in sorted(folder.glob("*.so*")) if path.is_file() and not CUDA_LIBRARY.match(path.name)]
    if not libraries:
        sys.exit(f"{folder}: expected torch's libraries, found none")
    needed, wanted, there = set(), set(), set()
    for library in libraries:
        needed |= set(re.findall(r"NEEDED.*\[(.*)\]", output("readelf", "-d", str(library))))
        wanted |= symbols(library, "--undefined-only")
        there |= symbols(library, "--defined-only")
    missing = sorted(name for name in needed if CUDA_LIBRARY.match(name))
    functions = sorted(name for name in wanted - there if CUDA_FUNCTION.match(name))
    if not missing:
        return
    # Names and messages of errors are pointers to text.
    source = "\n".join(
        f'const char *{name}(void) {{ return "no CUDA on this machine"; }}'
        if re.search(r"Error(String|Name)|GetLastError.+|ErrorMessage", name)
        else f"long {name}(void) {{ return 100; }}"
        for name in functions
    )
    # The functions are in a separate library, because the loader accepts CUDA's names only with their versions.
    build(folder / "libno_device.so", source)
    for name in missing:
        build(folder / name, "", "-Wl,--no-as-needed", f"-L{folder}", "-l:libno_device.so", "-Wl,-rpath,$ORIGIN")
    print(f"torch without CUDA: {len(functions)} functions of {len(missing)} libraries say that there is no device")


main()
