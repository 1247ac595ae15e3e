// The patient's own structures and doses in the views: how each line is drawn, and the dose at a place.
import { fixed } from "../dom.js";
import { toVoxel } from "../geometry.js";
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

/** The dose at a place of the volume that is shown, in words: the live picture has none.
 * @param {State} state @param {import("../state.js").Held} shown @param {import("../geometry.js").Triple} place */
export function doseText({ voxels, preview }, { grid: { simulated } }, place) {
  const dose = simulated ? voxels["dose-deformed"] : preview ? null : voxels.dose;
  if (!dose) return null;
  const [i, j, k] = toVoxel(dose.grid, place).map(Math.round);
  const value = valueAt(dose, i, j, k);
  return value === null ? null : `${fixed(value / 100, 2)} Gy`;
}
