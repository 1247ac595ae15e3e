// Step 3: the labels, and what the user says of the tissue: strokes of a brush and points.
import { element, remake, show } from "../dom.js";
import { hint } from "../keys.js";
import { undo } from "../link.js";
import { change, now } from "../state.js";
import { paintAtCrosshair } from "../tools/brush.js";
import { chooseTissue, dropFailed, pointsOf, radii, removeAll, resize, sendAgain, setRadius, strokesOf, takeBackLast,
  tissues } from "../tools/seeds.js";
import { findPatches, patches, runButton } from "./look.js";
import { history } from "./mark.js";
import { numberField, part, percent, warnings } from "./parts.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** What the program does with the seeds meanwhile. @returns {Part} */
function live() {
  const data = (/** @type {State} */ { server }) => server?.live ?? null;
  const root = element("div", { class: "live" });
  const says = element("div", { "aria-live": "polite" });
  const bar = element("progress", { max: "1", "aria-label": "Making the CT ready for painting" });
  root.append(says, bar);
  return { root, draw: (state) => {
    const told = data(state);
    // The share changes often: only the words are spoken.
    bar.hidden = told?.segmenter !== "preparing";
    if (typeof told?.share === "number") bar.value = told.share;
    else bar.removeAttribute("value");
    remake(says, [told?.segmenter, told?.problem, percent(told?.share ?? null)], () => [
      ...(told?.segmenter === "preparing" ? [element("p", {}, `Making the CT ready for painting\u2026 ${percent(told.share)}`)] : []),
      ...(told?.problem ? [element("div", { class: "refused" },
        element("p", {}, element("strong", {}, `\u26a0 ${told.problem.message}`), told.problem.advice ? ` ${told.problem.advice}` : ""),
        element("button", { type: "button", "data-key": "undo-seed", title: hint("undo"), onclick: undo }, "\u21b6 Undo"))] : []),
    ]);
  } };
}

/** @returns {Part} */
function tissueChoice() {
  return part("tissues", ({ brush }) => brush.tissue, (chosen) => [
    element("h3", {}, "Correct by hand"),
    element("div", { class: "choices", role: "group", "aria-label": "Tissue" }, ...tissues.map(({ id, name, letter }) => element("button", {
      type: "button", class: `tissue ${id}`, "data-key": id, "aria-pressed": String(chosen === id),
      title: id === "erase" ? hint("erase") : "Q, W: tissue before, next tissue", onclick: () => chooseTissue(id),
    }, element("i", { "aria-hidden": "true" }, letter), name)))]);
}

/** @type {[string, string, string][]} */
const paintTools = [["brush", "Brush", "Draw in a view of the CT. Hold Ctrl to erase."],
  ["point", "Point", "Click in a view of the CT. With Erase, click a point to take it away."]];

/** @returns {Part} */
function toolChoice() {
  const data = (/** @type {State} */ { tool, show: shown, flicker, voxels, brush }) => ({
    tool, erases: brush.tissue === "erase", simulated: (shown === "deformed") !== flicker && Boolean(voxels.deformed) });
  return part("tools", data, ({ tool, erases, simulated }) => {
    const chosen = paintTools.find(([id]) => id === tool);
    return [
      element("div", { class: "choices", role: "group", "aria-label": "Tool to correct with" },
        ...paintTools.map(([id, name]) => element("button", {
          type: "button", "data-key": id, "aria-pressed": String(tool === id), title: hint(id),
          onclick: () => change({ tool: tool === id ? "crosshair" : id }),
        }, name)),
        element("button", { type: "button", "data-key": "here", disabled: simulated || (tool === "point" && erases),
          onclick: () => paintAtCrosshair(tool === "point" ? "point" : "brush") },
        tool === "point" ? "Point at the crosshair" : "Paint at the crosshair")),
      ...(chosen ? [element("p", { class: "quiet" }, simulated ? "" : chosen[2])] : []),
      ...(chosen && simulated ? [element("p", { class: "unpainted" }, "Paint in the CT: this is the simulated one. ",
        element("button", { type: "button", "data-key": "show-ct", onclick: () => change({ show: "ct" }) }, "Show the CT"))] : []),
    ];
  });
}

/** @returns {Part} */
function size() {
  const { root, field } = numberField("Radius", {
    id: "brush-radius", unit: "mm", min: radii.least, max: radii.most, onchange: setRadius,
  });
  const button = (/** @type {string} */ text, /** @type {string} */ name, /** @type {string} */ id, /** @type {number} */ way) =>
    element("button", { type: "button", "aria-label": name, title: hint(id), onclick: () => resize(way) }, text);
  root.append(button("\u2212", "Smaller brush", "thinner", -1), button("+", "Larger brush", "thicker", 1));
  return { root, draw: ({ brush }) => show(field, String(brush.radius)) };
}

/** @param {number} n @param {string} one */
const counted = (n, one) => `${n} ${one}${n === 1 ? "" : "s"}`;

/** @returns {Part} */
function seeds() {
  const data = (/** @type {State} */ state) => ({
    strokes: strokesOf(state).length, points: pointsOf(state).length, follows: state.server?.live?.following ?? false,
    going: state.waiting.filter((one) => one.state === "going").length,
    failed: state.waiting.filter((one) => one.state === "failed").length,
  });
  return part("seeds", data, ({ strokes, points, follows, going, failed }) => [
    element("p", {}, strokes + points === 0 ? "Nothing corrected yet." : `${counted(strokes, "stroke")}, ${counted(points, "point")}`,
      going ? " \u00b7 sending\u2026" : follows ? element("span", { class: "follows" }, " \u00b7 labels follow\u2026") : ""),
    ...(failed ? [element("div", { class: "refused" },
      element("p", {}, element("strong", {}, `\u26a0 ${counted(failed, "stroke")} not taken`), " by the program; nothing is lost yet."),
      element("div", { class: "choices" },
        element("button", { type: "button", "data-key": "again", onclick: sendAgain }, "Try again"),
        element("button", { type: "button", "data-key": "drop", onclick: dropFailed }, "Throw away")))] : []),
    element("div", { class: "choices" },
      element("button", { type: "button", "data-key": "last", disabled: strokes === 0, onclick: takeBackLast }, "Take back the last stroke"),
      element("button", { type: "button", "data-key": "all", disabled: strokes + points === 0, onclick: removeAll }, "Remove all seeds")),
  ]);
}

/** Nothing can be corrected before there are images. @param {Part} one @returns {Part} */
function withImages({ root, draw }) {
  return { root, draw: (state) => {
    root.hidden = !state.voxels.ct;
    if (!root.hidden) draw(state);
  } };
}

/** @returns {Part[]} */
export const segmentParts = () => [
  runButton("Segment", "segment"), live(), ...[tissueChoice(), toolChoice(), size(), seeds()].map(withImages),
  history(), findPatches(), patches(), warnings("segment"),
];
