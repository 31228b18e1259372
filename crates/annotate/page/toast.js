// Notes over the picture.

import { by } from "./elements.js";

const SHOWN_MS = 3500;
/** Notes with a button are shown longer: they must be read and reached. */
const SHOWN_WITH_BUTTON_MS = 12000;
/** Maximum number of sentences in one notice. */
const MAX_SENTENCES = 4;

/** Shows `text` for some seconds; with `action`, a `{ text, run }`, a button beside it. */
export function toast(text, action = null) {
  const note = document.createElement("p");
  note.textContent = text;
  by("toasts").append(note);
  if (action) {
    const button = Object.assign(document.createElement("button"), { textContent: action.text });
    button.addEventListener("click", () => {
      note.remove();
      action.run();
    });
    note.append(button);
  }
  const end = () => {
    // The note stays while the pointer or the focus is on it.
    if (note.matches(":hover, :focus-within")) setTimeout(end, SHOWN_MS);
    else note.remove();
  };
  setTimeout(end, action ? SHOWN_WITH_BUTTON_MS : SHOWN_MS);
}

/** Shows the first of `sentences` in one note until its button is pressed, for facts that no other place shows. */
export function notice(sentences) {
  if (!sentences.length) return;
  const note = document.createElement("div");
  const hidden = sentences.length - MAX_SENTENCES;
  const shown = hidden > 0 ? [...sentences.slice(0, MAX_SENTENCES), `${hidden} more notes like these.`] : sentences;
  for (const sentence of shown) note.append(Object.assign(document.createElement("p"), { textContent: sentence }));
  const button = Object.assign(document.createElement("button"), { textContent: "OK" });
  button.addEventListener("click", () => note.remove());
  note.append(button);
  by("toasts").append(note);
}
