// The four steps, as tabs.

import { api } from "./api.js";
import { by, wait } from "./elements.js";
import { isMarked, showCurrent } from "./strip.js";
import { adoptModels, changed, isLive, state } from "./store.js";

const NAMES = ["mark", "samples", "teach", "try"];
const tab = (name) => by(`tab-${name}`);

export function openTab(name) {
  if (state.tab === name) return;
  const before = [state.tab === "try", isLive()];
  Object.assign(state, { tab: name, draft: null });
  // Shown again only if the stage gets another picture, so that the view is otherwise kept.
  if (String(before) !== String([name === "try", isLive()])) showCurrent();
  changed();
  document.querySelector(".panel").scrollTop = 0;
  if (name === "teach" || name === "try") refreshVersions();
}

/** Requests the versions again: changed marks may have made them stale. */
async function refreshVersions() {
  try {
    // Marks that are being sent come first.
    while (state.images.some((photo) => photo.saving)) await wait(50);
    adoptModels(await api.session());
    changed();
  } catch {
    // The banner says that the server is gone.
  }
}

for (const name of NAMES) {
  tab(name).addEventListener("click", () => openTab(name));
  tab(name).addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const next = NAMES[(NAMES.indexOf(name) + step + NAMES.length) % NAMES.length];
    openTab(next);
    tab(next).focus();
  });
}
for (const button of document.querySelectorAll("[data-next]")) {
  button.addEventListener("click", () => {
    openTab(button.dataset.next);
    tab(button.dataset.next).focus();
  });
}

export function renderTabs() {
  const done = { mark: isMarked(), samples: false, teach: state.hasModel, try: state.images.length > 0 && state.trialPictures.some((s) => s.became !== null) };
  // The tab of the next step is highlighted, since the button in the panel may be out of view.
  const next = { mark: isMarked() && "samples", samples: "teach", teach: state.hasModel && "try" }[state.tab];
  for (const name of NAMES) {
    const open = name === state.tab;
    tab(name).classList.toggle("next", name === next);
    tab(name).setAttribute("aria-selected", String(open));
    tab(name).tabIndex = open ? 0 : -1;
    tab(name).classList.toggle("done", Boolean(done[name]) && !open);
    by(`panel-${name}`).hidden = !open;
  }
  document.querySelector("main").dataset.tab = state.tab;
  const samples = state.tab === "samples";
  by("stage").hidden = samples;
  by("tools").hidden = samples;
  by("sheet").hidden = !samples;
}
