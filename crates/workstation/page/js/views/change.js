// How much of each voxel's volume is left, as colours over the CT.
import { fromPlane, minus, planeOf, toVoxel } from "../geometry.js";

/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../state.js").Held} Held */

/** Thousandths: where nothing is told, what is kept, from where a change is shown, and where its colour is full. */
const [nothing, kept, least, full] = [-32768, 1000, 20, 300];
const smaller = [40, 120, 255];
const larger = [255, 140, 26];

/** @param {Held} held @param {number} i @param {number} j @param {number} k @returns {number|null} as it is stored; null outside */
export function valueAt({ grid: { size }, voxels, arrived }, i, j, k) {
  if (i < 0 || j < 0 || k < 0 || i >= size[0] || j >= size[1] || k >= size[2]) return null;
  const n = i + size[0] * (j + size[1] * k);
  return n < arrived && voxels[n] !== nothing ? voxels[n] : null;
}

/** The change of volume at a place, in words. @param {import("../state.js").State} state @param {Triple} place */
export function changeText(state, place) {
  const held = state.step === "check" && state.compare.way === "volume" ? state.voxels.jacobian : null;
  if (!held) return null;
  const [i, j, k] = toVoxel(held.grid, place).map(Math.round);
  const value = valueAt(held, i, j, k);
  if (value === null) return null;
  const percent = Math.round((value - kept) / 10);
  return `volume ${percent < 0 ? "\u2212" : percent > 0 ? "+" : ""}${Math.abs(percent)} %`;
}

/** A grey with the colour of a change over it. @param {number} pixel @param {number} value thousandths */
export function coloured(pixel, value) {
  const off = value - kept;
  if (Math.abs(off) <= least) return pixel;
  const share = 0.2 + 0.6 * Math.min(1, Math.abs(off) / full);
  const colour = off < 0 ? smaller : larger;
  const grey = pixel & 0xff;
  const [r, g, b] = colour.map((x) => Math.round(grey + (x - grey) * share));
  return 0xff000000 | (b << 16) | (g << 8) | r;
}

/** @param {Uint32Array} pixels greys of the CT, changed @param {import("./pane.js").Pane} pane @param {Held} change on a grid of its own */
export function paintChange(pixels, { held, view, slice }, change) {
  const { width, height } = planeOf(held.grid, view);
  const spot = (/** @type {number} */ x, /** @type {number} */ y) => toVoxel(change.grid, fromPlane(held.grid, view, [x, y], slice));
  const first = spot(0, 0);
  const [right, down] = [minus(spot(1, 0), first), minus(spot(0, 1), first)];
  for (let y = 0, n = 0; y < height; y++) {
    for (let x = 0; x < width; x++, n++) {
      const value = valueAt(change, Math.round(first[0] + x * right[0] + y * down[0]), Math.round(first[1] + x * right[1] + y * down[1]),
        Math.round(first[2] + x * right[2] + y * down[2]));
      if (value !== null) pixels[n] = coloured(pixels[n], value);
    }
  }
}
