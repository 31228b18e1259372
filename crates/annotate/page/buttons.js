// Buttons: made in one way, and off with the reason why.

/** A button with these words. */
export function button(text, action, classes = "") {
  const made = Object.assign(document.createElement("button"), { type: "button", textContent: text, className: classes });
  made.addEventListener("click", action);
  return made;
}

const titles = new WeakMap();

/** Turns a control off for a reason, which its title tells, or on where there is none. */
export function offBecause(control, reason) {
  if (!titles.has(control)) titles.set(control, control.title);
  control.disabled = Boolean(reason);
  const title = reason || titles.get(control);
  if (control.title !== title) control.title = title;
}
