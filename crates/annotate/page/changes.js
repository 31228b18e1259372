// Differences between the grasps that two models accept in the same picture.

import { gripperOf, norm, sub, times } from "./geometry.js";
import { listText, pictures } from "./words.js";

/** A hand turned by more than this is another grasp. */
const MAX_TURN = (20 * Math.PI) / 180;
/** A hand moved by more than this share of the part's length is another grasp. */
const MAX_MOVE = 0.1;
const MAX_NAMES = 30;
const WORDS = { less: "less is found", turned: "the hand is turned", moved: "the hand is elsewhere", more: "more is found", alarm: "more is wrongly found", calm: "less is wrongly found" };

/**
 * The change from the marks `before` to the marks `after`: "more" or "less" are found, or a hand is "turned" or
 * "moved"; in a picture without the part (`isAbsent`) "alarm" or "calm"; null without a change. `turns`: number of
 * turns in which the part looks the same, 0 for any.
 */
export function changeOf(before, after, turns, isAbsent) {
  const more = after.length - before.length;
  if (isAbsent) return more ? (more > 0 ? "alarm" : "calm") : null;
  if (more) return more > 0 ? "more" : "less";
  // A part that looks the same when turned may be held at the opposite place: then the middle of its box is compared.
  const place = ({ box: [x1, y1, x2, y2], grasp }) => (turns === 1 ? gripperOf(grasp).center : times([x1 + x2, y1 + y2], 0.5));
  const left = [...after];
  let change = null;
  for (const marks of before) {
    const distance = (other) => norm(sub(place(other), place(marks)));
    const nearest = left.reduce((a, b) => (distance(b) < distance(a) ? b : a));
    left.splice(left.indexOf(nearest), 1);
    const angle = gripperOf(nearest.grasp).angle - gripperOf(marks.grasp).angle;
    const same = (2 * Math.PI) / turns;
    const [x1, y1, x2, y2] = marks.box;
    if (turns && Math.abs(angle - same * Math.round(angle / same)) > MAX_TURN) return "turned";
    if (distance(nearest) > MAX_MOVE * Math.max(x2 - x1, y2 - y1)) change = "moved";
  }
  return change;
}

/** The changes of several pictures, `{ name, change }`, in words. */
export function changesText(changes) {
  const sentences = Object.entries(WORDS).map(([kind, words]) => {
    const names = changes.filter(({ change }) => change === kind).map(({ name }) => name);
    return names.length ? `In ${pictures(names.length)} ${words}: ${listText(names, MAX_NAMES)}.` : "";
  });
  return sentences.filter(Boolean).join(" ") || "No picture has changed.";
}
