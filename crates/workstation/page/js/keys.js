// The table of keys. It binds them, and makes the tooltips and the help.
import * as actions from "./actions.js";
import { toggleApplicator } from "./applicator.js";
import { redo, undo } from "./link.js";
import { change, now, planes } from "./state.js";
import { nextTissue, resize, toggleErase } from "./tools/seeds.js";

/** @typedef {{keys: string[], what: string, group: string, does: (pressed: boolean) => void, held?: boolean,
 *   fields?: boolean, id?: string}} Binding `held`: told of press and release; `fields`: also while a field has the focus */

const focused = () => now().focus;
/** @param {string} name */
function focusView(name) {
  change({ focus: name, large: now().large && name });
  // A view that was hidden takes the focus once it is drawn.
  requestAnimationFrame(() => document.getElementById(`view-${name}`)?.focus());
}
/** @param {number} n */
const usePreset = (n) => actions.setWindow(actions.presets[n].width, actions.presets[n].level);
/** In the 3D view the arrows turn the patient. @param {number} forward */
const slices = (forward) => () => (planes.includes(focused()) ? actions.stepSlice(focused(), forward) : actions.turnScene(0, forward * 0.1));
/** @param {number} right */
const turn = (right) => () => !planes.includes(focused()) && actions.turnScene(right * 0.1, 0);
/** @param {string} tool */
const useTool = (tool) => () => change({ tool: now().tool === tool ? "crosshair" : tool, ruler: tool === "ruler" ? null : now().ruler });
const painting = () => now().step === "segment";
/** Only a button that can be seen, and only when there is no choice. */
function primary() {
  const all = /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("#panel .step-panel:not([hidden]) .primary:not([disabled])"));
  if (all.length === 1 && all[0].offsetParent) all[0].click();
}

/** @type {Binding[]} */
export const bindings = [
  { id: "slice", group: "Slices", keys: ["ArrowUp"], what: "next slice (to the patient's left, back or head)", does: slices(1) },
  { group: "Slices", keys: ["ArrowDown"], what: "slice before", does: slices(-1) },
  { group: "Slices", keys: ["PageUp"], what: "ten slices on", does: slices(10) },
  { group: "Slices", keys: ["PageDown"], what: "ten slices back", does: slices(-10) },
  { group: "Slices", keys: ["ArrowLeft"], what: "3D: turn to the left (up and down also turn)", does: turn(1) },
  { group: "Slices", keys: ["ArrowRight"], what: "3D: turn to the right", does: turn(-1) },
  { group: "Slices", keys: ["Ctrl+ArrowLeft"], what: "crosshair one voxel to the left", does: () => actions.nudge(focused(), -1, 0) },
  { group: "Slices", keys: ["Ctrl+ArrowRight"], what: "crosshair one voxel to the right", does: () => actions.nudge(focused(), 1, 0) },
  { group: "Slices", keys: ["Ctrl+ArrowUp"], what: "crosshair one voxel up", does: () => actions.nudge(focused(), 0, -1) },
  { group: "Slices", keys: ["Ctrl+ArrowDown"], what: "crosshair one voxel down", does: () => actions.nudge(focused(), 0, 1) },
  { group: "Views", keys: ["A"], what: "focus the axial view", does: () => focusView("axial") },
  { group: "Views", keys: ["S"], what: "focus the sagittal view", does: () => focusView("sagittal") },
  { group: "Views", keys: ["C"], what: "focus the coronal view", does: () => focusView("coronal") },
  { group: "Views", keys: ["Shift+3", "G"], what: "focus the 3D view", does: () => focusView("3d") },
  { id: "large", group: "Views", keys: ["F"], what: "one view large, and back", does: () => actions.toggleLarge(focused()) },
  { id: "larger", group: "Views", keys: ["+", "="], what: "zoom in", does: () => actions.zoom(focused(), 1.25) },
  { id: "smaller", group: "Views", keys: ["-"], what: "zoom out", does: () => actions.zoom(focused(), 0.8) },
  { id: "fit", group: "Views", keys: ["0"], what: "the patient in all views; again: the whole pictures", does: actions.fit },
  {
    id: "pan", group: "Views", keys: ["Space"], held: true, what: "hold and drag: move the picture",
    does: (pressed) => change({ panning: pressed }),
  },
  { id: "breast", group: "Window", keys: ["1"], what: "window for the breast", does: () => usePreset(0) },
  { id: "soft", group: "Window", keys: ["2"], what: "window for soft tissue", does: () => usePreset(1) },
  { id: "lung", group: "Window", keys: ["3"], what: "window for the lung", does: () => usePreset(2) },
  { id: "bone", group: "Window", keys: ["4"], what: "window for bone", does: () => usePreset(3) },
  { id: "overlays", group: "Display", keys: ["O"], what: "colours of the labels on or off", does: () => actions.toggle("overlays") },
  { id: "lines", group: "Display", keys: ["L"], what: "lines on or off", does: () => actions.toggle("lines") },
  { id: "section", group: "Display", keys: ["M"], what: "section of the mesh on or off", does: () => actions.toggle("section") },
  { id: "smooth", group: "Display", keys: ["I"], what: "smooth pixels or square ones", does: () => actions.toggle("smooth") },
  { id: "flicker", group: "Display", keys: ["D"], held: true, what: "hold: the other volume", does: (pressed) => change({ flicker: pressed }) },
  { id: "panel", group: "Display", keys: ["P"], what: "panel on or off", does: () => actions.toggle("panel") },
  { id: "ruler", group: "Tools", keys: ["R"], what: "ruler: two clicks", does: useTool("ruler") },
  { id: "tumour", group: "Tools", keys: ["T"], what: "place the tumour (step 2)", does: () => now().step === "mark" && useTool("tumour")() },
  { id: "brush", group: "Tools", keys: ["B"], what: "brush on or off (step 3)", does: () => painting() && useTool("brush")() },
  { id: "point", group: "Tools", keys: ["N"], what: "set points, on or off (step 3)", does: () => painting() && useTool("point")() },
  { id: "erase", group: "Tools", keys: ["E"], what: "erase, and back", does: () => painting() && toggleErase() },
  { id: "thinner", group: "Tools", keys: ["["], what: "smaller brush", does: () => painting() && resize(-1) },
  { id: "thicker", group: "Tools", keys: ["]"], what: "larger brush", does: () => painting() && resize(1) },
  { id: "tissue-before", group: "Tools", keys: ["Q"], what: "tissue before", does: () => painting() && nextTissue(-1) },
  { id: "tissue-next", group: "Tools", keys: ["W"], what: "next tissue", does: () => painting() && nextTissue(1) },
  { id: "applicator", group: "Tools", keys: ["Shift+P"], what: "applicator in the preview, on or off (step 4)", does: toggleApplicator },
  { id: "patch", group: "Tools", keys: ["X"], what: "next uncertain patch of the chest wall", does: () => actions.goToPatch() },
  { id: "warning", group: "Tools", keys: ["Shift+X"], what: "next warning that is not ticked (step 5)", does: () => now().step === "check" && actions.goToWarning() },
  { id: "undo", group: "Case", keys: ["Ctrl+Z"], what: "undo", does: () => now().server?.case?.can_undo !== false && undo() },
  { id: "redo", group: "Case", keys: ["Ctrl+Shift+Z", "Ctrl+Y"], what: "redo", does: () => now().server?.case?.can_redo !== false && redo() },
  ...actions.steps.map((step, n) => ({
    group: "Steps", keys: [`Alt+${n + 1}`], what: `step ${n + 1}: ${step}`, fields: true, does: () => actions.chooseStep(step),
  })),
  { id: "primary", group: "Steps", keys: ["Enter"], what: "the step's main button", does: primary },
  { id: "cancel", group: "Steps", keys: ["Escape"], what: "give up the tool, the measure, the large view", does: actions.giveUp },
];

/** What the mouse does, for the help. @type {{keys: string[], what: string, group: string}[]} */
export const gestures = [
  { group: "Mouse", keys: ["Wheel"], what: "slices" },
  { group: "Mouse", keys: ["Left button"], what: "the tool: crosshair, ruler, handles, brush, points; in step 4 the applicator, in a slice and in 3D" },
  { group: "Mouse", keys: ["Ctrl+Left drag"], what: "brush: erase" },
  { group: "Mouse", keys: ["Shift+Wheel"], what: "brush: its size" },
  { group: "Mouse", keys: ["Right drag"], what: "window (across) and level (up and down)" },
  { group: "Mouse", keys: ["Middle drag", "Space+drag"], what: "move the picture" },
  { group: "Mouse", keys: ["Ctrl+Wheel"], what: "zoom at the pointer" },
  { group: "Mouse", keys: ["Shift+move"], what: "crosshair in all views follows, in every tool" },
  { group: "Mouse", keys: ["Double click"], what: "one view large, and back" },
];

/** The key as the table writes it. Digits are taken from the key's place: Alt changes what they write.
 * @param {KeyboardEvent} event */
function written(event) {
  const digit = /^Digit(\d)$/.exec(event.code)?.[1];
  const raw = event.key === " " ? "Space" : event.key;
  const letter = /^[a-z]$/i.test(raw);
  const useDigit = digit && !"[]".includes(raw) && (event.altKey || event.shiftKey) && !"+-=".includes(raw);
  const key = useDigit ? digit : letter ? raw.toUpperCase() : raw;
  const shifted = event.shiftKey && (letter || useDigit || key.length > 1);
  // AltGr, with which some keyboards write [ and ], may tell itself as Ctrl and Alt.
  const graph = event.getModifierState("AltGraph");
  return [!graph && (event.ctrlKey || event.metaKey) && "Ctrl", !graph && event.altKey && "Alt", shifted && "Shift", key].filter(Boolean).join("+");
}

/** Elements that need keys themselves. @param {EventTarget|null} target @param {string} key */
function needsIt(target, key) {
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest("dialog")) return true;
  if (target.matches("input, select, textarea")) {
    const typed = !target.matches("[type=checkbox], [type=radio]");
    return key !== "Escape" && (typed || key === "Space" || key.startsWith("Arrow"));
  }
  return target.matches("button, summary, a") && (key === "Enter" || key === "Space");
}

/** @param {() => void} help */
export function listenKeys(help) {
  /** @type {Map<string, Binding>} */
  const table = new Map(bindings.flatMap((binding) => binding.keys.map((key) => [key, binding])));
  /** @type {Map<string, Binding>} */
  const down = new Map();

  window.addEventListener("keydown", (event) => {
    const key = written(event);
    if (needsIt(event.target, key) && !table.get(key)?.fields) return;
    if (key === "?") {
      event.preventDefault();
      return help();
    }
    const binding = table.get(key);
    if (!binding) return;
    event.preventDefault();
    if (!binding.held) return binding.does(true);
    if (!event.repeat) {
      down.set(event.code, binding);
      binding.does(true);
    }
  });
  const release = (/** @type {string} */ code) => {
    down.get(code)?.does(false);
    down.delete(code);
  };
  window.addEventListener("keyup", (event) => release(event.code));
  // A key that is let go in another window is never told.
  window.addEventListener("blur", () => [...down.keys()].forEach(release));
}

/** A tooltip: what it does, and its key. @param {string} id */
export function hint(id) {
  const binding = bindings.find((one) => one.id === id);
  return binding ? `${binding.what} (${binding.keys[0]})` : "";
}
