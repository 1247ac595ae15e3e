// What a slice view shows and how it lies on the screen.
import { frameOf, fromPlane, fromScreen, nearest, planeOf, toPlane, toScreen } from "../geometry.js";
import { shownVolume, viewOf } from "../state.js";

/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Held} Held */
/** @typedef {{name: string, view: import("../geometry.js").View, held: Held, plane: import("../geometry.js").Plane,
 *   slice: number, camera: import("../state.js").Camera, box: Pair, frame: import("../geometry.js").Frame}} Pane */

/** @param {State} state @param {string} name @returns {Pane|null} */
export function paneOf(state, name) {
  const [held, view, box, camera] = [shownVolume(state), viewOf(state, name), state.boxes[name], state.cameras[name]];
  if (!held || !view || !box || !state.crosshair || box[0] < 1 || box[1] < 1) return null;
  const plane = planeOf(held.grid, view);
  const slice = nearest(held.grid, state.crosshair)[view.normal];
  return { name, view, held, plane, slice, camera, box, frame: frameOf(plane, camera, box) };
}

/** @param {Pane} pane @param {Triple} place @returns {Pair} */
export const toScreenOf = (pane, place) => toScreen(pane.plane, pane.frame, toPlane(pane.held.grid, pane.view, place));

/** @param {Pane} pane @param {Pair} at @returns {Triple} */
export const fromScreenOf = (pane, at) => fromPlane(pane.held.grid, pane.view, fromScreen(pane.plane, pane.frame, at), pane.slice);

/** How far a place lies before or behind the plane, mm. @param {Pane} pane @param {Triple} place */
export function depthOf(pane, place) {
  const { grid } = pane.held;
  const { normal } = pane.view;
  const axis = grid.axes[normal];
  const d = place.reduce((sum, x, a) => sum + (x - grid.origin_mm[a]) * axis[a], 0);
  return d - pane.slice * grid.spacing_mm[normal];
}
