// The live picture of the tilted table, with or without an applicator: what is asked for, one frame at a time, and what comes.
import { isIn, isTracked, loadFrom, questionOf, takenOut } from "./applicator.js";
import { clamp, nearest } from "./geometry.js";
import { edit, followFrames, tell, valuesSeen } from "./link.js";
import { change, now, planes, viewOf } from "./state.js";

/** @typedef {import("./state.js").State} State */
/** @typedef {import("./state.js").Angles} Angles */
/** @typedef {import("./state.js").Patched} Patched */

/** The first bytes of a frame of the table, and of one with an applicator. */
const [ofTilt, ofApplicator] = [0x44424553, 0x44424541];
/** The server may drop a frame that is late: after this it is asked again, ms. */
const patience = 500;
/** What a slider gives; numbers may go further. */
export const limits = { slider: 45, number: 90 };

/** What the case says. @param {State} state @returns {Angles|null} */
export function caseAngles(state) {
  const { "table.ap": ap, "table.lat": lat } = state.server?.case?.values ?? {};
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
const lane = ({ socket, server }) => socket && server?.preview_tilt?.state !== "failed";
/** This applicator cannot be put in like this; another way it may be. @param {State} state */
const failed = (state) => isIn(state) && state.server?.preview_applicator?.state === "failed";
/** @param {State} state */
const shownAngles = (state) => state.tilt ?? caseAngles(state);

/** The picture that is wanted, as it is asked for. @param {State} state */
function wanted(state) {
  const ct = state.voxels.ct;
  const held = isIn(state) ? state.applicator : null;
  const tilt = held ? shownAngles(state) : state.tilt;
  if (state.step !== "table" || !state.previewOn || !tilt || !lane(state) || !ct || !state.crosshair) return null;
  const voxel = nearest(ct.grid, state.crosshair);
  const seen = planes.filter((name) => (state.large ?? name) === name)
    .flatMap((name) => { const view = viewOf(state, name); return view ? [[name, voxel[view.normal]]] : []; });
  if (seen.length === 0) return null;
  return held ? questionOf(held, tilt, seen) : { tilt: { ...tilt, planes: seen } };
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
    timer = 0;
    // What has failed is not asked again until something of it is another.
    if (!failed(now())) asked = "";
    ask();
  }, patience);
  tell(want);
}

/** @param {ArrayBuffer} buffer @returns {import("./state.js").Preview|null} */
export function readFrame(buffer) {
  const head = new DataView(buffer);
  const magic = buffer.byteLength < 32 ? 0 : head.getUint32(0, true);
  if (magic !== ofTilt && magic !== ofApplicator) return null;
  const [a, b, c, ms] = [16, 20, 24, 28].map((at) => head.getFloat32(at, true));
  /** @type {Record<string, Patched>} */
  const found = {};
  let at = 32;
  for (let n = head.getUint32(8, true); n > 0; n--) {
    const [view, slice, x0, y0, width, height] = new Uint32Array(buffer, at, 6);
    found[planes[view]] = { slice, x0, y0, width, height, hu: new Int16Array(buffer, at + 24, width * height) };
    at += 24 + 4 * Math.ceil((width * height) / 2);
  }
  const known = (/** @type {number} */ mm) => (Number.isNaN(mm) ? null : mm);
  if (magic === ofTilt) return { ap: tidy(a), lat: tidy(b), moved: known(c), ms, planes: found, load: null };
  const end = new Float32Array(buffer, at, 8);
  return { ap: tidy(end[5]), lat: tidy(end[6]), moved: known(a), ms, planes: found, load: loadFrom([b, c], end) };
}

/** An angle that came as a short number. @param {number} x */
const tidy = (x) => Math.round(x * 1000) / 1000;

/** @param {ArrayBuffer} buffer */
function take(buffer) {
  clearTimeout(timer);
  timer = 0;
  const state = now();
  const preview = readFrame(buffer);
  // A frame that comes after the step was left, or the applicator was taken out, is of no use. The first one turns to the CT,
  // which it is drawn upon.
  if (preview && wanted(state) && Boolean(preview.load) === isIn(state)) change(state.preview ? { preview } : { preview, show: "ct" });
  ask();
}

/** What the case said when the hand began to tilt the table. @type {Record<string, any>|null} */
let seen = null;
/** What is being sent, which the case will say next. @type {Record<string, any>|null} */
let sent = null;
const seenNow = () => seen ?? sent ?? valuesSeen();

/** A slider is being moved. @param {Angles} tilt */
export function tryAngles(tilt) {
  seen = seenNow();
  change({ tilt, turning: true });
}

let sending = false;
let again = false;

/** The angles go into the case: the newest, one edit at a time, however fast the keys come. @param {Angles} tilt */
export async function setAngles(tilt) {
  seen = seenNow();
  change({ tilt, turning: false });
  again = true;
  if (sending) return;
  sending = true;
  while (again) {
    again = false;
    const [{ tilt: newest }, began] = [now(), seen];
    const edits = newest && began ? editsOf(newest, began) : [];
    if (!now().turning) seen = null;
    sent = newest && { "table.ap": newest.ap, "table.lat": newest.lat };
    if (edits.length > 0 && !await edit(edits, began ?? {}) && !again) change({ tilt: caseAngles(now()) });
  }
  sending = false;
  sent = null;
  // An angle that another window has changed meanwhile is shown.
  if (!now().turning && caseAngles(now())) change({ tilt: caseAngles(now()) });
  settle(now());
}

/** Only what the hand has changed: the other angle may be another window's. @param {Angles} tilt @param {Record<string, any>} before */
const editsOf = (tilt, before) => [{ key: "table.ap", value: tilt.ap }, { key: "table.lat", value: tilt.lat }]
  .filter(({ key, value }) => before[key] !== value);

/** The simulated CT of these very angles is in the page. @param {State} state */
function simulated(state) {
  const told = state.server?.volumes.find(({ id }) => id === "deformed");
  return told && told.fresh !== false && state.voxels.deformed?.key === told.key && sameAngles(state.tilt, caseAngles(state));
}

/** The case's simulation is of the angles that are shown. @param {State} state */
export const onTable = (state) => sameAngles(shownAngles(state), caseAngles(state))
  && state.server?.volumes.some(({ id, fresh }) => id === "deformed" && fresh !== false);

/** The picture goes when the step is left, when it is not wanted, and when the real one is there. @param {State} state */
function settle(state) {
  const held = state.applicator?.inserted;
  if (!state.tilt && !state.preview && !held) return;
  // Without the server's live lane, or while it makes a new mesh, the old picture says nothing.
  // With a tracker the next place may do.
  if (state.preview && (!lane(state) || (failed(state) && !isTracked(state)))) return change({ preview: null });
  if (state.step !== "table") change({ preview: null, tilt: null, turning: false, carrying: false, applicator: takenOut(state.applicator) });
  else if (!state.previewOn) return state.tilt || state.preview ? change({ preview: null, tilt: null, turning: false }) : undefined;
  else if (!held && !state.turning && !sending && simulated(state)) change({ preview: null, tilt: null, show: "deformed" });
}

/** What was simulated in this step is shown as soon as it comes. @param {State} state @param {State} before */
function followSimulated(state, before) {
  const [came, had] = [state.voxels.deformed, before.voxels.deformed];
  if (came && came.key !== had?.key && came.grid.fresh !== false && state.step === "table" && !isIn(state) && !state.turning) change({ show: "deformed" });
}

/** Without its applicator the breast is shown as the table alone has it. @param {State} state @param {State} before */
function followApplicator(state, before) {
  if (isIn(before) && !isIn(state) && state.step === "table" && state.previewOn) change({ preview: null, tilt: shownAngles(state) });
}

/** Angles that someone else has set, or an undo, are those that are shown. @param {State} state @param {State} before */
function followCase(state, before) {
  const angles = caseAngles(state);
  if (!state.tilt || state.turning || sending || sameAngles(angles, caseAngles(before)) || sameAngles(angles, state.tilt)) return;
  change(angles ? { tilt: angles } : { tilt: null, preview: null });
}

/** @param {State} state @param {State} before */
export function followTilt(state, before) {
  // A lost frame must not block the next socket.
  if (state.socket !== before.socket || (failed(before) && !failed(state))) asked = "";
  followApplicator(state, before);
  followSimulated(state, before);
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
