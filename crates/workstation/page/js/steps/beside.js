// The part of step 2 with what was drawn beside the CT: which of it the case carries along, and a tumour that is among it.
import { element } from "../dom.js";
import { carry, tumourFrom } from "../link.js";
import { part } from "./parts.js";

/** @typedef {import("../state.js").Beside} Beside */

/** In words. @type {Record<string, string>} */
export const kinds = { structures: "structure set", dose: "dose", segmentation: "segmentation" };

/** A box that was refused goes back. @param {HTMLInputElement} box @param {string} id */
async function choose(box, id) {
  const on = box.checked;
  if (!await carry(id, on)) box.checked = !on;
}

/** The tumour as one of the regions. @param {Beside} object */
function regionChoice({ id, name, regions }) {
  const select = element("select", { "data-key": `region ${id}`, "aria-label": `Tumour from region of ${name}`,
    onchange: () => { use.disabled = select.value === ""; } },
  element("option", { value: "" }, "Tumour from region\u2026"), ...regions.map((region) => element("option", { value: region }, region)));
  const use = element("button", {
    type: "button", "data-key": `use ${id}`, "aria-label": `Use the region of ${name}`, disabled: true, onclick: () => tumourFrom(id, select.value),
  }, "Use");
  return element("div", { class: "choices" }, select, use);
}

/** @param {Beside} object */
const row = (object) => element("li", {},
  element("p", {}, element("strong", {}, object.name), ` ${kinds[object.kind] ?? object.kind}`),
  element("label", {}, element("input", { type: "checkbox", "data-key": `carry ${object.id}`, "aria-label": `Carry along: ${object.name}`,
    checked: object.on, onchange: (/** @type {any} */ event) => choose(event.target, object.id) }), " carry along"),
  object.regions.length > 0 ? regionChoice(object) : "");

/** @returns {import("./parts.js").Part} */
export const besidePart = () => part("beside", ({ server }) => server?.beside ?? [], (all) => (all.length > 0 ? [
  element("h3", {}, "Drawn beside the CT"), element("ul", { class: "plain" }, ...all.map(row)),
  element("p", { class: "quiet" }, "What is carried along goes where the tissue takes it."),
] : []));
