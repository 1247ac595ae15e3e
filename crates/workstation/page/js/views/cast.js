// Who plays in the 3D view: which of the server's surfaces are drawn, and how each kind looks.
import { axisOf, centreOf, isShown, tumourNow } from "../applicator.js";
import { onTable } from "../live.js";
import { shownVolume, tumourOf } from "../state.js";
import { applicatorBody, ball } from "./bodies.js";
import { pixelOf, veilOf } from "./blend.js";
import { followedTumour } from "./followed.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Surface} Surface */
/** @typedef {import("../geometry.js").Triple} Triple */

/** Kinds of parts by their number in the id buffer, with their colour. @type {[string, Triple][]} */
const kinds = [["", [0, 0, 0]], ["skin", [236, 204, 190]], ["chest wall", [196, 84, 30]], ["cut", [150, 150, 255]], ["tumour", [255, 221, 51]],
  ["mesh", [190, 200, 215]], ["frames", [70, 84, 104]], ["crosshair", [255, 255, 255]], ["body", [150, 170, 195]],
  ["applicator", [168, 172, 180]], ["displacement", [0, 0, 0]], ["scan", [0, 0, 0]], ["scan elsewhere", [96, 98, 102]],
  ["other", [150, 185, 170]], ["tumour, predicted", [255, 150, 20]], ["tumour, late", [255, 90, 31]],
  ["tumour, stale", [165, 165, 165]]];
/** @param {string} kind */
export const number = (kind) => kinds.findIndex(([name]) => name === kind);

/** The name of a part, whichever shape it has. @param {string} part */
export const baseOf = (part) => part.replace(/, (simulated|preview|predicted|late|stale)$/, "");

/** @param {string} part @param {Surface} surface */
export function kindOf(part, { kind }) {
  const base = baseOf(part);
  if (kind === "points") return "scan";
  if (kind === "arrows") return "displacement";
  if (base === "wall") return "chest wall";
  return [part, base].find((name) => number(name) > 0) ?? "other";
}

/** Colours along a scale, which also differ in brightness where they can. @type {Record<string, Triple[]>} */
const ramps = {
  displacement: [[70, 90, 200], [40, 160, 190], [120, 205, 90], [250, 225, 70]],
  scan: [[70, 150, 255], [235, 235, 235], [255, 140, 26]],
};

/** @param {string} kind @param {number} share 0 to 1 @returns {Triple} */
export function rampColour(kind, share) {
  const ramp = ramps[kind];
  const at = share * (ramp.length - 1);
  const n = Math.min(ramp.length - 2, Math.floor(at));
  return /** @type {Triple} */ (ramp[n].map((x, a) => Math.round(x + (at - n) * (ramp[n + 1][a] - x))));
}

/** @type {WeakMap<Surface, number>} */
const reaches = new WeakMap();

/** What nearly all values of a surface stay below: a few stray points must not take the colours from the rest. @param {Surface} surface */
function reachOf(surface) {
  const before = reaches.get(surface);
  if (before !== undefined) return before;
  const sizes = surface.values.filter((mm) => !Number.isNaN(mm)).map(Math.abs).sort();
  const reach = sizes[Math.floor(0.98 * (sizes.length - 1))] ?? 0;
  reaches.set(surface, reach);
  return reach;
}

/** The end of a scale: a round number of mm. @param {Surface[]} surfaces */
export function scaleEnd(surfaces) {
  const most = Math.max(0, ...surfaces.map(reachOf));
  return [1, 2, 3, 5, 8, 10, 15, 20, 30, 40, 50, 80, 100, 150, 200].find((mm) => mm >= most) ?? Math.ceil(most);
}

/** @type {Triple} */
const ground = [16, 18, 24];

/** Pixels by kind and light: shaded, or along a scale. */
function shades() {
  const table = new Uint32Array(256 * kinds.length);
  kinds.forEach(([kind, colour], n) => {
    for (let light = 0; light < 256; light++) {
      // The brightest gleam a little: it shows which way a surface bends.
      const gleam = Math.max(0, light - 225) * 1.4;
      const shaded = () => colour.map((x) => Math.min(255, Math.round((x * light) / 235 + gleam)));
      table[(n << 8) | light] = pixelOf(ramps[kind] ? rampColour(kind, light / 255) : shaded());
    }
  });
  return table;
}

/** @type {import("./blend.js").Looks} */
const looks = {
  shades: shades(), ground: pixelOf(ground), tumour: pixelOf([255, 221, 51]), cut: pixelOf([150, 150, 255]),
  skin: veilOf([255, 232, 220], 0.4, 0.97, 1.2),
  body: veilOf([176, 194, 216], 0.08, 0.6, 2),
};

/** The body where there is no mesh yet: it is all there is to see. */
const aloneBody = veilOf([206, 220, 238], 0.42, 0.98, 1.1);

/** The outline of the tumour tells how good its place is, too. @param {State} state @param {boolean} mesh skin or chest wall is drawn
 * @returns {import("./blend.js").Looks} */
export function looksOf(state, mesh) {
  const followed = followedTumour(state)?.state ?? "ok";
  const tumour = followed === "ok" ? looks.tumour : pixelOf(kinds[number(`tumour, ${followed}`)][1]);
  return { ...looks, tumour, body: mesh ? looks.body : aloneBody };
}

/** The shape that is drawn: that of the volume shown, when the server has it, and with an applicator that on the table. @param {State} state @returns {"ct"|"deformed"} */
export function shapeOf(state) {
  const has = Object.values(state.surfaces).some(({ shape }) => shape === "deformed");
  return has && (shownVolume(state)?.grid.simulated || (isShown(state) && onTable(state))) ? "deformed" : "ct";
}

/** The applicator, and the tumour where it has been pushed to. @param {State} state @param {[string, Surface][]} all @returns {[string, Surface][]} */
function withApplicator(state, all) {
  const one = state.applicator;
  if (!one) return all;
  const followed = followedTumour(state);
  const tumour = followed ?? tumourNow(state);
  const rest = tumour ? all.filter(([part]) => baseOf(part) !== "tumour") : all;
  if (tumour) rest.push([followed && followed.state !== "ok" ? `tumour, ${followed.state}` : "tumour", ball(tumour)]);
  return [...rest, ["applicator, preview", applicatorBody(centreOf(one), axisOf(one), one.radius, one.shaft)]];
}

/** @param {State} state @returns {[string, Surface][]} parts of the shape shown, also those that are switched off */
export function partsOf(state) {
  const shape = shapeOf(state);
  // In the CT the tumour is drawn from the case: while it is dragged its surface is an old one.
  const all = Object.entries(state.surfaces).filter(([part, one]) => (one.shape === shape || one.shape === "both")
    && !(shape === "ct" && baseOf(part) === "tumour"));
  const tumour = shape === "ct" ? tumourOf(state) : null;
  if (tumour) all.push(["tumour", ball(tumour)]);
  return isShown(state) ? withApplicator(state, all) : all;
}

/** @param {State} state */
export const drawnParts = (state) => partsOf(state).filter(([part]) => !state.hiddenParts.includes(baseOf(part)));
