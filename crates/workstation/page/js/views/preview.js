// The live picture in a slice: a piece of the CT's plane with other values.
import { isTracked } from "../applicator.js";
import { fixed } from "../dom.js";
import { planeOf } from "../geometry.js";

/** @typedef {import("./pane.js").Pane} Pane */
/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Patched} Patched */

/** The piece that belongs into what a view shows. @param {State} state @param {Pane} pane @returns {Patched|null} */
export function patchedFor(state, pane) {
  const piece = state.preview?.planes[pane.name];
  return piece && pane.held.grid.id === "ct" && piece.slice === pane.slice ? piece : null;
}

/** Puts the piece over the plane, by the same tables. Its rows lie as the grid does, the plane as the view does.
 * @param {Uint32Array} pixels @param {Pane} pane @param {Patched} piece @param {Uint8ClampedArray} greys @param {Uint32Array} colours */
export function paintPatch(pixels, { held: { grid }, view }, { x0, y0, width, height, hu }, greys, colours) {
  const plane = planeOf(grid, view);
  const step = view.right.flip ? -1 : 1;
  for (let y = 0, n = 0; y < height; y++) {
    const row = view.down.flip ? plane.height - 1 - y0 - y : y0 + y;
    let at = row * plane.width + (view.right.flip ? plane.width - 1 - x0 : x0);
    for (let x = 0; x < width; x++, n++, at += step) pixels[at] = colours[greys[hu[n] & 0xffff]];
  }
}

/** The word for what a view shows while there is a live picture; its angles are the picture's own.
 * @param {State} state @param {Pane} pane @returns {{word: string, note?: string, framed: boolean}|null} */
export function previewWord(state, pane) {
  const { preview } = state;
  if (!preview || pane.held.grid.id !== "ct") return null;
  if (!patchedFor(state, pane)) return { word: "CT \u00b7 preview follows", framed: false };
  const angles = `AP ${fixed(preview.ap)}\u00b0  LAT ${fixed(preview.lat)}\u00b0`;
  if (isTracked(state) && preview.load?.tumour) return { word: "NAVIGATION", note: angles, framed: true };
  return { word: "PREVIEW", note: `${angles}${preview.load ? " \u00b7 applicator" : ""}`, framed: true };
}

/** The value of the live picture at a voxel of the CT; undefined where no plane of it is, null where it is as in the CT.
 * @param {State} state @param {import("../geometry.js").Triple} voxel @returns {number|null|undefined} */
export function previewAt({ preview, server }, voxel) {
  if (!preview) return undefined;
  /** @type {null|undefined} */
  let found;
  for (const view of server?.views ?? []) {
    const piece = preview.planes[view.name];
    if (!piece || piece.slice !== voxel[view.normal]) continue;
    const [x, y] = [voxel[view.right.axis] - piece.x0, voxel[view.down.axis] - piece.y0];
    if (x >= 0 && y >= 0 && x < piece.width && y < piece.height) return piece.hu[x + piece.width * y];
    found = null;
  }
  return found;
}
