// Lines of planes that the server has finer than voxels: asked for when a view has come to rest, and kept.
import { readLines } from "./link.js";
import { change, now, planes } from "./state.js";
import { otherPane } from "./views/compare.js";
import { paneOf } from "./views/pane.js";

/** @typedef {import("./state.js").State} State */
/** @typedef {import("./views/pane.js").Pane} Pane */
/** @typedef {{name: string, points: number[][][]}} Line in voxels of the plane's grid, not flipped */

const rest = 120;
const most = 300;

/** Lines by volume and key, then by plane; null: there are none to be had. @type {Map<string, Map<string, Line[]|null>>} */
const kept = new Map();
/** What each pane waits for. @type {Map<string, {address: string, timer: number, stop: AbortController}>} */
const waiting = new Map();

/** @param {State} state @param {Pane} pane @returns {{set: string, plane: string}|null} the plane's address in two parts */
function addressOf({ server }, { held, view, slice }) {
  const has = server?.lines?.find(({ volume }) => volume === held.grid.id);
  if (!has) return null;
  const [volume, key] = [has.volume, has.key].map(encodeURIComponent);
  return { set: `${volume}/${key}`, plane: `${view.name}/${slice}` };
}

/** The lines of the plane that a pane shows, when they have come. @param {State} state @param {Pane} pane @returns {Line[]|null} */
export function linesIn(state, pane) {
  const address = addressOf(state, pane);
  return (address && kept.get(address.set)?.get(address.plane)) ?? null;
}

/** @param {string} set @param {string} plane @param {Line[]|null} lines */
function keep(set, plane, lines) {
  const all = kept.get(set) ?? new Map();
  kept.set(set, all);
  all.delete(plane);
  all.set(plane, lines);
  // A map keeps its order: the first plane was used longest ago.
  if (all.size > most) all.delete(all.keys().next().value);
}

/** @param {string} place @param {string} set @param {string} plane @param {AbortController} stop */
async function load(place, set, plane, stop) {
  const lines = await readLines(`${set}/${plane}`, stop.signal);
  if (stop.signal.aborted) return;
  waiting.delete(place);
  if (lines === undefined) return;
  keep(set, plane, lines);
  change({ linesCame: now().linesCame + 1 });
}

/** @param {string} place */
function giveUp(place) {
  const before = waiting.get(place);
  if (!before) return;
  clearTimeout(before.timer);
  before.stop.abort();
  waiting.delete(place);
}

/** What a view draws the lines of: its volume, and the one that it is compared with. @param {State} state @param {string} name
 * @returns {(Pane|null)[]} */
function panesOf(state, name) {
  const shown = state.lines && (state.large === null || state.large === name);
  const pane = shown ? paneOf(state, name) : null;
  return [pane, pane && otherPane(state, pane)];
}

/** @param {State} state @param {string} place of the pane among those of all views @param {Pane|null} pane */
function followPane(state, place, pane) {
  const address = pane && addressOf(state, pane);
  if (!address) return giveUp(place);
  const { set, plane } = address;
  const lines = kept.get(set)?.get(plane);
  if (lines !== undefined) {
    giveUp(place);
    return keep(set, plane, lines);
  }
  if (waiting.get(place)?.address === `${set}/${plane}`) return;
  giveUp(place);
  const stop = new AbortController();
  const timer = window.setTimeout(() => load(place, set, plane, stop), rest);
  waiting.set(place, { address: `${set}/${plane}`, timer, stop });
}

/** Lines under a key that is not named any more are of another state of the case. @param {State} state */
function forget({ server }) {
  const named = new Set((server?.lines ?? []).map(({ volume, key }) => [volume, key].map(encodeURIComponent).join("/")));
  for (const set of kept.keys()) if (!named.has(set)) kept.delete(set);
}

/** @param {State} state @param {State} before */
export function followPlanes(state, before) {
  if (state.server !== before.server) forget(state);
  if (state.cursor !== before.cursor && state.crosshair === before.crosshair && state.server === before.server) return;
  for (const name of planes) panesOf(state, name).forEach((pane, n) => followPane(state, `${name} ${n}`, pane));
}
