// Notes over the picture.

import { button, by, element } from "./elements.js";

const SHOWN_MS = 3500;
/** Notes with a button are shown longer: they must be read and reached. */
const SHOWN_WITH_BUTTON_MS = 12000;

/** Shows `text` for some seconds; with `action`, a `{ text, run }`, a button beside it. */
export function toast(text, action = null) {
  const note = element("p", { textContent: text });
  by("toasts").append(note);
  const act = () => {
    note.remove();
    action.run();
  };
  if (action) note.append(button(action.text, act));
  const end = () => {
    // The note stays while the pointer or the focus is on it.
    if (note.matches(":hover, :focus-within")) setTimeout(end, SHOWN_MS);
    else note.remove();
  };
  setTimeout(end, action ? SHOWN_WITH_BUTTON_MS : SHOWN_MS);
}

/** Shows `sentences` in one note until its button is pressed, for facts that no other place shows. */
export function notice(sentences) {
  if (!sentences.length) return;
  const note = element("div");
  for (const sentence of sentences) note.append(element("p", { textContent: sentence }));
  note.append(button("OK", () => note.remove()));
  by("toasts").append(note);
}
