// What a slice view shows and how it lies on the screen.
import { clamp, frameOf, fromPlane, fromScreen, nearest, planeOf, sameGrid, toPlace, toPlane, toScreen } from "../geometry.js";
import { shownVolume, viewOf } from "../state.js";

/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Held} Held */
/** @typedef {{name: string, view: import("../geometry.js").View, held: Held, plane: import("../geometry.js").Plane,
 *   slice: number, camera: import("../state.js").Camera, box: Pair, frame: import("../geometry.js").Frame}} Pane */

/** The patient's box of voxels; a volume of the same voxels as the CT has the CT's.
 * @param {State} state @param {Held} held */
export function bodyOf(state, held) {
  const body = (/** @type {string} */ id) => state.server?.volumes.find((volume) => volume.id === id)?.body ?? null;
  return body(held.grid.id) ?? (state.voxels.ct && sameGrid(state.voxels.ct.grid, held.grid) ? body("ct") : null);
}

/** Of the view that the patient is given to the edges. */
const share = 0.96;

/** A camera on the patient: as the view's size changes, so does the zoom.
 * @param {Held} held @param {import("../geometry.js").View} view @param {[Triple, Triple]} body @param {Pair} box */
function bodyCamera(held, view, body, box) {
  const plane = planeOf(held.grid, view);
  const [first, last] = body.map((voxel) => toPlane(held.grid, view, toPlace(held.grid, voxel)));
  const wide = (Math.abs(last[0] - first[0]) + 1) * plane.across;
  const high = (Math.abs(last[1] - first[1]) + 1) * plane.along;
  const whole = frameOf(plane, { zoom: 1, middle: [0.5, 0.5] }, box).scale;
  return {
    zoom: clamp((Math.min(box[0] / wide, box[1] / high) * share) / whole, 0.5, 40),
    middle: /** @type {Pair} */ ([((first[0] + last[0]) / 2 + 0.5) / plane.width, ((first[1] + last[1]) / 2 + 0.5) / plane.height]),
  };
}

/** @param {State} state @param {string} name @returns {Pane|null} */
export function paneOf(state, name) {
  const [held, view, box, chosen] = [shownVolume(state), viewOf(state, name), state.boxes[name], state.cameras[name]];
  if (!held || !view || !box || !state.crosshair || box[0] < 1 || box[1] < 1) return null;
  const plane = planeOf(held.grid, view);
  const body = chosen.body ? bodyOf(state, held) : null;
  const camera = body ? bodyCamera(held, view, body, box) : { zoom: chosen.zoom, middle: chosen.middle };
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
