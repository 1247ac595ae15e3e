// The live picture of the turned bed: what is asked for, one frame at a time, and what comes.
import { clamp, nearest } from "./geometry.js";
import { editNewest, followFrames, tell } from "./link.js";
import { change, now, planes, viewOf } from "./state.js";

/** @typedef {import("./state.js").State} State */
/** @typedef {import("./state.js").Angles} Angles */
/** @typedef {import("./state.js").Patched} Patched */

const magic = 0x44424553;
/** The server may drop a frame that is late: after this it is asked again, ms. */
const patience = 500;
/** What a slider gives; numbers may go further. */
export const limits = { slider: 45, number: 90 };

/** What the case says. @param {State} state @returns {Angles|null} */
export function caseAngles(state) {
  const { "bed.ap": ap, "bed.lat": lat } = state.server?.case?.values ?? {};
  return typeof ap === "number" && typeof lat === "number" ? { ap, lat } : null;
}

/** @param {Angles|null} a @param {Angles|null} b */
export const sameAngles = (a, b) => a?.ap === b?.ap && a?.lat === b?.lat;

/** Why there is no live picture, or null. @param {State} state */
export function hindrance(state) {
  if (!state.socket) return "The live picture needs the socket, which is closed.";
  return null;
}

/** Pictures can be had; the first question makes them ready. @param {State} state */
const lane = ({ socket, server }) => socket && server?.preview_bed?.state !== "failed";

/** The picture that is wanted, as it is asked for. @param {State} state */
function wanted(state) {
  const ct = state.voxels.ct;
  if (state.step !== "bed" || !state.previewOn || !state.bed || !lane(state) || !ct || !state.crosshair) return null;
  const voxel = nearest(ct.grid, state.crosshair);
  const seen = planes.filter((name) => (state.large ?? name) === name)
    .flatMap((name) => { const view = viewOf(state, name); return view ? [[name, voxel[view.normal]]] : []; });
  return seen.length > 0 ? { bed: { ...state.bed, planes: seen } } : null;
}

let asked = "";
let timer = 0;

/** Asks for the newest picture unless one is under way. */
function ask() {
  const want = wanted(now());
  const text = JSON.stringify(want);
  if (!want) asked = "";
  if (!want || timer || text === asked) return;
  asked = text;
  timer = window.setTimeout(() => {
    [timer, asked] = [0, ""];
    ask();
  }, patience);
  tell(want);
}

/** @param {ArrayBuffer} buffer @returns {import("./state.js").Preview|null} */
export function readFrame(buffer) {
  const head = new DataView(buffer);
  if (buffer.byteLength < 32 || head.getUint32(0, true) !== magic) return null;
  const [ap, lat, moved, ms] = [16, 20, 24, 28].map((at) => head.getFloat32(at, true));
  /** @type {Record<string, Patched>} */
  const found = {};
  let at = 32;
  for (let n = head.getUint32(8, true); n > 0; n--) {
    const [view, slice, x0, y0, width, height] = new Uint32Array(buffer, at, 6);
    found[planes[view]] = { slice, x0, y0, width, height, hu: new Int16Array(buffer, at + 24, width * height) };
    at += 24 + 4 * Math.ceil((width * height) / 2);
  }
  return { ap: tidy(ap), lat: tidy(lat), moved: Number.isNaN(moved) ? null : moved, ms, planes: found };
}

/** An angle that came as a short number. @param {number} x */
const tidy = (x) => Math.round(x * 1000) / 1000;

/** @param {ArrayBuffer} buffer */
function take(buffer) {
  clearTimeout(timer);
  timer = 0;
  const state = now();
  const preview = readFrame(buffer);
  // A frame that comes after the step was left is of no use. The first one turns to the CT, which it is drawn upon.
  if (preview && wanted(state)) change(state.preview ? { preview } : { preview, show: "ct" });
  ask();
}

/** A slider is being moved. @param {Angles} bed */
export const tryAngles = (bed) => change({ bed, turning: true });

let sending = false;
let again = false;

/** The angles go into the case: the newest, one edit at a time, however fast the keys come. @param {Angles} bed */
export async function setAngles(bed) {
  change({ bed, turning: false });
  again = true;
  if (sending) return;
  sending = true;
  while (again) {
    again = false;
    const { bed: newest } = now();
    if (newest && !sameAngles(newest, caseAngles(now()))) await editNewest(() => editsOf(newest));
  }
  sending = false;
  settle(now());
}

/** Only what changes: the history has no steps without one. @param {Angles} bed */
function editsOf(bed) {
  const { case: opened } = now().server ?? {};
  return [{ key: "bed.ap", value: bed.ap }, { key: "bed.lat", value: bed.lat }].filter(({ key, value }) => opened?.values[key] !== value);
}

/** The simulated CT of these very angles is in the page. @param {State} state */
function simulated(state) {
  const told = state.server?.volumes.find(({ id }) => id === "deformed");
  return told && told.fresh !== false && state.voxels.deformed?.key === told.key && sameAngles(state.bed, caseAngles(state));
}

/** The picture goes when the step is left, when it is not wanted, and when the real one is there. @param {State} state */
function settle(state) {
  if (!state.bed && !state.preview) return;
  // Without the server's live lane, or while it makes a new mesh, the old picture says nothing.
  if (state.preview && !lane(state)) return change({ preview: null });
  if (state.step !== "bed" || !state.previewOn) change({ preview: null, bed: null, turning: false });
  else if (!state.turning && !sending && simulated(state)) change({ preview: null, bed: null, show: "deformed" });
}

/** Angles that someone else has set, or an undo, are those that are shown. @param {State} state @param {State} before */
function followCase(state, before) {
  const angles = caseAngles(state);
  if (!state.bed || state.turning || sending || sameAngles(angles, caseAngles(before)) || sameAngles(angles, state.bed)) return;
  change(angles ? { bed: angles } : { bed: null, preview: null });
}

/** @param {State} state @param {State} before */
export function followBed(state, before) {
  // A lost frame must not block the next socket.
  if (state.socket !== before.socket) asked = "";
  if (state.server !== before.server) followCase(state, before);
  settle(now());
  ask();
}

/** @param {number} x */
export const onSlider = (x) => clamp(x, -limits.slider, limits.slider);

followFrames((buffer) => {
  try {
    take(buffer);
  } catch (error) {
    change({ problem: { message: `The live picture could not be read: ${/** @type {Error} */ (error).message}.`, advice: null } });
  }
});
