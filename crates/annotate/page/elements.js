// Finds elements, creates buttons, and disables controls with a reason.

export const by = (id) => document.getElementById(id);

export const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Sets a text only if it differs: screen readers announce every text that is set. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Whether an element shows this content already; if not, the caller shows it now. */
export function shows(element, content) {
  const key = JSON.stringify(content);
  if (element.dataset.shown === key) return true;
  element.dataset.shown = key;
  return false;
}

/** A new element with these fields. */
export const element = (tag, fields) => Object.assign(document.createElement(tag), fields);

/** A button with this text. */
export function button(text, action, classes = "") {
  const made = element("button", { type: "button", textContent: text, className: classes });
  made.addEventListener("click", action);
  return made;
}

/** Changes a value in the browser's storage (null: removes it) and returns it; null if the browser refuses storage. */
export function stored(key, value) {
  try {
    if (value === null) localStorage.removeItem(key);
    else if (value !== undefined) localStorage.setItem(key, value);
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

const titles = new WeakMap();

/** Disables a control and puts the reason into its title; enables it if there is no reason. */
export function offBecause(control, reason) {
  if (!titles.has(control)) titles.set(control, control.title);
  control.disabled = Boolean(reason);
  const title = reason || titles.get(control);
  if (control.title !== title) control.title = title;
}
