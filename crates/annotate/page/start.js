// Without a project: opens a recent one, or creates a new one from a photo.

import { api } from "./api.js";
import { button, by, element } from "./elements.js";
import { PICTURE } from "./words.js";

/** Names that cameras and people give to any picture, as in ../src/names.rs. */
const ANY_NAME = /^(photo|image|picture|img|pic|dsc|dscn|dscf|pxl|p|demo|frame|screenshot|webcam)?[\W\d_]*$/i;
let photo = null;

function fail(message) {
  by("start-error").hidden = !message;
  by("start-error").textContent = message;
}

async function go(work) {
  try {
    fail("");
    await work();
    location.reload();
  } catch (error) {
    fail(error.message);
  }
}

function choose(file) {
  if (!file) return;
  if (!PICTURE.test(file.name)) return fail(`${file.name}: expected a picture: PNG, JPEG, WebP, BMP or TIFF.`);
  fail("");
  photo = file;
  const shown = by("new-photo");
  URL.revokeObjectURL(shown.src);
  shown.src = URL.createObjectURL(file);
  shown.alt = file.name;
  by("new-part").hidden = false;
  const stem = file.name.replace(/\.\w+$/, "");
  if (!by("new-name").value && !ANY_NAME.test(stem)) by("new-name").value = stem.slice(0, 60);
  by("new-name").focus();
}

export function showStart({ folder, recent }) {
  for (const part of document.querySelectorAll("main, .steps")) part.hidden = true;
  by("start").hidden = false;
  document.title = "Projects · Teach a grasp";
  by("new-where").textContent = `Photo, marks and models go into a new folder of this name in ${folder}.`;
  by("new-choose").addEventListener("click", () => by("new-input").click());
  by("new-input").addEventListener("change", () => choose(by("new-input").files[0]));
  by("new-part").addEventListener("submit", (event) => {
    event.preventDefault();
    go(() => api.createProject(by("new-name").value, photo));
  });
  for (const kind of ["dragover", "dragleave", "drop"]) {
    document.body.addEventListener(kind, (event) => {
      event.preventDefault();
      by("new-drop").classList.toggle("dropping", kind === "dragover");
      if (kind === "drop") choose(event.dataTransfer.files[0]);
    });
  }
  by("recent").hidden = !recent.length;
  by("recent-list").replaceChildren(...recent.map(({ id, name, path, opened_secs: secs }) => {
    const item = element("li");
    const open = button("", () => go(() => api.openProject(id)));
    const when = new Date(secs * 1000).toLocaleString();
    for (const [tag, text] of [["b", name], ["small", path], ["small", when]]) open.append(element(tag, { textContent: text }));
    item.append(open);
    return item;
  }));
}
