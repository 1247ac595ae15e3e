// Painting and setting points in a slice view of the CT.
import { length, minus } from "../geometry.js";
import { change, now } from "../state.js";
import { depthOf, fromScreenOf, paneOf, toScreenOf } from "../views/pane.js";
import { addPoint, addStrokes, pointsOf, removePoint } from "./seeds.js";
import { finished, simplify, toleranceOf } from "./stroke.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../views/pane.js").Pane} Pane */
/** @typedef {import("../views/pointer.js").Drag} Drag */
/** @typedef {import("../state.js").Stroke} Stroke */

/** Only what was scanned is painted on. @param {Pane} pane */
export const paintable = (pane) => !pane.held.grid.simulated;

/** The stroke with one more point; one that hardly moved is left out, and a long line is made short on the way.
 * @param {Stroke} stroke @param {Triple} place @returns {Stroke} */
function longer(stroke, place) {
  const { points, radius } = stroke;
  if (length(minus(place, points[points.length - 1])) < 0.1) return stroke;
  const all = [...points, place];
  return { ...stroke, points: all.length % 200 === 0 ? simplify(all, toleranceOf(radius) / 4) : all };
}

/** All places the pointer has been to since the last event: a fast hand leaves no corners out.
 * @param {Pair} at @param {PointerEvent} event @returns {Pair[]} */
function samples(at, event) {
  const all = event.getCoalescedEvents?.() ?? [];
  if (all.length === 0) return [at];
  return all.map(({ clientX, clientY }) => [at[0] + clientX - event.clientX, at[1] + clientY - event.clientY]);
}

/** @param {Pane} pane @param {Pair} at @param {PointerEvent} event @returns {Drag|null} */
export function beginStroke(pane, at, event) {
  if (!paintable(pane)) return null;
  const { tissue, radius } = now().brush;
  change({ stroke: { tissue: event.ctrlKey ? "erase" : tissue, radius, points: [fromScreenOf(pane, at)] } });
  const end = () => {
    const { stroke } = now();
    if (!stroke) return;
    change({ stroke: null });
    addStrokes(finished(stroke));
  };
  return {
    move(to, moved) {
      const { stroke } = now();
      // The wheel may have brought another slice: the line goes on in that one.
      const present = paneOf(now(), pane.name);
      if (!stroke || !present || !paintable(present)) return;
      change({ stroke: samples(to, moved).reduce((line, one) => longer(line, fromScreenOf(present, one)), stroke) });
    },
    end, cancel: end,
  };
}

const reach = 9;

/** Sets a point of the chosen tissue, or takes away the one that is near when erasing.
 * @param {Pane} pane @param {Pair} at @param {PointerEvent} event @returns {null} */
export function clickPoint(pane, at, event) {
  if (!paintable(pane)) return null;
  const { tissue } = now().brush;
  if (tissue !== "erase" && !event.ctrlKey) {
    addPoint(tissue, fromScreenOf(pane, at));
    return null;
  }
  const thick = pane.held.grid.spacing_mm[pane.view.normal];
  const near = pointsOf(now()).find(({ place }) => {
    const [x, y] = toScreenOf(pane, place);
    return Math.abs(depthOf(pane, place)) <= thick && Math.hypot(at[0] - x, at[1] - y) <= reach;
  });
  if (near) removePoint(near);
  return null;
}

/** What a click would do, at the crosshair, without a pointer. @param {"brush"|"point"} tool */
export function paintAtCrosshair(tool) {
  const { crosshair, brush: { tissue, radius } } = now();
  if (!crosshair) return;
  if (tool === "brush") addStrokes(finished({ tissue, radius, points: [crosshair] }));
  else if (tissue !== "erase") addPoint(tissue, crosshair);
}
