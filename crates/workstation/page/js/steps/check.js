// Step 5: the verdict, then warnings, each with its tick; CT and simulated CT in one picture; structures and doses; figures.
import { goToWarning } from "../actions.js";
import { element } from "../dom.js";
import { hint } from "../keys.js";
import { tick } from "../link.js";
import { change, now } from "../state.js";
import { ownPart } from "./own.js";
import { oldMark, part, way } from "./parts.js";
import { figureTable, verdictLines } from "./verdict.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** A tick that was refused is taken off again. @param {HTMLInputElement} box @param {string} id */
async function send(box, id) {
  const on = box.checked;
  if (!await tick(id, on)) box.checked = !on;
}

/** @param {import("../state.js").Warning} one @param {boolean} current */
const row = ({ id, message, ticked, old, place_mm: place }, current) => element("li", { class: "ticked", "aria-current": current && "true" },
  element("input", { type: "checkbox", "data-key": `tick ${id}`, "aria-label": `Seen: ${message}`, checked: ticked,
    onchange: (/** @type {any} */ event) => send(event.target, id) }),
  element("div", {}, element("p", {}, old ? oldMark() : "", message), place ? element("button", {
    type: "button", class: "jump", "data-key": `go ${id}`, "aria-label": `Go there: ${message}`, onclick: () => goToWarning(id),
  }, "Go there\u00a0\u25b8") : ""));

/** @returns {Part} */
function warnings() {
  const data = (/** @type {State} */ state) => ({ all: state.server?.warnings ?? [], current: state.warning });
  const shown = part("warnings", data, ({ all, current }) => {
    const open = all.filter((one) => !one.ticked).length;
    if (all.length === 0) return [element("h3", {}, "No warnings of the stages")];
    return [
      element("h3", {}, `Warnings: ${open} of ${all.length} not ticked`),
      element("button", { type: "button", "data-key": "next", disabled: open === 0, title: hint("warning"), onclick: () => goToWarning() }, "Next warning"),
      element("ul", { class: "plain" }, ...all.map((one) => row(one, one.id === current))),
      element("p", { class: "quiet" }, "Ticks are kept with the case and stand in the report."),
    ];
  });
  let before = now().warning;
  return { root: shown.root, draw: (state) => {
    shown.draw(state);
    if (state.warning !== before) shown.root.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
    before = state.warning;
  } };
}

/** What is known of the verdict before anything was written. @param {State} state */
function unjudged({ server }) {
  const told = server?.tumour;
  if (!told) return null;
  return told.reason ? { colour: /** @type {"amber"} */ ("amber"), headline: "AMBER at best; a run that is written gives the verdict", reasons: [told.reason] }
    : { colour: null, headline: "Not judged yet: a run that is written gives the verdict.", reasons: [] };
}

/** What the run said, marked once the case is another one; before it, what is known already. @returns {Part} */
function verdict() {
  const data = (/** @type {State} */ state) => (state.server?.result
    ? { colour: state.server.result.verdict, ...state.server.result } : unjudged(state));
  return part("verdict-part", data, (told) => (told ? [element("h3", {}, "Verdict"),
    ...(told.colour ? verdictLines(/** @type {any} */ (told)) : [element("p", { class: "quiet" }, told.headline)])] : []));
}

/** @returns {Part} */
const figures = () => part("figures-part", (/** @type {State} */ { server }) => server?.figures ?? [],
  (all) => (all.length > 0 ? [element("h3", {}, "Figures"), ...figureTable(all)] : []));

/** The change of volume is drawn in the planes of the CT. @param {string} id */
const choose = (id) => change({ compare: { ...now().compare, way: id }, ...(id === "volume" ? { show: "ct" } : {}) });

/** @returns {Part} */
function compare() {
  const data = (/** @type {State} */ { voxels, server, compare: { way: chosen } }) => ({ both: Boolean(voxels.ct && voxels.deformed),
    change: Boolean(voxels.ct && server?.volumes.some(({ id }) => id === "jacobian")), way: chosen });
  return part("compare", data, ({ both, change: changed, way: chosen }) => {
    if (!both && !changed) return [element("p", { class: "quiet" }, "CT and simulated CT can be compared after a run.")];
    /** @type {[string, string][]} */
    const two = both ? [["curtain", "Curtain"], ["blend", "Blend"], ["difference", "Difference"]] : [];
    /** @type {[string, string][]} */
    const all = [["off", "One"], ...two, ...(changed ? [/** @type {[string, string]} */ (["volume", "Volume change"])] : [])];
    return [element("h3", {}, "Compare"), element("div", { class: "choices", role: "group", "aria-label": "Compare" },
      ...all.map(([id, name]) => element("button", {
        type: "button", "data-key": id, "aria-pressed": String(chosen === id), onclick: () => choose(id),
      }, name)))];
  });
}

/** The colours of the change of volume with their numbers. */
function changeScale() {
  const numbers = ["\u221230\u202f%", "0", "+30\u202f%"].map((text) => element("span", {}, text));
  return element("div", { class: "change-scale" }, element("i", { "aria-hidden": "true" }), element("p", { class: "numbers" }, ...numbers),
    element("p", { class: "quiet" }, "Blue: smaller. Orange: larger. Nothing within \u00b12\u202f%. The number at the pointer stands below."));
}

/** @returns {Part} */
function share() {
  const slider = element("input", { type: "range", id: "share", min: 0, max: 1, step: 0.01,
    oninput: () => change({ compare: { ...now().compare, share: Number(slider.value) } }) });
  const root = element("p", { class: "field" }, element("label", { for: "share" }, "Share"), slider);
  const hintText = element("p", { class: "quiet" });
  const scale = changeScale();
  const all = element("div", {}, root, hintText, scale);
  return { root: all, draw: ({ compare: { way: chosen, share: part }, window }) => {
    all.hidden = chosen === "off";
    root.hidden = chosen !== "curtain" && chosen !== "blend";
    scale.hidden = chosen !== "volume";
    hintText.textContent = chosen === "difference" ? `Simulated CT \u2212 CT. Red: denser after, blue: less dense; full colour from \u00b1${window.width / 2} HU.` : "";
    if (document.activeElement !== slider) slider.value = String(part);
  } };
}

/** Arrows in 3D: the same switch as in Display, where they are wanted. @returns {Part} */
function arrows() {
  const data = (/** @type {State} */ { surfaces, hiddenParts }) => ({ is: "displacement" in surfaces, on: !hiddenParts.includes("displacement") });
  const flip = () => {
    const { hiddenParts } = now();
    const others = hiddenParts.filter((one) => one !== "displacement");
    change({ hiddenParts: others.length < hiddenParts.length ? others : [...others, "displacement"] });
  };
  return part("arrows", data, ({ is, on }) => (is ? [element("label", {},
    element("input", { type: "checkbox", "data-key": "arrows", checked: on, onchange: flip }), " arrows of the tissue\u2019s way in 3D")] : []));
}

/** @returns {Part[]} */
export const checkParts = () => [verdict(), warnings(), way(), compare(), share(), arrows(), ownPart(), figures()];
