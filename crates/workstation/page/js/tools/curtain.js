// The edge between two compared volumes, by mouse.
import { clamp } from "../geometry.js";
import { change, now } from "../state.js";
import { comparedWith } from "../views/compare.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../views/pane.js").Pane} Pane */

const reach = 7;

/** @param {Pane} pane @param {Pair} at @returns {import("../views/pointer.js").Drag|null} nothing when the edge is not near */
export function beginCurtain(pane, at) {
  if (now().compare.way !== "curtain" || !comparedWith(now(), pane)) return null;
  const wide = pane.box[0];
  if (Math.abs(at[0] - now().compare.share * wide) > reach) return null;
  return { move: ([x]) => change({ compare: { ...now().compare, share: clamp(x / wide, 0, 1) } }) };
}
