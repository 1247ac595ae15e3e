// The section of step 4 in which an applicator is tried: where it is, how it is made, and what it does.
import { axisOf, carryTo, centreOf, isIn, isTracked, leaning, leanOf, limits, loadOf, putIn, reshape, takeOut, toggleApplicator, turnTo } from "../applicator.js";
import { element, fixed, remake, say, show } from "../dom.js";
import { hint } from "../keys.js";
import { caseAngles, hindrance } from "../live.js";
import { now } from "../state.js";
import { followPart } from "./follow.js";
import { numberField, percent } from "./parts.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("./parts.js").Part} Part */

/** Fields in a row, with what each shows. @param {string} name @param {{root: HTMLElement, field: HTMLInputElement, of: (one: import("../state.js").Applicator) => number}[]} all
 * @param {string} [kind] @returns {Part} */
function fields(name, all, kind = "") {
  const root = element("div", { class: `place-fields ${kind}`, role: "group", "aria-label": name }, ...all.map((one) => one.root));
  return { root, draw: (state) => {
    const { applicator } = state;
    for (const { field, of } of all) {
      if (applicator) show(field, of(applicator).toFixed(1).replace(/^-0\.0$/, "0.0"));
      field.readOnly = isTracked(state);
    }
  } };
}

/** @returns {Part} */
const placeFields = () => fields("Applicator\u2019s centre", ["L", "P", "S"].map((axis, a) => ({
  ...numberField(axis, { id: `applicator-${axis}`, unit: axis === "S" ? "mm" : "", onchange: (x) => {
    const { applicator } = now();
    if (applicator) carryTo(/** @type {Triple} */ (centreOf(applicator).map((old, n) => (n === a ? x : old))));
  } }), of: (one) => centreOf(one)[a],
})));

/** @returns {Part} */
const sizeFields = () => fields("Applicator\u2019s radii", /** @type {["radius"|"shaft", string][]} */ ([["radius", "Radius"], ["shaft", "Shaft"]]).map(([what, name]) => ({
  ...numberField(name, { id: `applicator-${what}`, unit: what === "shaft" ? "mm (radii)" : "", min: limits[what][0], max: limits[what][1],
    onchange: (x) => reshape({ [what]: x }) }), of: (one) => one[what],
})), "pair");

/** @returns {Part} */
const leanFields = () => fields("Shaft leans from the front", /** @type {["left"|"head", string, number][]} */ ([["left", "Leans left", 180], ["head", "to the head", 90]])
  .map(([what, name, most]) => ({
    ...numberField(name, { id: `applicator-${what}`, unit: what === "head" ? "\u00b0" : "", min: -most, max: most, onchange: (x) => {
      const { applicator } = now();
      if (applicator) turnTo(leaning({ ...leanOf(axisOf(applicator)), [what]: x }));
    } }), of: (one) => leanOf(axisOf(one))[what],
  })), "pair");

/** @returns {Part} */
function contact() {
  const root = element("div", { class: "choices", role: "group", "aria-label": "Tissue on the applicator" });
  return { root, draw: (state) => remake(root, isTracked(state) ? null : state.applicator?.contact ?? null, (chosen) => (chosen === null ? [] : [element("span", { class: "quiet" }, "Tissue"),
    ...[["frictionless", "slides"], ["tied", "sticks"]].map(([id, name]) => element("button", {
      type: "button", "data-key": id, "aria-pressed": String(chosen === id), onclick: () => reshape({ contact: /** @type {any} */ (id) }),
    }, name))])) };
}

/** @returns {Part} */
function buttons() {
  const root = element("div", { class: "choices" });
  const data = (/** @type {State} */ state) => [isTracked(state), Boolean(state.applicator?.inserted)];
  return { root, draw: (state) => remake(root, data(state), ([tracked, inserted]) => (tracked && !inserted ? [] : [
    tracked ? "" : element("button", { type: "button", "data-key": "crosshair", onclick: () => putIn(now().crosshair ?? undefined) }, "To the crosshair"),
    element("button", { type: "button", "data-key": "in", onclick: () => putIn(),
      title: "as if it had come straight to where it is now" }, inserted ? "Insert anew here" : "Put in here"),
    inserted && !tracked ? element("button", { type: "button", "data-key": "out", onclick: takeOut }, "Take out") : "",
  ])) };
}

/** Why the picture with the applicator is not there, or not yet; that of a tracker is told by its own part. @param {State} state */
function standing(state) {
  if (!state.applicator || isTracked(state)) return "";
  if (!state.previewOn) return "The preview is switched off above.";
  if (!state.applicator.inserted) return "Out of the patient. Drag it, or give numbers, then put it in.";
  const away = hindrance(state) ?? (state.tilt || caseAngles(state) ? null : "Give both angles of the table first.");
  const told = state.server?.preview_applicator;
  if (away) return away;
  if (told?.state === "failed") return `\u26a0 It cannot be held like this${told.message ? `: ${told.message}` : ""}. Move it, or insert it anew.`;
  if (told?.state === "preparing" || !loadOf(state)) return `Putting it in (${percent(told?.share ?? null) || "\u2026"})`;
  return "";
}

/** @param {number} mm from the applicator's surface */
const beside = (mm) => (mm < 0 ? `${fixed(-mm)} mm inside it` : `${fixed(mm)} mm from it`);

/** @param {State} state @returns {string[]} */
function readings(state) {
  const load = loadOf(state);
  // What a navigation says stands in its table.
  if (!load || isTracked(state)) return [];
  const { force, moment, away, gap } = load;
  const moved = state.preview?.moved ?? null;
  const tumour = [gap === null ? "" : `edge ${beside(gap)}`, away === null ? "" : `centre ${beside(away)}`].filter(Boolean);
  return [`PREVIEW: force ${fixed(force)} N, moment ${fixed(moment, 0)} N\u202fmm on the applicator.`,
    tumour.length > 0 ? `Tumour: ${tumour.join(", ")}${moved === null ? "" : `; ${fixed(moved)} mm from where it is in the CT`}.` : ""];
}

/** @returns {Part} */
export function applicatorPart() {
  const box = element("input", { type: "checkbox", id: "applicator-on", onchange: toggleApplicator });
  const told = element("p", { class: "quiet", "aria-live": "polite" });
  const lines = [0, 1].map(() => element("p", { class: "moved" }));
  const parts = [placeFields(), leanFields(), sizeFields(), contact(), buttons()];
  const held = element("p", { class: "quiet" });
  const follow = followPart();
  const inner = element("div", { class: "inner" }, ...parts.map((one) => one.root), told, ...lines, held);
  const root = element("div", { class: "applicator" }, element("h3", {}, "Applicator"),
    element("label", { title: hint("applicator"), for: "applicator-on" }, box, " Put an applicator in (preview)"), inner, follow.root);
  return { root, draw: (state) => {
    box.checked = state.applicator !== null;
    inner.hidden = state.applicator === null;
    follow.draw(state);
    if (inner.hidden) return;
    say(held, `${isTracked(state) ? "The tracker holds it: it cannot be dragged until you leave the navigation."
      : "Drag its sphere in a slice or in 3D; the square on its shaft turns it."} Nothing of it goes into the case or the exported CT.`);
    parts.forEach((one) => one.draw(state));
    say(told, standing(state));
    const found = isIn(state) && !isTracked(state) ? readings(state) : [];
    lines.forEach((line, n) => {
      say(line, found[n] ?? "");
      line.hidden = !found[n];
    });
    told.hidden = told.textContent === "";
  } };
}
