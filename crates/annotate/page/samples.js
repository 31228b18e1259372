// The second step: a sheet of samples made from the marks.

import { api } from "./api.js";
import { by, element, offBecause, shows } from "./elements.js";
import { image, isAnyMarked, state } from "./store.js";

const COUNT = 12;
const sheet = by("sheet");
const problem = by("samples-error");
let first = 0;

by("other-samples").addEventListener("click", () => {
  first += COUNT;
  renderSamples();
});

/** Shows samples of the current marks; pictures are requested again only if the marks have changed. */
export function renderSamples() {
  if (state.tab !== "samples") return;
  const isBoxed = image() && (image().marks.box || image().marks.outline);
  offBecause(by("other-samples"), !isBoxed && "Draw a box around the part first");
  offBecause(document.querySelector("#panel-samples [data-next=teach]"), !isAnyMarked() && "Mark box and grasp on a photo first");
  if (!image()) {
    problem.hidden = false;
    problem.textContent = "There is nothing to show yet: take a photo of the part first.";
    return sheet.replaceChildren();
  }
  const { id, marks, committed } = image();
  if (shows(sheet, [id, first, committed])) return;
  problem.hidden = Boolean(marks.box || marks.outline);
  if (!problem.hidden) {
    problem.textContent = "There is nothing to show yet: draw a box around the part first.";
    return sheet.replaceChildren();
  }
  // With the revision, the samples of changed marks have other addresses.
  const revision = image().revision;
  sheet.replaceChildren(...Array.from({ length: COUNT }, (_, i) => {
    const item = element("li");
    const picture = element("img");
    picture.alt = `Sample ${first + i + 1}`;
    picture.width = image().width;
    picture.height = image().height;
    picture.src = api.sampleUrl(id, first + i, 1, revision);
    picture.addEventListener("error", explain);
    item.append(picture);
    return item;
  }));
}

/** The server's error text for a sample. */
async function explain(event) {
  if (!problem.hidden) return;
  problem.hidden = false;
  const response = await fetch(event.target.src).catch(() => null);
  // Without an answer, the next rendering requests the samples again.
  if (!response) delete sheet.dataset.shown;
  const answer = await response?.json().catch(() => null);
  problem.textContent = answer?.error ?? "The samples could not be made.";
}
