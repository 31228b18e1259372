// Short notes that go away by themselves.

const SHOWN_MS = 3500;

export function toast(text) {
  const note = document.createElement("p");
  note.textContent = text;
  document.getElementById("toasts").append(note);
  setTimeout(() => note.remove(), SHOWN_MS);
}
