// From stored voxels to the pixels of a plane.
import { walk } from "../geometry.js";

/** @typedef {import("../state.js").Held} Held */
/** @typedef {[number, number, number]} Rgb */

/** Colours of labels by their names; others take the rest in turn. @type {Record<string, Rgb>} */
const known = { "soft tissue": [64, 212, 255], "chest wall": [225, 94, 10] };
/** @type {Rgb[]} */
const others = [[110, 110, 255], [255, 221, 51], [140, 220, 120], [220, 120, 220]];

/** @param {Record<string, string>} names @param {number} label @returns {Rgb} */
export const labelColour = (names, label) => known[names[label]] ?? others[label % others.length];

/** The grey of every stored value. A table: a new window costs 65,536 steps, not one for each voxel.
 * @param {{width: number, level: number}} window @returns {Uint8ClampedArray} */
export function windowTable({ width, level }) {
  const greys = new Uint8ClampedArray(65_536);
  for (let n = 0; n < 65_536; n++) {
    const hu = n < 32_768 ? n : n - 65_536;
    greys[n] = ((hu - level) / width + 0.5) * 255;
  }
  return greys;
}

/** The pixel of every label and grey. @param {Record<string, string>} names @param {number} share of the label's colour */
export function colourTable(names, share) {
  const colours = new Uint32Array(65_536);
  for (let label = 0; label < 256; label++) {
    const tint = names[label] ? labelColour(names, label) : null;
    for (let grey = 0; grey < 256; grey++) {
      const mix = (/** @type {number} */ a) => Math.round(tint ? grey + (tint[a] - grey) * share * (0.35 + 0.65 * grey / 255) : grey);
      colours[(label << 8) | grey] = 0xff000000 | (mix(2) << 16) | (mix(1) << 8) | mix(0);
    }
  }
  return colours;
}

/**
 * @param {Uint32Array} pixels @param {Held} held @param {Held|null} labels on the same grid
 * @param {import("../geometry.js").View} view @param {number} slice
 * @param {Uint8ClampedArray} greys @param {Uint32Array} colours
 */
export function paint(pixels, held, labels, view, slice, greys, colours) {
  const { start, right, down } = walk(held.grid, view, slice);
  const { voxels } = held;
  const width = held.grid.size[view.right.axis];
  let from = start;
  for (let n = 0; n < pixels.length; from += down) {
    const end = n + width;
    let at = from;
    if (labels) {
      for (; n < end; n++, at += right) pixels[n] = colours[(labels.voxels[at] << 8) | greys[voxels[at] & 0xffff]];
    } else {
      for (; n < end; n++, at += right) pixels[n] = colours[greys[voxels[at] & 0xffff]];
    }
  }
}

/** Only one colour table is wanted at a time, of one window and one set of names. */
export function makeTables() {
  let greyKey = "";
  let colourKey = "";
  /** @type {Uint8ClampedArray} */ let greys;
  /** @type {Uint32Array} */ let colours;
  return (/** @type {{width: number, level: number}} */ window, /** @type {Record<string, string>} */ names) => {
    const key = `${window.width} ${window.level}`;
    if (key !== greyKey) [greys, greyKey] = [windowTable(window), key];
    const text = JSON.stringify(names);
    if (text !== colourKey) [colours, colourKey] = [colourTable(names, 0.2), text];
    return { greys, colours };
  };
}
