// Short notes that disappear by themselves.

import { by } from "./elements.js";

const SHOWN_MS = 3500;
/** Notes with a button are shown longer: they must be read and reached. */
const SHOWN_WITH_BUTTON_MS = 12000;

/** Shows `text`; with `action`, a `{ text, run }`, a button beside it. */
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
