// Step 2: the tumour and the side of the breast.
import { goTo } from "../actions.js";
import { element, fixed, remake, show } from "../dom.js";
import { hint } from "../keys.js";
import { edit, redo, undo } from "../link.js";
import { change, now, tumourOf } from "../state.js";
import { setTumour } from "../tools/handles.js";
import { numberField, part } from "./parts.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** @returns {Part} */
function placing() {
  const data = (/** @type {State} */ state) => ({ tool: state.tool, tumour: Boolean(tumourOf(state)), place: tumourOf(state)?.centre_mm ?? null });
  return part("placing", data, ({ tool, tumour, place }) => [
    element("h3", {}, "Tumour"),
    element("div", { class: "choices" },
      element("button", {
        type: "button", class: tumour ? "" : "primary", "data-key": "place", "aria-pressed": String(tool === "tumour"), title: hint("tumour"),
        onclick: () => change({ tool: tool === "tumour" ? "crosshair" : "tumour" }),
      }, tumour ? "Place anew" : "Place"),
      element("button", { type: "button", "data-key": "at", onclick: atCrosshair }, "At the crosshair"),
      place ? element("button", { type: "button", "data-key": "go", onclick: () => goTo(place) }, "Go there") : ""),
    element("p", { class: "quiet" }, tool === "tumour" ? "Click the tumour\u2019s centre in a view."
      : tumour ? "Drag the square at the centre, or the one on the right for the radius." : "No tumour is marked yet."),
  ]);
}

function atCrosshair() {
  const { crosshair } = now();
  if (crosshair) setTumour({ centre_mm: crosshair, radius_mm: tumourOf(now())?.radius_mm ?? 8 });
}

/** @returns {Part} */
function tumourFields() {
  const changed = (/** @type {(sphere: import("../state.js").Sphere) => import("../state.js").Sphere} */ how) => {
    const tumour = tumourOf(now());
    if (tumour) setTumour(how(tumour));
  };
  const centre = ["L", "P", "S"].map((name, a) => numberField(name, { id: `tumour-${name}`, unit: name === "S" ? "mm" : "", step: 0.1,
    onchange: (x) => changed((one) => ({ ...one, centre_mm: /** @type {any} */ (one.centre_mm.map((old, n) => (n === a ? x : old))) })) }));
  const radius = numberField("Radius", { id: "tumour-radius", unit: "mm", min: 1, max: 60, step: 0.1,
    onchange: (x) => changed((one) => ({ ...one, radius_mm: x })) });
  const root = element("div", { class: "place-fields", role: "group", "aria-label": "Tumour" }, ...centre.map((one) => one.root), radius.root);
  return { root, draw: (state) => {
    const tumour = tumourOf(state);
    root.hidden = !tumour;
    if (!tumour) return;
    centre.forEach(({ field }, a) => show(field, tumour.centre_mm[a].toFixed(1)));
    show(radius.field, tumour.radius_mm.toFixed(1));
  } };
}

/** @returns {Part} */
function side() {
  return part("side", (state) => state.server?.case?.values.breast ?? null, (breast) => [
    element("h3", {}, "Breast"),
    element("div", { class: "choices", role: "group", "aria-label": "Breast" }, ...["left", "right"].map((name) => element("button", {
      type: "button", "data-key": name, "aria-pressed": String(breast === name),
      onclick: () => edit([{ key: "breast", value: name }]),
    }, name))),
  ]);
}

/** @returns {Part} */
function region() {
  return part("region", (state) => state.server?.case?.region ?? null, (sphere) => (sphere
    ? [element("p", { class: "quiet" }, `Region (dotted): radius ${fixed(sphere.radius_mm)} mm`)] : []));
}

/** @returns {Part} */
export function history() {
  const root = element("div", { class: "choices history", role: "group", "aria-label": "History" });
  return { root, draw: ({ server }) => remake(root, [server?.case?.can_undo, server?.case?.can_redo], ([canUndo, canRedo]) => [
    element("button", { type: "button", "data-key": "undo", disabled: canUndo === false, title: hint("undo"), onclick: undo }, "\u21b6 Undo"),
    element("button", { type: "button", "data-key": "redo", disabled: canRedo === false, title: hint("redo"), onclick: redo }, "\u21b7 Redo"),
  ]) };
}

export const markParts = () => [placing(), tumourFields(), side(), region(), history()];
