// Lists, names, shares and durations as text.

export const percent = (share) => `${Math.round(share * 100)}\u00a0%`;
export const seconds = (s) => (s < 90 ? `${Math.round(s)} s` : `${Math.floor(s / 60)} min ${Math.round(s % 60)} s`);

export const pictures = (count) => `${count} picture${count === 1 ? "" : "s"}`;

/** At most `most` of the words as a list, and the number of the others. */
export function listText(words, most = Infinity) {
  const more = words.length - most;
  return new Intl.ListFormat("en").format(more > 0 ? [...words.slice(0, most), `${more} more`] : words);
}

/** Names of pictures that can be read. */
export const PICTURE = /\.(png|jpe?g|webp|bmp|tiff?)$/i;

const collator = new Intl.Collator("en", { numeric: true });
/** Orders files and pictures by name, numbers in names by value. */
export const byName = (a, b) => collator.compare(a.webkitRelativePath || a.name, b.webkitRelativePath || b.name);
