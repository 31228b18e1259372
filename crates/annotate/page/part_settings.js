// The settings of the third step that describe the part. With other settings, a taught model is old.

import { by } from "./elements.js";
import { state } from "./store.js";

export const OLD = "photos, marks, pictures without the part, or the settings for symmetry or height have changed since";

export const partSettings = () => ({
  symmetry: Number(document.querySelector("[name=symmetry]:checked").value),
  fixed_height: by("fixed-height").checked && !state.isCalibrated,
});

/** Whether a version was taught from other marks or settings. The settings of earlier programs are unknown. */
export function isOld(model) {
  if (!model) return false;
  const { symmetry, fixed_height: isFixed } = partSettings();
  return model.is_stale || (model.symmetry !== null && (model.symmetry !== symmetry || model.fixed_height !== isFixed));
}
