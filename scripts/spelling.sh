#!/usr/bin/env bash
# Lists the words of the documents that are neither in a British dictionary nor in docs/site/words.txt, and fails if there are any.
# Code, comments, addresses, paths and names with digits are left out. Called by `make lint`. `scripts/spelling.sh FILE …` checks these files.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install.sh hunspell hunspell-en-gb
if [ $# -gt 0 ]; then files=("$@"); else mapfile -t files < <(git ls-files --cached --others --exclude-standard -- '*.md'); fi

unknown=0
for file in "${files[@]}"; do
    [ -f "$file" ] || continue
    words=$(awk '/^[[:space:]]*```/ { code = !code; next } !code' "$file" |
        sed -E -e 's/`[^`]*`//g' -e 's/\]\([^)]*\)/]/g' -e 's/<[^>]*>//g' -e 's#https?://[^ )]*##g' -e 's/&[a-z]+;//g' \
            -e "s/['’]s\b//g" -e 's#[[:alnum:]_.-]*[/_][[:alnum:]_./-]*##g' -e 's/[[:alnum:]*-]*\.[a-z]{2,5}\b//g' -e 's/\b[[:alpha:]]*[0-9][[:alnum:]]*\b//g' |
        hunspell -i utf-8 -d en_GB -l | sort -u | { grep -vxFf docs/site/words.txt || true; } | paste -sd' ')
    [ -z "$words" ] || { echo "$file: $words"; unknown=1; }
done
if [ "$unknown" = 1 ]; then
    echo "spelling: expected words of the dictionary or of docs/site/words.txt, found the words above" >&2
    exit 1
fi
