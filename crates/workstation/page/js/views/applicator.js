// The applicator in a slice: what the plane cuts of its sphere and shaft, its handles, and the tumour where it lies now.
import { across, axisOf, centreOf, cross, grip, isSeen, isTracked, loadOf, reach, tumourNow } from "../applicator.js";
import { along, clamp } from "../geometry.js";
import { drawFollowed, followedTumour } from "./followed.js";
import { depthOf, toScreenOf } from "./pane.js";
import { colours, stroke, swell, write } from "./pen.js";
import { patchedFor } from "./preview.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../state.js").State} State */
/** @typedef {import("./pane.js").Pane} Pane */
/** @typedef {CanvasRenderingContext2D} Pen */
/** @typedef {{at: Pair, mm: number}} Grip the square on the shaft: pixels of the pane, and how far from the centre */
/** @typedef {{centre: Triple, axis: Triple, at: Pair, grip: Grip|null, r: number}} Held `at`: pixels of the pane of its centre; `r`: of
 *   the circle that the plane cuts, 0 where it cuts none */

const metal = "#c3c9d1";
const sides = 64;

const inset = 14;
/** The square on the shaft is brought into the view. A shaft that points at the eye has none: it would lie on that of the centre.
 * @param {Pane} pane @param {Triple} centre @param {Triple} axis @returns {Grip|null} */
function gripOf(pane, centre, axis) {
  const from = toScreenOf(pane, centre);
  const to = toScreenOf(pane, along(centre, axis, grip));
  const room = [0, 1].map((i) => ((to[i] > from[i] ? pane.box[i] - inset : inset) - from[i]) / (to[i] - from[i] || 1e-9));
  const share = clamp(Math.min(...room), 0.35, 1);
  const at = /** @type {Pair} */ ([0, 1].map((i) => from[i] + share * (to[i] - from[i])));
  return Math.hypot(at[0] - from[0], at[1] - from[1]) < 18 ? null : { at, mm: share * grip };
}

/** The applicator as a view has it: over the CT, in which the preview is drawn; that of a tracker also over the breast on the table.
 * @param {State} state @param {Pane} pane @returns {Held|null} */
export function heldIn(state, pane) {
  const one = state.applicator;
  const { id, simulated } = pane.held.grid;
  if (!one || !isSeen(state) || !(id === "ct" || (simulated && isTracked(state)))) return null;
  const [centre, axis] = [centreOf(one), axisOf(one)];
  const square = one.radius ** 2 - depthOf(pane, centre) ** 2;
  return { centre, axis, at: toScreenOf(pane, centre), grip: gripOf(pane, centre, axis),
    r: square > 0 ? Math.sqrt(square) * pane.frame.scale : 0 };
}

/** The shaft as a prism of many sides: two rings of points, the first within the sphere, one after the other.
 * @param {Triple} centre @param {Triple} axis @param {number} radius @param {number} from mm from the centre @returns {[Triple[], Triple[]]} */
export function shaftRings(centre, axis, radius, from) {
  const u = across(axis);
  const w = cross(axis, u);
  const ring = (/** @type {number} */ t) => Array.from({ length: sides }, (_, n) => {
    const angle = (2 * Math.PI * n) / sides;
    return along(along(along(centre, axis, t), u, radius * Math.cos(angle)), w, radius * Math.sin(angle));
  });
  return [ring(from), ring(reach)];
}

/** What a plane cuts of the shaft: the places where it cuts the edges of the prism, which is convex, in their order around.
 * @param {Pane} pane @param {[Triple[], Triple[]]} rings @returns {Pair[]} pixels of the pane */
function shaftCut(pane, [low, high]) {
  const next = (/** @type {number} */ n) => (n + 1) % sides;
  const edges = low.flatMap((_, n) => [[low[n], high[n]], [low[n], low[next(n)]], [high[n], high[next(n)]]]);
  /** @type {Pair[]} */
  const spots = [];
  for (const [a, b] of edges) {
    const [from, to] = [depthOf(pane, a), depthOf(pane, b)];
    if (from * to > 0 || from === to) continue;
    const [[ax, ay], [bx, by]] = [toScreenOf(pane, a), toScreenOf(pane, b)];
    const t = from / (from - to);
    spots.push([ax + t * (bx - ax), ay + t * (by - ay)]);
  }
  const middle = [0, 1].map((i) => spots.reduce((sum, spot) => sum + spot[i], 0) / (spots.length || 1));
  const angle = (/** @type {Pair} */ [x, y]) => Math.atan2(y - middle[1], x - middle[0]);
  return spots.sort((a, b) => angle(a) - angle(b));
}

/** @param {Pen} pen @param {Path2D} path @param {boolean} inside the picture has it: else a dashed outline of where it would be */
function drawMetal(pen, path, inside) {
  if (!inside) return stroke(pen, metal, 1.6 * swell(), [6 * swell(), 4 * swell()], path);
  pen.fillStyle = "rgba(112, 118, 127, 0.8)";
  pen.fill(path);
  for (const [style, wide] of /** @type {[string, number][]} */ ([["#ffffff", 3.4], ["#6d747d", 1.4]])) {
    pen.strokeStyle = style;
    pen.lineWidth = wide * swell();
    pen.stroke(path);
  }
}

/** @param {Pen} pen @param {Pane} pane @param {Held} held @param {import("../state.js").Applicator} one
 * @param {boolean} inside */
function drawBody(pen, pane, { centre, axis, at: [x, y], r }, one, inside) {
  const from = Math.sqrt(Math.max(0, one.radius ** 2 - one.shaft ** 2));
  const spots = shaftCut(pane, shaftRings(centre, axis, one.shaft, from));
  if (spots.length > 2) {
    const path = new Path2D();
    spots.forEach(([px, py], n) => (n ? path.lineTo(px, py) : path.moveTo(px, py)));
    path.closePath();
    drawMetal(pen, path, inside);
  }
  if (r === 0) return;
  const ball = new Path2D();
  ball.arc(x, y, r, 0, 2 * Math.PI);
  drawMetal(pen, ball, inside);
}

/** Squares: at the centre where the plane cuts the sphere, and on the shaft, which is seen from afar too. @param {Pen} pen @param {Pane} pane @param {Held} held */
function drawHandles(pen, pane, { centre, axis, at, grip: handle, r }) {
  const half = 4 * swell();
  const square = (/** @type {Pair} */ [a, b]) => stroke(pen, "#ffffff", 1.6 * swell(), [], () => pen.rect(a - half, b - half, 2 * half, 2 * half));
  if (r > 0) square(at);
  if (!handle) return;
  // The shaft seen from the side: where it is not cut, it lies before or behind the plane.
  const away = Math.abs(depthOf(pane, along(centre, axis, handle.mm)));
  pen.globalAlpha = away > 10 ? 0.7 : 1;
  stroke(pen, "#ffffff", swell(), [2 * swell(), 4 * swell()], () => {
    pen.moveTo(...at);
    pen.lineTo(...handle.at);
  });
  square(handle.at);
  pen.globalAlpha = 1;
}

/** @param {Pen} pen @param {State} state @param {Pane} pane */
function drawTumour(pen, state, pane) {
  const tumour = tumourNow(state);
  const square = tumour ? tumour.radius_mm ** 2 - depthOf(pane, tumour.centre_mm) ** 2 : -1;
  if (!tumour || square <= 0) return;
  const [x, y] = toScreenOf(pane, tumour.centre_mm);
  const r = Math.sqrt(square) * pane.frame.scale;
  stroke(pen, colours.tumour, 1.8 * swell(), [], () => pen.arc(x, y, r, 0, 2 * Math.PI));
  write(pen, "T", x - r * 0.72 - 4, y - r * 0.72, "right", colours.tumour);
}

/** @param {Pen} pen @param {State} state @param {Pane} pane */
export function drawApplicator(pen, state, pane) {
  const held = heldIn(state, pane);
  if (!held || !state.applicator) return;
  const followed = followedTumour(state);
  const inside = loadOf(state) !== null && patchedFor(state, pane) !== null && followed?.state !== "stale" && !(followed && loadOf(state)?.tumour === null);
  drawBody(pen, pane, held, state.applicator, inside);
  if (followed) return drawFollowed(pen, pane, followed);
  drawTumour(pen, state, pane);
  drawHandles(pen, pane, held);
}
