// Step 4: how the operating table is turned, and what that does to the breast while a slider moves.
import { element, fixed, say, show } from "../dom.js";
import { hindrance, limits, onSlider, setAngles, tryAngles } from "../live.js";
import { change, now } from "../state.js";
import { applicatorPart } from "./applicator.js";
import { runButton } from "./look.js";
import { history } from "./mark.js";
import { numberField, numberIn, part, percent, way } from "./parts.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** @type {["ap"|"lat", string][]} */
const angles = [["ap", "AP"], ["lat", "LAT"]];

/** A slider and a number of one angle. @param {"ap"|"lat"} id @param {string} name
 * @param {(held: boolean) => void} told of each change; `held`: the slider still moves */
function angle(id, name, told) {
  const number = numberField(name, { id: `angle-${id}`, unit: "\u00b0", min: -limits.number, max: limits.number, onchange: (x) => {
    slider.value = String(onSlider(x));
    told(false);
  } });
  const slider = element("input", {
    type: "range", min: -limits.slider, max: limits.slider, step: 0.5, "aria-label": `${name}, slider`,
    oninput: () => {
      number.field.value = slider.value;
      told(true);
    },
    onchange: () => told(false),
  });
  const root = element("div", { class: "angle" }, number.root, slider);
  const draw = (/** @type {State} */ state) => {
    const value = state.tilt?.[id] ?? state.server?.case?.values[`table.${id}`];
    if (typeof value !== "number" || slider.matches(":active")) return;
    show(number.field, String(value));
    show(slider, String(onSlider(value)));
  };
  return { root, draw, field: number.field };
}

/** Both angles. A case without them takes both at once, and none is guessed: nothing is sent while one is missing.
 * @returns {Part} */
function bothAngles() {
  const hint = element("p", { class: "quiet", "aria-live": "polite" });
  const told = (/** @type {boolean} */ held) => {
    const missing = fields.some(({ field }) => field.value === "");
    hint.textContent = missing ? "Give both angles; 0 is level." : "";
    const [ap, lat] = fields.map(({ field }) => numberIn(field));
    if (ap === null || lat === null) return;
    if (held) tryAngles({ ap, lat });
    else setAngles({ ap, lat });
  };
  const fields = angles.map(([id, name]) => angle(id, name, told));
  const root = element("div", {}, ...fields.map((one) => one.root), hint);
  return { root, draw: (state) => fields.forEach((one) => one.draw(state)) };
}

/** Which way an angle turns the table. @param {number|undefined} value @param {string} name @param {[string, string]} ways above and below 0 */
function turned(value, name, [up, down]) {
  if (typeof value !== "number") return `${name} is not given`;
  const way = value === 0 ? "level" : value > 0 ? up : down;
  return `${name} ${fixed(value)}\u00b0: ${way}`;
}

/** How the patient then lies, in words. @returns {Part} */
function meaning() {
  const root = element("p", { class: "quiet" });
  return { root, draw: (state) => {
    const values = state.server?.case?.values ?? {};
    const head = turned(state.tilt?.ap ?? values["table.ap"], "AP", ["the head is raised", "the head is lowered"]);
    const left = turned(state.tilt?.lat ?? values["table.lat"], "LAT",
      ["the patient\u2019s left side is lowered", "the patient\u2019s left side is raised"]);
    say(root, `${head}; ${left}.`);
  } };
}

/** What is seen while the table tilts. @returns {Part} */
function picture() {
  return part("picture", ({ previewOn }) => previewOn, (on) => [
    element("h3", {}, "While the table tilts"),
    element("div", { class: "choices", role: "group", "aria-label": "While the table tilts" },
      element("button", { type: "button", "data-key": "preview", "aria-pressed": String(on), onclick: () => change({ previewOn: true }) }, "Show preview"),
      element("button", { type: "button", "data-key": "acquired", "aria-pressed": String(!on), onclick: () => change({ previewOn: false }) },
        "CT as acquired"))]);
}

/** @param {NonNullable<import("../state.js").Server["preview_tilt"]>} tilt */
function standing({ state, share, message, tetrahedra, final_mm: off }) {
  if (state === "preparing") return `Making the preview ready (${percent(share) || "\u2026"})`;
  if (state === "failed") return `\u26a0 No preview${message ? `: ${message}` : "."}`;
  if (typeof off === "number") return `Preview and final differ by ${fixed(off)} mm at the tumour.`;
  const size = typeof tetrahedra === "number" ? `${tetrahedra.toLocaleString("en-GB")} tetrahedra; t` : "T";
  return `Preview: ${size}he planning mesh has not answered yet.`.replace("Preview: The", "The");
}

/** How good the live picture is, and what it says of the tumour. @returns {Part} */
function goodness() {
  const told = element("p", { class: "quiet", "aria-live": "polite" });
  const moved = element("p", { class: "moved" });
  return { root: element("div", { class: "goodness" }, told, moved), draw: (state) => {
    const { server, preview, previewOn } = state;
    say(told, previewOn ? hindrance(state) ?? (server?.preview_tilt ? standing(server.preview_tilt) : "") : "");
    // With an applicator its own section says more.
    say(moved, typeof preview?.moved === "number" && !preview.load ? `PREVIEW: the tumour moves by ${fixed(preview.moved)} mm.` : "");
    moved.hidden = moved.textContent === "";
  } };
}

/** @returns {Part[]} */
export const tableParts = () => [bothAngles(), meaning(), picture(), goodness(), applicatorPart(), runButton("Simulate", null), way(), history()];
