// Step 4: how the operating table is turned.
import { element, fixed, say, show } from "../dom.js";
import { edit } from "../link.js";
import { now } from "../state.js";
import { runButton } from "./look.js";
import { history } from "./mark.js";
import { numberField, way } from "./parts.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

const most = 45;
const angles = [["bed.ap", "AP"], ["bed.lat", "LAT"]];

/** A slider and a number of one angle. @param {string} key @param {string} name @param {() => void} send */
function angle(key, name, send) {
  const id = `angle-${key.replace(".", "-")}`;
  const number = numberField(name, { id, unit: "\u00b0", min: -most, max: most, step: 0.5, onchange: () => {
    slider.value = number.field.value;
    send();
  } });
  const slider = element("input", {
    type: "range", min: -most, max: most, step: 0.5, "aria-label": `${name}, slider`,
    oninput: () => { number.field.value = slider.value; }, onchange: send,
  });
  const root = element("div", { class: "angle" }, number.root, slider);
  const draw = (/** @type {State} */ state) => {
    const value = state.server?.case?.values[key];
    if (typeof value !== "number" || slider.matches(":active")) return;
    show(number.field, String(value));
    show(slider, String(value));
  };
  return { key, root, draw, field: number.field };
}

/** Both angles. A case without them takes both at once, and none is guessed: nothing is sent while one is missing.
 * @returns {Part} */
function bothAngles() {
  const hint = element("p", { class: "quiet", "aria-live": "polite" });
  const missing = () => fields.some(({ field }) => field.value === "");
  const send = () => {
    hint.textContent = missing() ? "Give both angles; 0 is level." : "";
    if (missing() || fields.some(({ field }) => !field.checkValidity())) return;
    const values = now().server?.case?.values ?? {};
    const changed = fields.map(({ key, field }) => ({ key, value: Number(field.value) })).filter(({ key, value }) => values[key] !== value);
    if (changed.length > 0) edit(changed);
  };
  const fields = angles.map(([key, name]) => angle(key, name, send));
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
    const head = turned(values["bed.ap"], "AP", ["the head is raised", "the head is lowered"]);
    const left = turned(values["bed.lat"], "LAT", ["the patient\u2019s left side is lowered", "the patient\u2019s left side is raised"]);
    say(root, `${head}; ${left}.`);
  } };
}

/** @returns {Part[]} */
export const bedParts = () => [bothAngles(), meaning(), runButton("Simulate", null), way(), history()];
