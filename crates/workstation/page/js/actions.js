// What the user can do to the page's state, whichever key, button or drag asks for it.
import { clamp, inside, nearest, patientAxis, toPlace, toPlane, toVoxel } from "./geometry.js";
import { allFitted, change, now, ofOneCt, planes, shownVolume, tumourOf, turnOf, viewOf } from "./state.js";
import { bodyOf, fromScreenOf, paneOf } from "./views/pane.js";

/** @typedef {import("./geometry.js").Triple} Triple */
/** @typedef {import("./geometry.js").Pair} Pair */
/** @typedef {import("./state.js").State} State */

export const steps = ["open", "mark", "segment", "table", "check", "export"];
export const presets = [
  { name: "breast", width: 350, level: -20 }, { name: "soft tissue", width: 400, level: 40 },
  { name: "lung", width: 1500, level: -600 }, { name: "bone", width: 2000, level: 400 },
];

/** @param {string} step */
export function chooseStep(step) {
  if (step !== "open" && !now().server?.case) return;
  change({ step, tool: "crosshair", draft: null });
}

/** The crosshair goes to the nearest voxel's centre: what it reads is a stored value. @param {Triple} place */
export function moveCrosshair(place) {
  const held = shownVolume(now());
  if (held) change({ crosshair: toPlace(held.grid, nearest(held.grid, place)) });
}

/** Brings the crosshair to a place, and the place into every view. @param {Triple} place */
export function goTo(place) {
  moveCrosshair(place);
  const cameras = { ...now().cameras };
  for (const name of planes) {
    const pane = paneOf(now(), name);
    if (!pane || pane.camera.zoom <= 1 || cameras[name].body) continue;
    const [x, y] = toPlane(pane.held.grid, pane.view, place);
    cameras[name] = { ...pane.camera, middle: [(x + 0.5) / pane.plane.width, (y + 0.5) / pane.plane.height] };
  }
  change({ cameras });
}

/** Moves a view's plane; forward is to the patient's left, back or head, however the grid lies.
 * @param {string} name @param {number} forward */
export function stepSlice(name, forward) {
  const state = now();
  const [held, view] = [shownVolume(state), viewOf(state, name)];
  if (!held || !view || !state.crosshair) return;
  const voxel = nearest(held.grid, state.crosshair);
  const { sign } = patientAxis(held.grid, view.normal);
  voxel[view.normal] = clamp(voxel[view.normal] + sign * forward, 0, held.grid.size[view.normal] - 1);
  change({ crosshair: toPlace(held.grid, voxel) });
}

/** Moves the crosshair within a view. @param {string} name @param {number} right @param {number} down voxels */
export function nudge(name, right, down) {
  const state = now();
  const [held, view] = [shownVolume(state), viewOf(state, name)];
  if (!held || !view || !state.crosshair) return;
  const voxel = toVoxel(held.grid, state.crosshair);
  voxel[view.right.axis] += view.right.flip ? -right : right;
  voxel[view.down.axis] += view.down.flip ? -down : down;
  moveCrosshair(toPlace(held.grid, voxel));
}

/** Keeps what lies at `at` (pixels of the pane; its middle when missing) where it is.
 * @param {string} name @param {number} factor @param {Pair} [at] */
export function zoom(name, factor, at) {
  if (name === "3d") return zoomScene(factor);
  const pane = paneOf(now(), name);
  if (!pane) return;
  const zoomed = clamp(pane.camera.zoom * factor, 0.5, 40);
  const [x, y] = at ?? [pane.box[0] / 2, pane.box[1] / 2];
  const { scale, left, top } = pane.frame;
  const [wide, high] = [pane.plane.width * pane.plane.across * scale, pane.plane.height * pane.plane.along * scale];
  const real = zoomed / pane.camera.zoom;
  const [u, v] = [(x - left) / wide, (y - top) / high];
  /** @type {Pair} */
  const middle = [u + (pane.box[0] / 2 - x) / (wide * real), v + (pane.box[1] / 2 - y) / (high * real)];
  change({ cameras: { ...now().cameras, [name]: { zoom: zoomed, middle } } });
}

/** @param {number} factor */
function zoomScene(factor) {
  const { scene } = now();
  change({ scene: { ...scene, zoom: clamp(scene.zoom * factor, 0.4, 12) } });
}

/** @param {number} right @param {number} up radians */
export function turnScene(right, up) {
  const { scene } = now();
  change({ scene: { ...scene, turn: turnOf(now()) + right, lift: clamp(scene.lift + up, -1.55, 1.55) } });
}

/** @param {string} name @param {number} right @param {number} down CSS pixels */
export function pan(name, right, down) {
  const pane = paneOf(now(), name);
  if (!pane) return;
  const { camera, plane, frame } = pane;
  const middle = /** @type {Pair} */ ([
    camera.middle[0] - right / (plane.width * plane.across * frame.scale),
    camera.middle[1] - down / (plane.height * plane.along * frame.scale),
  ]);
  change({ cameras: { ...now().cameras, [name]: { ...camera, middle } } });
}

/** The patient in every view; once more, the whole grid. */
export function fit() {
  const fitted = Object.values(now().cameras).every(({ body }) => body);
  change({ cameras: allFitted(!fitted), scene: { ...now().scene, zoom: 1 } });
}

/** @param {number} width @param {number} level */
export function setWindow(width, level) {
  if (!Number.isFinite(width) || !Number.isFinite(level)) return;
  change({ window: { width: clamp(Math.round(width), 1, 8000), level: clamp(Math.round(level), -2000, 6000) } });
}

/** @param {string} name */
export const toggleLarge = (name) => change({ large: now().large === name ? null : name, focus: name });

/** @param {"smooth"|"overlays"|"lines"|"section"|"panel"} what */
export const toggle = (what) => change({ [what]: !now()[what] });

/** @param {string} name @param {Pair} at pixels of the pane @param {boolean} erasing Ctrl is held, with which the brush erases */
export function hover(name, at, erasing) {
  const pane = paneOf(now(), name);
  const place = pane && fromScreenOf(pane, at);
  change({ cursor: pane && place && inside(pane.held.grid, place) ? place : null, over: name, erasing });
}

/** Goes to the next uncertain patch, or to the one that is asked for. @param {number} [n] */
export function goToPatch(n) {
  const patches = now().server?.patches ?? [];
  if (patches.length === 0) return;
  const patch = n ?? (now().patch + 1) % patches.length;
  // A patch is small: the views come near, and stay so.
  const cameras = Object.fromEntries(Object.entries(now().cameras).map(([name, { zoom: before, middle }]) =>
    [name, { zoom: Math.max(before, 3), middle }]));
  change({ patch, cameras });
  goTo(patches[patch].centre_mm);
}

/** Goes to the next warning that is not ticked, or to the one that is asked for. @param {string} [id] */
export function goToWarning(id) {
  const all = now().server?.warnings ?? [];
  const at = all.findIndex((one) => one.id === now().warning);
  const next = id === undefined ? [...all.slice(at + 1), ...all.slice(0, at + 1)].find((one) => !one.ticked) : all.find((one) => one.id === id);
  if (!next) return;
  change({ warning: next.id });
  if (next.place_mm) goTo(next.place_mm);
}

/** Gives up what is under way: a ruler, a drag, a tool, a large view. */
export function giveUp() {
  const state = now();
  if (state.stroke) change({ stroke: null });
  else if (state.ruler || state.draft || state.tool !== "crosshair") change({ ruler: null, draft: null, tool: "crosshair" });
  else if (state.large) change({ large: null });
}

/** @param {State} state @param {string} id */
const keyOf = (state, id) => state.server?.volumes.find((volume) => volume.id === id)?.key;

/** Another CT begins anew; what vanishes is not shown any more. @param {State} state @param {State} before */
export function followCase(state, before) {
  if (state.server === before.server || !state.server) return;
  if (keyOf(state, "ct") !== keyOf(before, "ct")) change(ofOneCt);
  else if (state.show !== "ct" && keyOf(before, "deformed") && !keyOf(state, "deformed")) change({ show: "ct" });
  const patchesOf = (/** @type {State} */ s) => JSON.stringify(s.server?.patches ?? []);
  if (state.patch >= 0 && patchesOf(state) !== patchesOf(before)) change({ patch: -1 });
}

/** The first CT puts the crosshair on the tumour, or in the middle. @param {State} state */
export function placeCrosshair(state) {
  const held = shownVolume(state);
  if (!held || (state.crosshair && inside(held.grid, state.crosshair))) return;
  const body = bodyOf(state, held);
  const middle = /** @type {Triple} */ (held.grid.size.map((n, a) => (body ? (body[0][a] + body[1][a]) / 2 : (n - 1) / 2)));
  const tumour = tumourOf(state);
  moveCrosshair(tumour && inside(held.grid, tumour.centre_mm) ? tumour.centre_mm : toPlace(held.grid, middle));
}
