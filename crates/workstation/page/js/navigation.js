// A navigation that is followed: its tracker holds the applicator that the page shows, in words and in the picture.
import { isTracked } from "./applicator.js";
import { length, minus } from "./geometry.js";
import { followNavigation } from "./link.js";
import { change, tumourOf } from "./state.js";

/** @typedef {import("./state.js").State} State */
/** @typedef {import("./state.js").Applicator} Applicator */
/** @typedef {import("./state.js").Answer} Answer */
/** @typedef {import("./geometry.js").Triple} Triple */

/** Where the command listens unless it is told otherwise. */
export const usual = "127.0.0.1:18944";
/** Farther from the case's tumour than any table carries it, mm. */
const elsewhere = 40;
/** @type {Triple} */
const nowhere = [0, 0, 0];

/** Something is followed, or tried to be. @param {State} state */
export const isFollowing = ({ navigation }) => navigation !== null && navigation.phase !== "off";

/** The page's applicator where the tracker has it. @param {Applicator} one @param {Answer} answer @param {State} state @returns {Applicator} */
function placed(one, answer, state) {
  const { centre, axis } = answer;
  const [radius, shaft] = [answer.sphere_radius_mm ?? one.radius, answer.shaft_radius_mm ?? one.shaft];
  return { ...one, radius, shaft, tracked: true, inserted: state.slicesFollow, centre, axis, shift: nowhere, turn: nowhere };
}

/** @param {State} state @param {State} before */
export function followTracker(state, before) {
  const { applicator: one, navigation, step, slicesFollow } = state;
  const same = navigation === before.navigation && step === before.step && slicesFollow === before.slicesFollow;
  if (!one || (same && before.applicator !== null)) return;
  const answer = isTracked(state) ? navigation?.answer : null;
  if (answer) change({ applicator: placed(one, answer, state) });
  // It stays where it was let go, for the hand to take.
  else if (one.tracked) change({ applicator: { ...one, tracked: false } });
}

/** How following stands, for ears: it changes seldom. @param {State} state */
export function standing({ navigation, socket }) {
  if (!socket) return "Following needs the socket, which is closed.";
  if (!navigation || navigation.phase === "off") return "";
  const { phase, address, answer, why } = navigation;
  if (phase === "connecting") return `Connecting to ${address}\u2026`;
  if (phase === "gone") return `\u26a0 Gone: ${why ?? "no connection"}. ${address} is tried again each second.`;
  if (!answer) return "Connected; no pose has come yet.";
  if (answer.state === "stale") return `\u26a0 Stale: ${why ?? "there is no usable pose"}. What is shown is the last answer.`;
  return `Following ${address}.`;
}

/** Messages that were of no use. @param {State} state */
export function passedOver({ navigation }) {
  const { passed = 0, passed_why: why } = navigation ?? {};
  return passed === 0 ? "" : `${passed} ${passed === 1 ? "message" : "messages"} passed over; the last: ${why}.`;
}

/** How far off the tumour is from the case's, where that is farther than a table carries it; else null. @param {State} state */
export function strangeness(state) {
  const [rest, tumour] = [state.navigation?.answer?.rest, tumourOf(state)];
  const off = rest && tumour ? length(minus(rest, tumour.centre_mm)) : 0;
  return off > elsewhere ? off : null;
}

followNavigation((navigation) => change({ navigation }));
