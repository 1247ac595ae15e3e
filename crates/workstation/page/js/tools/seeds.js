// What the user has said of the tissue, as the case holds it, and how it gets there.
import { edit, editNewest } from "../link.js";
import { change, now } from "../state.js";

/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Stroke} Stroke */
/** @typedef {import("../state.js").Tissue} Tissue */
/** @typedef {import("../state.js").Waiting} Waiting */
/** @typedef {{tissue: Tissue, place: Triple}} Point */

/** Tissues with their words and letters: colour is not the only sign. @type {{id: Tissue, name: string, letter: string}[]} */
export const tissues = [
  { id: "chest_wall", name: "Chest wall", letter: "W" }, { id: "soft_tissue", name: "Soft tissue", letter: "S" },
  { id: "exclude", name: "Not the patient", letter: "X" }, { id: "erase", name: "Erase", letter: "E" },
];
const told = tissues.filter(({ id }) => id !== "erase");
export const radii = { least: 1, most: 30 };
const strokesKey = "seeds.strokes";

/** @param {Record<string, any>} values @returns {Stroke[]} */
const strokesIn = (values) => values[strokesKey] ?? [];
/** @param {State} state */
export const strokesOf = (state) => strokesIn(state.server?.case?.values ?? {});
/** @param {State} state @returns {Point[]} */
export const pointsOf = (state) => told.flatMap(({ id }) =>
  (state.server?.case?.values[`seeds.${id}`] ?? []).map((/** @type {Triple} */ place) => ({ tissue: id, place })));

/** An empty list is no list. @param {any[]} list */
const orNull = (list) => (list.length > 0 ? list : null);

let count = 0;
/** Strokes go one after another: each edit must know the one before. */
let queue = Promise.resolve();

/** @param {Stroke[]} strokes */
export function addStrokes(strokes) {
  const waiting = strokes.map((stroke) => /** @type {Waiting} */ ({ n: count++, stroke, state: "going" }));
  change({ waiting: [...now().waiting, ...waiting] });
  queue = queue.then(sendWaiting);
}

/** Sends what has been drawn by now, in one edit. */
async function sendWaiting() {
  const going = now().waiting.filter(({ state }) => state === "going");
  if (going.length === 0) return;
  const taken = await editNewest((values) => [{ key: strokesKey, value: [...strokesIn(values), ...going.map(({ stroke }) => stroke)] }]);
  const sent = new Set(going.map(({ n }) => n));
  change({ waiting: now().waiting.map((one) => (sent.has(one.n) ? { ...one, state: taken ? "taken" : "failed" } : one)) });
}

/** A stroke that was refused is not lost. */
export function sendAgain() {
  change({ waiting: now().waiting.map((one) => (one.state === "failed" ? { ...one, state: "going" } : one)), problem: null });
  queue = queue.then(sendWaiting);
}

export const dropFailed = () => change({ waiting: now().waiting.filter(({ state }) => state !== "failed") });

/** @param {State} state whether the page has labels in which all seeds are */
function labelsFollowed({ server, voxels }) {
  const labels = server?.volumes.find(({ id }) => id === "labels");
  if (!labels || server?.live?.problem) return true;
  return !server?.live?.following && labels.fresh !== false && voxels.labels?.key === labels.key;
}

/** A stroke waits until the labels have it, or it was taken back. @param {State} state @param {State} before */
export function followSeeds(state, before) {
  if (!state.waiting.some((one) => one.state === "taken")) return;
  if (state.server === before.server && state.voxels === before.voxels && state.waiting === before.waiting) return;
  const known = new Set(strokesOf(state).map(spelled));
  const followed = labelsFollowed(state);
  const waiting = state.waiting.filter((one) => one.state !== "taken" || (!followed && known.has(spelled(one.stroke))));
  if (waiting.length < state.waiting.length) change({ waiting });
}

/** @param {Stroke} stroke */
const spelled = ({ tissue, radius, points }) => JSON.stringify([tissue, radius, points]);

export const takeBackLast = () => edit([{ key: strokesKey, value: orNull(strokesOf(now()).slice(0, -1)) }]);

export const removeAll = () => edit([strokesKey, ...told.map(({ id }) => `seeds.${id}`)].map((key) => ({ key, value: null })));

/** @param {Tissue} tissue @param {Triple} place */
export function addPoint(tissue, place) {
  const key = `seeds.${tissue}`;
  const rounded = place.map((x) => Math.round(x * 10) / 10);
  return editNewest((values) => [{ key, value: [...(values[key] ?? []), rounded] }]);
}

/** @param {Point} point */
export function removePoint({ tissue, place }) {
  const left = pointsOf(now()).filter((one) => one.tissue === tissue && one.place.join() !== place.join()).map((one) => one.place);
  return edit([{ key: `seeds.${tissue}`, value: orNull(left) }]);
}

/** @param {Tissue} tissue */
export function chooseTissue(tissue) {
  const { brush } = now();
  change({ brush: { ...brush, tissue, before: tissue === "erase" ? brush.before : tissue } });
}

/** @param {number} step to the next or the one before; erasing is no tissue */
export function nextTissue(step) {
  const at = told.findIndex(({ id }) => id === now().brush.before);
  chooseTissue(told[(at + step + told.length) % told.length].id);
}

export const toggleErase = () => chooseTissue(now().brush.tissue === "erase" ? now().brush.before : "erase");

/** @param {number} radius mm */
export function setRadius(radius) {
  if (!Number.isFinite(radius)) return;
  change({ brush: { ...now().brush, radius: Math.min(Math.max(Math.round(radius * 2) / 2, radii.least), radii.most) } });
}

/** @param {number} notches larger; small brushes change in small steps */
export function resize(notches) {
  const { radius } = now().brush;
  setRadius(radius + notches * (radius < 5 || (radius === 5 && notches < 0) ? 0.5 : 1));
}
