// How the views look: everything that a key or a drag does there, also as buttons and fields.
import { goTo, presets, setWindow, toggle, zoom, fit } from "../actions.js";
import { element, remake, show } from "../dom.js";
import { hint } from "../keys.js";
import { change, now } from "../state.js";
import { baseOf } from "../views/cast.js";
import { numberField } from "./parts.js";

/** @typedef {import("../state.js").State} State */

function toolButtons() {
  const root = element("div", { class: "choices", role: "group", "aria-label": "Tool" });
  const draw = (/** @type {State} */ { tool }) => remake(root, tool, () => ["crosshair", "ruler"].map((name) => element("button", {
    type: "button", "data-key": name, "aria-pressed": String(tool === name), title: name === "ruler" ? hint("ruler") : "crosshair (Esc)",
    onclick: () => change({ tool: name, ruler: name === "ruler" ? null : now().ruler }),
  }, name[0].toUpperCase() + name.slice(1))));
  return { root, draw };
}

function zoomButtons() {
  const button = (/** @type {string} */ text, /** @type {string} */ label, /** @type {string} */ id, /** @type {() => void} */ does) =>
    element("button", { type: "button", "aria-label": label, title: hint(id), onclick: does }, text);
  return element("div", { class: "choices", role: "group", "aria-label": "Zoom" },
    button("+", "Zoom in", "larger", () => zoom(now().focus, 1.25)), button("\u2212", "Zoom out", "smaller", () => zoom(now().focus, 0.8)),
    button("Fit", "Whole picture", "fit", fit));
}

function windowFields() {
  const select = element("select", { id: "preset", onchange: () => {
    const chosen = presets.find(({ name }) => name === select.value);
    if (chosen) setWindow(chosen.width, chosen.level);
  } }, element("option", { value: "" }, "custom"), ...presets.map(({ name }) => element("option", { value: name }, name)));
  const width = numberField("Window", { id: "window-width", unit: "HU", min: 1, max: 8000, onchange: (x) => setWindow(x, now().window.level) });
  const level = numberField("Level", { id: "window-level", unit: "HU", min: -2000, max: 6000, onchange: (x) => setWindow(now().window.width, x) });
  const root = element("div", { class: "window" },
    element("p", { class: "field" }, element("label", { for: "preset" }, "Preset"), select), width.root, level.root);
  const draw = (/** @type {State} */ { window }) => {
    show(width.field, String(window.width));
    show(level.field, String(window.level));
    const fits = presets.find((one) => one.width === window.width && one.level === window.level);
    if (select.value !== (fits?.name ?? "")) select.value = fits?.name ?? "";
  };
  return { root, draw };
}

function switches() {
  /** @type {["overlays"|"lines"|"section"|"smooth", string][]} */
  const all = [["overlays", "label colours"], ["lines", "lines"], ["section", "mesh section"], ["smooth", "smooth pixels"]];
  const boxes = all.map(([name, text]) => {
    const box = element("input", { type: "checkbox", id: `switch-${name}`, onchange: () => toggle(name) });
    return { name, box, root: element("label", { title: hint(name), for: `switch-${name}` }, box, ` ${text}`) };
  });
  const root = element("div", { class: "switches" }, ...boxes.map((one) => one.root));
  return { root, draw: (/** @type {State} */ state) => boxes.forEach(({ name, box }) => { box.checked = state[name]; }) };
}

function positionFields() {
  const move = (/** @type {number} */ a, /** @type {number} */ x) => {
    const place = now().crosshair;
    if (place) goTo(/** @type {any} */ (place.map((old, n) => (n === a ? x : old))));
  };
  const fields = ["L", "P", "S"].map((name, a) => numberField(name, {
    id: `place-${name}`, unit: name === "S" ? "mm" : "", onchange: (x) => move(a, x),
  }));
  const root = element("div", { class: "place-fields", role: "group", "aria-label": "Crosshair" }, ...fields.map((one) => one.root));
  return { root, draw: (/** @type {State} */ { crosshair }) => crosshair && fields.forEach(({ field }, a) => show(field, crosshair[a].toFixed(1))) };
}

/** Which surfaces the 3D view draws. */
function surfaceSwitches() {
  const root = element("div", { class: "switches", role: "group", "aria-label": "Surfaces in 3D" });
  const flip = (/** @type {string} */ part) => {
    const { hiddenParts } = now();
    change({ hiddenParts: hiddenParts.includes(part) ? hiddenParts.filter((one) => one !== part) : [...hiddenParts, part] });
  };
  const draw = (/** @type {State} */ { surfaces, hiddenParts }) => {
    const names = [...new Set(Object.keys(surfaces).map(baseOf))].sort();
    root.hidden = names.length === 0;
    remake(root, [names, hiddenParts], () => ["3D: ", ...names.map((part) => element("label", {},
      element("input", { type: "checkbox", "data-key": part, checked: !hiddenParts.includes(part), onchange: () => flip(part) }), ` ${part}`))]);
  };
  return { root, draw };
}

export function makeDisplay() {
  const parts = [toolButtons(), windowFields(), switches(), positionFields(), surfaceSwitches()];
  const [tools, window, boxes, place, surfaces] = parts.map((one) => one.root);
  const root = element("details", { class: "display", open: true }, element("summary", {}, "Display"),
    element("div", { class: "row" }, tools, zoomButtons()), window, boxes, surfaces, place,
    element("p", { class: "legend" }, element("i", { class: "solid" }), "chest wall ", element("i", { class: "dashed" }), "skin ",
      element("i", { class: "dotted" }), "region, cut ", element("i", { class: "hatched" }), "uncertain"));
  return { root, draw: (/** @type {State} */ state) => parts.forEach((one) => one.draw(state)) };
}
