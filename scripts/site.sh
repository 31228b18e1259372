#!/usr/bin/env bash
# Builds the site into target/site, a folder that any static host serves. Called by `make site`, after `make web`.
#
# The pages are laid out as they lie in the repository, README.md as the front page, so that every link between them holds.
# docs/SUMMARY.md says which pages there are; the checks crate looks whether that is all.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/mdbook.sh
book=target/site-source
out=$PWD/target/site
# What pages link to or show, beside pages.
files=('*.md' 'docs/*.svg' 'datasets/pictures' 'datasets/models' 'datasets/workcell' 'datasets/demonstrations'
    crates/capi/include/sdg.h crates/grasp/src/lib.rs fuzz/src/lib.rs tests/endurance/src/lib.rs python/notebook tests/golden/torchvision/export.py)

rm -rf "$book" "$out.new"
mkdir -p "$book/src" "$book/theme/fonts"
git ls-files -z --cached --others --exclude-standard -- "${files[@]}" | xargs -0 cp --parents -t "$book/src"
# From docs/ to the root.
sed -e 's/](\.\.\//](/; t' -e 's/](/](docs\//' docs/SUMMARY.md >"$book/src/SUMMARY.md"
cp docs/site/book.toml "$book/"
cp docs/site/index.hbs "$book/theme/"
# No fonts of mdBook's.
: >"$book/theme/fonts/fonts.css"
MDBOOK_LOG=warn target/tools/bin/mdbook build "$book" --dest-dir "$out.new"

# Pages that show nothing of mdBook's own: its scripts and styles are left out. In the list of all pages, those of the third level are
# left out, which one of the second level lists, and addresses of pages end with .html. mdBook makes index.html of README.md, but leaves
# links to it as they are. A picture is a link to itself, by which a phone shows it large, instead of mdBook's checkbox, which shows it twice. The keyboard reaches what
# scrolls sideways, a table's empty corner is no heading, and a short option stays on one line.
find "$out.new" -maxdepth 1 -type f ! -name '*.html' -delete
rm -rf "$out.new/css" "$out.new/fonts" "$out.new/toc.html" "$out.new/docs/site"
find "$out.new" -name '*.html' -exec sed -i -E \
    -e '/<li data-section="[0-9]+\.[0-9]+\."/d' -e 's/<li data-section="[^"]*">/<li>/' -e '/<li><a href=/s/\.md"/.html"/' \
    -e 's/(href="[^"]*)README\.html/\1index.html/g' \
    -e 's#<th( [^>]*)?></th>#<td></td>#g' -e 's#<code>(--[^<]{1,28})</code>#<code class="option">\1</code>#g' \
    -e 's/<pre>/<pre tabindex="0">/g' -e 's/<div class="table-wrapper">/<div class="table-wrapper" tabindex="0">/g' \
    -e 's#<label class="checkbox-label"><input[^>]*>(<img src="([^"]*)"[^>]*>)<span[^>]*><img[^>]*></span></label>#<a href="\2">\1</a>#g' {} +
cp docs/site/site.css crates/annotate/page/icon.svg "$out.new/"
cp -r target/web "$out.new/detector"
# Whole or not at all.
rm -rf "$out"
mv "$out.new" "$out"
echo "target/site: $(find "$out" -name '*.html' | wc -l) pages; for one who looks here, python3 -m http.server --directory target/site" >&2
