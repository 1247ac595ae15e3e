// How a plane cuts a stroke, which is balls along a line.
import { along, minus } from "../geometry.js";
import { depthOf, toScreenOf } from "./pane.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("./pane.js").Pane} Pane */
/** @typedef {{at: Pair, r: number}} Disc pixels of the pane */

/** @param {Path2D} path @param {Disc} disc */
function addDisc(path, { at: [x, y], r }) {
  path.moveTo(x + r, y);
  path.arc(x, y, r, 0, 2 * Math.PI);
}

/** The piece between two discs. It runs round as they do: parts of a path that ran the other way would cancel out.
 * @param {Path2D} path @param {Disc} a @param {Disc} b */
function addLink(path, { at: [ax, ay], r: ra }, { at: [bx, by], r: rb }) {
  const long = Math.hypot(bx - ax, by - ay);
  if (long < 1e-3) return;
  const [nx, ny] = [-(by - ay) / long, (bx - ax) / long];
  path.moveTo(ax - ra * nx, ay - ra * ny);
  path.lineTo(bx - rb * nx, by - rb * ny);
  path.lineTo(bx + rb * nx, by + rb * ny);
  path.lineTo(ax + ra * nx, ay + ra * ny);
  path.closePath();
}

/** @param {Pane} pane @param {Triple} place @param {number} radius @returns {Disc|null} */
function discOf(pane, place, radius) {
  const square = radius * radius - depthOf(pane, place) ** 2;
  return square > 0 ? { at: toScreenOf(pane, place), r: Math.sqrt(square) * pane.frame.scale } : null;
}

/** Places along a straight, near enough that discs of a slanting one follow its cut.
 * @param {Pane} pane @param {Triple} a @param {Triple} b @param {number} radius @returns {Triple[]} without a */
function between(pane, a, b, radius) {
  const rise = Math.abs(depthOf(pane, b) - depthOf(pane, a));
  const steps = Math.max(1, Math.min(Math.ceil(rise / Math.max(radius / 8, 0.25)), 64));
  return Array.from({ length: steps }, (_, n) => along(a, minus(b, a), (n + 1) / steps));
}

/**
 * @param {Pane} pane @param {import("../state.js").Stroke} stroke
 * @returns {{path: Path2D, at: Pair}|null} its outline and where it begins; null when the plane does not cut it
 */
export function cutOf(pane, { points, radius }) {
  const path = new Path2D();
  /** @type {Pair|null} */
  let at = null;
  let last = points[0];
  let before = discOf(pane, last, radius);
  const take = (/** @type {Disc} */ disc) => {
    addDisc(path, disc);
    at ??= disc.at;
  };
  if (before) take(before);
  for (const point of points.slice(1)) {
    for (const place of between(pane, last, point, radius)) {
      const disc = discOf(pane, place, radius);
      if (disc) take(disc);
      if (disc && before) addLink(path, before, disc);
      before = disc;
    }
    last = point;
  }
  return at && { path, at };
}
