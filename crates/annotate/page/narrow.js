// On a narrow screen, some elements have other places, also in the document: Tab follows the order from top to bottom.

import { by } from "./elements.js";

const narrow = matchMedia("(max-width: 860px)");

function place() {
  const [inOut, tabs, results] = ["in-out", "tabs", "results"].map(by);
  if (narrow.matches) {
    // Above the photo, because the panel is below the photo.
    by("zoom-tools").before(inOut);
    by("corner").after(tabs);
    // Directly below the pictures.
    by("live").after(results);
  } else {
    by("do-outline").append(inOut);
    by("corner").before(tabs);
    by("panel-try").append(results);
  }
}
narrow.addEventListener("change", place);
place();
