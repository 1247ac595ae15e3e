// The patient's own structures and doses in the views: how each line is drawn, and the dose at a place.
import { fixed } from "../dom.js";
import { clamp, toVoxel } from "../geometry.js";
import { valueAt } from "./change.js";
import { colours } from "./pen.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Own} Own */
/** @typedef {{name: string, text: string, colour: string, dashes: number[]}} Entry of the legend; `name`: of the server's line */

/** In turn, for those whose file names no colour. */
const structureColours = ["#8cff9a", "#ff9ae0", "#9ad8ff", "#ffd36b", "#d0b3ff", "#ff9d8a"];
/** From the highest dose on. */
const doseColours = ["#ff6b6b", "#ffab5e", "#ffe066", "#86e07a", "#5fa8ff", "#b39dff"];
/** The skin has even dashes. */
const doseDashes = [9, 3, 2, 3];

/** The least relative luminance of a line on black, by which it differs from its dark rim (WCAG 2, contrast 4.5). */
const LIGHT = 0.175;

/** The planner's colour; one too dark to be seen on a CT with as much white as it takes.
 * @param {string} colour `#rrggbb` */
export function readable(colour) {
  const rgb = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255);
  const mixed = (/** @type {number} */ white) => rgb.map((x) => x + (1 - x) * white);
  const linear = (/** @type {number} */ x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
  const light = (/** @type {number[]} */ [r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  let white = 0;
  while (light(mixed(white)) < LIGHT && white < 1) white += 0.05;
  return `#${mixed(white).map((x) => Math.round(255 * x).toString(16).padStart(2, "0")).join("")}`;
}

/** Each line by its place in what the server tells: turning over slices changes no colour.
 * @param {Own|null} own @returns {{structures: Entry[], isodoses: Entry[]}} */
export function legendOf(own) {
  const levels = [...new Set((own?.doses ?? []).flatMap(({ levels_gy: gy }) => gy))];
  return {
    structures: (own?.structures ?? []).map(({ name, colour }, n) => ({
      name: `structure: ${name}`, text: name, dashes: [],
      colour: colour === null ? structureColours[n % structureColours.length] : readable(colour),
    })),
    isodoses: levels.map((gy, n) => ({
      name: `isodose: ${gy} Gy`, text: `${Number(gy.toFixed(2))} Gy`, colour: doseColours[n % doseColours.length], dashes: doseDashes,
    })),
  };
}

/** @param {Own} own @param {string} region */
export const regionColour = (own, region) => legendOf(own).structures.find(({ text }) => text === region)?.colour ?? colours.text;

/** The value between the voxels' centres, linear along each axis; null outside the voxels.
 * @param {import("../state.js").Held} held @param {import("../geometry.js").Triple} place */
function between(held, place) {
  const at = toVoxel(held.grid, place);
  const { size } = held.grid;
  if (at.some((x, a) => x < -0.5 || x > size[a] - 0.5)) return null;
  const inside = at.map((x, a) => clamp(x, 0, size[a] - 1));
  const first = inside.map((x, a) => Math.min(Math.floor(x), Math.max(size[a] - 2, 0)));
  let sum = 0;
  for (let corner = 0; corner < 8; corner += 1) {
    const far = [0, 1, 2].map((a) => (corner >> a) & 1);
    const share = far.reduce((all, is, a) => all * (is ? inside[a] - first[a] : 1 - (inside[a] - first[a])), 1);
    if (share === 0) continue;
    const [i, j, k] = first.map((n, a) => n + far[a]);
    const value = valueAt(held, i, j, k);
    if (value === null) return null;
    sum += share * value;
  }
  return sum;
}

/** The dose at a place of the volume that is shown, in words: the live picture has none.
 * @param {State} state @param {import("../state.js").Held} shown @param {import("../geometry.js").Triple} place */
export function doseText({ voxels, preview }, { grid: { simulated } }, place) {
  const dose = simulated ? voxels["dose-deformed"] : preview ? null : voxels.dose;
  if (!dose) return null;
  const value = between(dose, place);
  return value === null ? null : `${fixed(value / 100, 2)} Gy`;
}
