// The line of a stroke: made short before it is sent.
import { along, clamp, dot, length, minus } from "../geometry.js";

/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../state.js").Stroke} Stroke */

/** Points of one stroke: the server takes no more. */
const most = 400;

/** @param {Triple} p @param {Triple} a @param {Triple} b how far p is from the straight between a and b */
function away(p, a, b) {
  const way = minus(b, a);
  const square = dot(way, way);
  const t = square > 0 ? clamp(dot(minus(p, a), way) / square, 0, 1) : 0;
  return length(minus(p, along(a, way, t)));
}

/** Leaves out points that are less than `tolerance` from the rest (Douglas and Peucker).
 * @param {Triple[]} points @param {number} tolerance @returns {Triple[]} */
export function simplify(points, tolerance) {
  const kept = new Uint8Array(points.length);
  kept[0] = kept[points.length - 1] = 1;
  const open = [[0, points.length - 1]];
  for (let pair = open.pop(); pair; pair = open.pop()) {
    const [from, to] = pair;
    let [far, at] = [tolerance, -1];
    for (let n = from + 1; n < to; n++) {
      const d = away(points[n], points[from], points[to]);
      if (d > far) [far, at] = [d, n];
    }
    if (at < 0) continue;
    kept[at] = 1;
    open.push([from, at], [at, to]);
  }
  return points.filter((_, n) => kept[n]);
}

/** What a stroke may be off by, mm: nothing that a voxel would notice. @param {number} radius */
export const toleranceOf = (radius) => Math.min(0.25 * radius, 0.5);

const tenths = (/** @type {Triple} */ p) => /** @type {Triple} */ (p.map((x) => Math.round(x * 10) / 10));

/** A drawn stroke as it is sent; a very long one becomes several that touch. @param {Stroke} drawn @returns {Stroke[]} */
export function finished({ tissue, radius, points }) {
  const all = simplify(points, toleranceOf(radius)).map(tenths);
  /** @type {Stroke[]} */
  const strokes = [];
  for (let from = 0; from === 0 || from + 1 < all.length; from += most - 1) {
    strokes.push({ tissue, radius, points: all.slice(from, from + most) });
  }
  return strokes;
}
