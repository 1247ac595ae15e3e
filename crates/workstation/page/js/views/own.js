// The patient's own structures and doses in the views: how each line is drawn, and the dose at a place.
import { fixed } from "../dom.js";
import { clamp, toVoxel } from "../geometry.js";
import { valueAt } from "./change.js";
import { colours } from "./pen.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Own} Own */
/** @typedef {{name: string, text: string, colour: string, dashes: number[]}} Entry of the legend; `name`: of the server's line */

/** In turn. */
const structureColours = ["#8cff9a", "#ff9ae0", "#9ad8ff", "#ffd36b", "#d0b3ff", "#ff9d8a"];
/** From the highest dose on. */
const doseColours = ["#ff6b6b", "#ffab5e", "#ffe066", "#86e07a", "#5fa8ff", "#b39dff"];
/** The skin has even dashes. */
const doseDashes = [9, 3, 2, 3];

/** Each line by its place in what the server tells: turning over slices changes no colour.
 * @param {Own|null} own @returns {{structures: Entry[], isodoses: Entry[]}} */
export function legendOf(own) {
  const levels = [...new Set((own?.doses ?? []).flatMap(({ levels_gy: gy }) => gy))];
  return {
    structures: (own?.structures ?? []).map(({ name }, n) => ({
      name: `structure: ${name}`, text: name, colour: structureColours[n % structureColours.length], dashes: [],
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
