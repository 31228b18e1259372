// The page: loads the session from the server, then renders `state` after every change.

import { api, belongTo } from "./api.js";
import { by, stored } from "./elements.js";
import { openFolder, renderFolder } from "./folder.js";
import "./gestures.js";
import { renderLive } from "./live.js";
import { renderMarkPanel } from "./mark_panel.js";
import "./narrow.js";
import { renderOverlay } from "./overlay.js";
import { renderRegion } from "./region.js";
import { renderSamples } from "./samples.js";
import { beat, renderUnsaved, sendKept } from "./server_end.js";
import { showStart } from "./start.js";
import { onChange, state } from "./store.js";
import { adoptSession, openImage, renderStrip, showCurrent, shownName } from "./strip.js";
import { renderTabs } from "./tabs.js";
import { renderTeach, watch } from "./teach.js";
import { notice } from "./toast.js";
import { renderTry } from "./try.js";
import { renderVersions } from "./versions.js";
import { fitOrPart } from "./keyboard.js";
import { renderView, zoom } from "./view.js";

/** The theme is stored in the browser. */
const THEMES = ["auto", "light", "dark"];
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  by("theme-name").textContent = theme;
  stored("theme", theme);
}
by("theme").addEventListener("click", () => {
  const now = THEMES.indexOf(document.documentElement.dataset.theme);
  setTheme(THEMES[(now + 1) % THEMES.length]);
});
setTheme(THEMES.includes(stored("theme")) ? stored("theme") : "auto");

by("help-button").addEventListener("click", () => by("help").showModal());
by("zoom-in").addEventListener("click", () => zoom(1.25));
by("zoom-out").addEventListener("click", () => zoom(0.8));
by("zoom-fit").addEventListener("click", fitOrPart);

onChange(() => {
  // Nothing is shown before the server has answered.
  if (state.project === undefined) return;
  for (const render of [renderTabs, renderView, renderOverlay, renderStrip, renderMarkPanel, renderSamples, renderTeach, renderVersions, renderTry, renderLive, renderRegion, renderFolder, renderUnsaved]) render();
  document.title = `${shownName() || "Photo"} · Teach a grasp`;
});

// The token from the address is in a cookie now: it is removed from the address and the history.
history.replaceState(null, "", "/");

try {
  const session = await api.session();
  if (session.start) showStart(session.start);
  else await open(session);
} catch (error) {
  by("hint").textContent = error.message;
}

async function open(session) {
  belongTo(session);
  const teaching = await api.teaching();
  Object.assign(state, {
    isCalibrated: session.is_calibrated,
    teaching,
    camera: session.camera,
  });
  adoptSession(session);
  if (state.images.length) openImage(session.shown);
  else showCurrent();
  by("projects").hidden = !session.can_close;
  if (!state.images.length && !state.camera && state.others.length) openFolder("photo");
  watch();
  notice(session.notes);
  sendKept();
  beat();
}
