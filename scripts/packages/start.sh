#!/bin/sh
# Starts the program beside this folder, in lib. With an older C library the system's loader would print one line for each missing
# version, and without glibc only "not found": this prints one line instead. It is installed as bin/sdg of the tarball.
glibc=$(getconf GNU_LIBC_VERSION 2>/dev/null) # such as "glibc 2.31"
version=${glibc#glibc }
major=${version%%.*} minor=${version#*.}
if [ -z "$glibc" ] && command -v getconf >/dev/null; then
    echo "sdg: expected glibc 2.31 or later, found another C library" >&2
    exit 1
elif [ -n "$glibc" ] && [ "$major" -le 2 ] && [ "${minor%%.*}" -lt 31 ]; then
    echo "sdg: expected glibc 2.31 or later, found $glibc" >&2
    exit 1
fi
exec "$(dirname "$(readlink -f "$0")")/../lib/sdg" "$@"
