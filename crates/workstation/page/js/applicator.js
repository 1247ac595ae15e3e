// The applicator of intraoperative radiotherapy, a sphere on a straight shaft, as it is tried in the preview: where it was put
// in, and where it has gone since. Nothing of it goes into the case.
import { along, clamp, dot, length, minus } from "./geometry.js";
import { change, now, tumourOf } from "./state.js";

/** @typedef {import("./state.js").State} State */
/** @typedef {import("./state.js").Applicator} Applicator */
/** @typedef {import("./state.js").Load} Load */
/** @typedef {import("./geometry.js").Triple} Triple */

/** Radii, mm: what may be asked for. @type {{radius: [number, number], shaft: [number, number]}} */
export const limits = { radius: [5, 40], shaft: [1, 15] };
/** How long the shaft is, as the server has it, and where its handle is, mm from the centre. */
export const [reach, grip] = [200, 60];

/** @type {Triple} */
const nowhere = [0, 0, 0];
/** Towards the front of the patient. @type {Triple} */
const ahead = [0, -1, 0];
const degrees = 180 / Math.PI;

/** @param {Triple} a @param {Triple} b @returns {Triple} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Triple} a @returns {Triple} */
export const unit = (a) => /** @type {Triple} */ (a.map((x) => x / (length(a) || 1)));

/** Any direction across another. @param {Triple} a @returns {Triple} */
export const across = (a) => unit(cross(a, Math.abs(a[0]) < 0.8 ? [1, 0, 0] : [0, 1, 0]));

/** Turns by a rotation vector (Rodrigues). @param {Triple} a @param {Triple} turn radians @returns {Triple} */
export function turned(a, turn) {
  const angle = length(turn);
  if (angle < 1e-9) return a;
  const about = unit(turn);
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return along(along(/** @type {Triple} */ (a.map((x) => c * x)), cross(about, a), s), about, (1 - c) * dot(about, a));
}

/** The least turn from one direction to another: the applicator is round, so it is never spun about its shaft.
 * @param {Triple} from @param {Triple} to both of length 1 @returns {Triple} a rotation vector */
export function turnBetween(from, to) {
  const about = cross(from, to);
  const angle = Math.atan2(length(about), dot(from, to));
  if (angle < 1e-9) return nowhere;
  const axis = length(about) < 1e-9 ? across(from) : unit(about);
  return /** @type {Triple} */ (axis.map((x) => x * angle));
}

/** Where the sphere's centre is now. @param {Applicator} one */
export const centreOf = ({ centre, shift }) => along(centre, shift, 1);
/** Where the shaft points now. @param {Applicator} one */
export const axisOf = ({ axis, turn }) => turned(axis, turn);

/** How far a direction leans from the front, degrees. @param {Triple} axis @returns {{left: number, head: number}} */
export const leanOf = ([x, y, z]) => ({ left: Math.atan2(x, -y) * degrees, head: Math.asin(clamp(z, -1, 1)) * degrees });
/** @param {{left: number, head: number}} lean @returns {Triple} */
export function leaning({ left, head }) {
  const [l, h] = [left / degrees, head / degrees];
  return [Math.sin(l) * Math.cos(h), -Math.cos(l) * Math.cos(h), Math.sin(h)];
}

/** The applicator is part of the picture that is asked for. @param {State} state */
export const isIn = (state) => state.step === "table" && state.previewOn && Boolean(state.applicator?.inserted);
/** It is seen, in or not. @param {State} state */
export const isSeen = (state) => state.step === "table" && state.previewOn && state.applicator !== null;

/** A tracker holds it: no hand moves it then. @param {State} state */
export const isTracked = ({ step, applicator, navigation }) => step === "table" && applicator !== null && navigation !== null
  && navigation.phase !== "off" && navigation.answer !== null;
/** It stands in the views, in the picture that is asked for or as an outline. @param {State} state */
export const isShown = (state) => isIn(state) || (isTracked(state) && isSeen(state));

/** What the last picture says of the applicator and the tumour. @param {State} state @returns {Load|null} */
export const loadOf = (state) => (isIn(state) ? state.preview?.load ?? null : null);

/** The tumour, or its place, where it lies on the table; as large as the case says. @param {State} state @returns {import("./state.js").Sphere|null} */
export function tumourNow(state) {
  const [sphere, place] = [tumourOf(state), loadOf(state)?.tumour];
  return sphere && place ? { ...sphere, centre_mm: place } : null;
}

/** Where it is put in at first. @param {State} state */
const firstPlace = (state) => (tumourNow(state) ?? tumourOf(state))?.centre_mm ?? state.crosshair;

/** The section is switched on, which puts the applicator in, or off. */
export function toggleApplicator() {
  const state = now();
  if (state.step !== "table") return;
  const centre = firstPlace(state);
  if (state.applicator || !centre) return change({ applicator: null });
  change({
    applicator: { centre, axis: ahead, radius: 15, shaft: 5, contact: "frictionless", shift: nowhere, turn: nowhere, inserted: true },
    previewOn: true, show: "ct",
  });
}

/** Other radii or another contact: it stays where it is. @param {Partial<Pick<Applicator, "radius"|"shaft"|"contact">>} other */
export function reshape(other) {
  const { applicator } = now();
  if (applicator) change({ applicator: { ...applicator, ...other } });
}

/** To a place, as it is in: what has been pushed aside stays so. @param {Triple} place */
export function carryTo(place) {
  const { applicator } = now();
  if (!applicator) return;
  if (applicator.inserted) change({ applicator: { ...applicator, shift: minus(place, applicator.centre) } });
  else change({ applicator: { ...applicator, centre: place } });
}

/** @param {Triple} axis of length 1 */
export function turnTo(axis) {
  const { applicator } = now();
  if (!applicator) return;
  if (applicator.inserted) change({ applicator: { ...applicator, turn: turnBetween(applicator.axis, axis) } });
  else change({ applicator: { ...applicator, axis } });
}

/** Put in where it is, or at another place, as if it had come there straight. @param {Triple} [place] */
export function putIn(place) {
  const { applicator } = now();
  if (!applicator) return;
  change({
    applicator: { ...applicator, centre: place ?? centreOf(applicator), axis: axisOf(applicator), shift: nowhere, turn: nowhere, inserted: true },
    previewOn: true, show: "ct",
  });
}

/** Out of the patient; its place is kept. @param {Applicator|null} one @returns {Applicator|null} */
export const takenOut = (one) => one && { ...one, centre: centreOf(one), axis: axisOf(one), shift: nowhere, turn: nowhere, inserted: false };
export const takeOut = () => change({ applicator: takenOut(now().applicator) });

/** What the server is asked. @param {Applicator} one @param {import("./state.js").Angles} tilt @param {any[][]} seen planes */
export const questionOf = ({ centre, axis, radius, shaft, contact, shift, turn, tracked }, { ap, lat }, seen) =>
  ({ applicator: { ap, lat, centre, axis, radius, shaft, contact, pose: { shift, turn }, followed: Boolean(tracked), planes: seen } });

/** The numbers of a frame. @param {number[]} head three of its beginning @param {Float32Array} rest of its end @returns {Load} */
export function loadFrom([force, moment], [x, y, z, away, gap]) {
  const known = (/** @type {number} */ n) => (Number.isFinite(n) ? n : null);
  return { force, moment, tumour: known(x) === null ? null : [x, y, z], away: known(away), gap: known(gap) };
}
