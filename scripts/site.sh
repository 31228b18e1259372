#!/usr/bin/env bash
# Builds the site into target/site, a folder that any static host serves. Called by `make site`, after `make web`.
#
# The pages have the same paths as in the repository, with README.md as the front page, so all links between them are valid.
# docs/SUMMARY.md lists the pages; the checks crate tests that the list is complete.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/mdbook.sh
book=target/site-source
out=$PWD/target/site
# Files that pages link to or show, in addition to the pages.
files=('*.md' 'docs/*.svg' 'datasets/pictures' 'datasets/models' 'datasets/workcell' 'datasets/demonstrations'
    crates/capi/include/sdg.h crates/grasp/src/lib.rs fuzz/src/lib.rs tests/endurance/src/lib.rs python/notebook tests/golden/torchvision/export.py)

rm -rf "$book" "$out.new"
mkdir -p "$book/src" "$book/theme/fonts"
git ls-files -z --cached --others --exclude-standard -- "${files[@]}" | xargs -0 cp --parents -t "$book/src"
# Converts paths relative to docs/ to paths relative to the root.
sed -e 's/](\.\.\//](/; t' -e 's/](/](docs\//' docs/SUMMARY.md >"$book/src/SUMMARY.md"
cp docs/site/book.toml "$book/"
cp docs/site/index.hbs "$book/theme/"
# Without mdBook's fonts.
: >"$book/theme/fonts/fonts.css"
MDBOOK_LOG=warn target/tools/bin/mdbook build "$book" --dest-dir "$out.new"

# mdBook's scripts and styles are left out. The list of all pages leaves out pages of the third level, which a page of the second level
# lists, and addresses of pages end with .html. mdBook makes index.html of README.md, but does not change links to it. A picture is a link
# to itself, which a phone shows enlarged, instead of mdBook's checkbox, which shows it twice. Elements that scroll sideways can be reached
# by the keyboard, a table's empty corner is no heading, and a short option stays on one line.
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
# Replaced at once, so it is never incomplete.
rm -rf "$out"
mv "$out.new" "$out"
echo "target/site: $(find "$out" -name '*.html' | wc -l) pages; to view them: python3 -m http.server --directory target/site" >&2
