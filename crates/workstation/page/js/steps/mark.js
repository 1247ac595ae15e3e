// Step 2: the tumour, the side of the breast, and the region that is computed.
import { goTo } from "../actions.js";
import { element, remake, show } from "../dom.js";
import { hint } from "../keys.js";
import { edit, redo, undo } from "../link.js";
import { change, now, regionOf, tumourOf } from "../state.js";
import { setSphere, spheres } from "../tools/handles.js";
import { besidePart } from "./beside.js";
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
  if (crosshair) setSphere("tumour", { centre_mm: crosshair, radius_mm: tumourOf(now())?.radius_mm ?? 8 });
}

/** Numbers of a sphere. @param {"tumour"|"region"} what @param {string} name @returns {Part} */
function sphereFields(what, name) {
  const { of, radii: [min, max] } = /** @type {any} */ (spheres.find((one) => one.what === what));
  const changed = (/** @type {(sphere: import("../state.js").Sphere) => import("../state.js").Sphere} */ how) => {
    const sphere = of(now());
    if (sphere) setSphere(what, how(sphere));
  };
  const centre = ["L", "P", "S"].map((axis, a) => numberField(axis, { id: `${what}-${axis}`, unit: axis === "S" ? "mm" : "",
    onchange: (x) => changed((one) => ({ ...one, centre_mm: /** @type {any} */ (one.centre_mm.map((old, n) => (n === a ? x : old))) })) }));
  const radius = numberField("Radius", { id: `${what}-radius`, unit: "mm", min, max,
    onchange: (x) => changed((one) => ({ ...one, radius_mm: x })) });
  const root = element("div", { class: "place-fields", role: "group", "aria-label": name }, ...centre.map((one) => one.root), radius.root);
  return { root, draw: (state) => {
    const sphere = of(state);
    root.hidden = !sphere;
    if (!sphere) return;
    centre.forEach(({ field }, a) => show(field, sphere.centre_mm[a].toFixed(1)));
    show(radius.field, sphere.radius_mm.toFixed(1));
  } };
}

/** @returns {Part} */
function side() {
  const data = (/** @type {State} */ { server }) => ({ breast: server?.case?.values.breast ?? null, proposed: server?.case?.side_proposed === true });
  return part("side", data, ({ breast, proposed }) => [
    element("h3", {}, "Breast"),
    element("div", { class: "choices", role: "group", "aria-label": "Breast" }, ...["left", "right"].map((name) => element("button", {
      type: "button", "data-key": name, "aria-pressed": String(breast === name),
      onclick: () => edit([{ key: "breast", value: name }]),
    }, name)), proposed ? element("span", { class: "quiet" }, "proposed from the tumour\u2019s place") : ""),
  ]);
}

/** A region that the program proposed follows the breast until it is moved by hand. @returns {Part} */
function region() {
  const data = (/** @type {State} */ state) => ({ place: regionOf(state)?.centre_mm ?? null, own: typeof state.server?.case?.values["region.radius"] === "number" });
  return part("region", data, ({ place, own }) => (place ? [
    element("h3", {}, "Region"),
    element("div", { class: "choices" },
      element("button", { type: "button", "data-key": "region-go", onclick: () => goTo(place) }, "Go there"),
      element("button", { type: "button", "data-key": "region-anew", disabled: !own, onclick: fromBreast }, "From the breast again")),
    element("p", { class: "quiet" }, `${own ? "Set by hand." : "Proposed from the breast."} Dotted circle: drag its squares, the middle one to move it.`),
  ] : []));
}

const fromBreast = () => edit([{ key: "region.centre", value: null }, { key: "region.radius", value: null }]);

/** @returns {Part} */
export function history() {
  const root = element("div", { class: "choices history", role: "group", "aria-label": "History" });
  return { root, draw: ({ server }) => remake(root, [server?.case?.can_undo, server?.case?.can_redo], ([canUndo, canRedo]) => [
    element("button", { type: "button", "data-key": "undo", disabled: canUndo === false, title: hint("undo"), onclick: undo }, "\u21b6 Undo"),
    element("button", { type: "button", "data-key": "redo", disabled: canRedo === false, title: hint("redo"), onclick: redo }, "\u21b7 Redo"),
  ]) };
}

export const markParts = () => [placing(), sphereFields("tumour", "Tumour"), besidePart(), side(), region(), sphereFields("region", "Region"),
  history()];
