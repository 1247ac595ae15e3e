// The tumour where a navigation has it: its state is a word beside it, which colour and dashes repeat.
import { isShown, isTracked } from "../applicator.js";
import { depthOf, toScreenOf } from "./pane.js";
import { colours, stroke, swell, write } from "./pen.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./pane.js").Pane} Pane */
/** @typedef {import("../state.js").Sphere} Sphere */
/** @typedef {Sphere & {state: "ok"|"predicted"|"late"|"stale"}} Followed */

/** @type {Record<Followed["state"], {colour: string, dashes: number[], word: string}>} */
const looks = {
  ok: { colour: colours.tumour, dashes: [], word: "" },
  predicted: { colour: "#ffa21a", dashes: [], word: ", predicted" },
  late: { colour: "#ff5a1f", dashes: [3, 4], word: ", LATE" },
  stale: { colour: "#b8b8b8", dashes: [6, 5], word: ", STALE" },
};

/** @param {State} state @returns {Followed|null} nothing where no navigation is shown */
export function followedTumour(state) {
  const answer = isTracked(state) && isShown(state) ? state.navigation?.answer : null;
  return answer ? { centre_mm: answer.tumour, radius_mm: answer.radius_mm, state: answer.state } : null;
}

/** @param {Followed} tumour */
export const followedWord = ({ state }) => `Tumour (navigation)${looks[state].word}`;
/** @param {Followed} tumour */
export const followedColour = ({ state }) => looks[state].colour;

/** @param {CanvasRenderingContext2D} pen @param {Pane} pane @param {Followed} tumour */
export function drawFollowed(pen, pane, tumour) {
  const square = tumour.radius_mm ** 2 - depthOf(pane, tumour.centre_mm) ** 2;
  if (square <= 0) return;
  const [x, y] = toScreenOf(pane, tumour.centre_mm);
  const r = Math.sqrt(square) * pane.frame.scale;
  const { colour, dashes } = looks[tumour.state];
  stroke(pen, colour, 2.2 * swell(), dashes.map((mm) => mm * swell()), () => pen.arc(x, y, r, 0, 2 * Math.PI));
  // On the side with more room.
  const right = x < pane.box[0] / 2;
  const aside = (right ? 1 : -1) * (r * 0.72 + 5 * swell());
  write(pen, followedWord(tumour), x + aside, y - r * 0.72, right ? "left" : "right", colour);
}
