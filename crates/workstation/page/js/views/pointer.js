// Mouse and pen on a slice view: which drag is meant, and where it is.
import { hover, moveCrosshair, stepSlice, toggleLarge, zoom } from "../actions.js";
import { change, now } from "../state.js";
import { beginApplicator } from "../tools/applicator.js";
import { beginCurtain } from "../tools/curtain.js";
import { beginPan, beginWindow } from "../tools/drags.js";
import { beginHandle } from "../tools/handles.js";
import { resize } from "../tools/seeds.js";
import { moveRuler, tools } from "../tools/tools.js";
import { fromScreenOf, paneOf } from "./pane.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {{move: (at: Pair, event: PointerEvent) => void, end?: (at: Pair) => void, cancel?: () => void}} Drag
 * `cancel`: the system took the pointer away */

/** Which drag a pressed button begins. @param {string} name @param {Pair} at @param {PointerEvent} event @returns {Drag|null} */
function begin(name, at, event) {
  if (event.button === 1 || (event.button === 0 && now().panning)) return beginPan(name, at);
  if (event.button === 2) return beginWindow(at);
  const pane = paneOf(now(), name);
  if (event.button !== 0 || !pane) return null;
  return beginApplicator(pane, at) ?? beginHandle(pane, at) ?? beginCurtain(pane, at) ?? tools[now().tool](pane, at, event);
}

/** One slice for a notch of a wheel; the small steps of a touch pad are collected. */
function makeNotches() {
  let rest = 0;
  return (/** @type {WheelEvent} */ event) => {
    const delta = event.deltaMode === 0 ? event.deltaY || event.deltaX : (event.deltaY || event.deltaX) * 100;
    if (Math.abs(delta) >= 50) {
      rest = 0;
      return Math.sign(delta) * Math.max(1, Math.round(Math.abs(delta) / 120));
    }
    rest += delta;
    const notches = Math.trunc(rest / 30);
    rest -= notches * 30;
    return notches;
  };
}

/** @param {HTMLElement} root @param {string} name */
function listenWheel(root, name) {
  const notchesOf = makeNotches();
  // Not passive: with Ctrl the browser would zoom the whole page.
  root.addEventListener("wheel", (event) => {
    event.preventDefault();
    const box = root.getBoundingClientRect();
    if (event.ctrlKey) zoom(name, Math.exp(-event.deltaY / 500), [event.clientX - box.left, event.clientY - box.top]);
    else if (event.shiftKey && now().tool === "brush") resize(-notchesOf(event));
    else stepSlice(name, -notchesOf(event));
  }, { passive: false });
}

/** @param {HTMLElement} root @param {string} name */
export function listenPointer(root, name) {
  /** @type {Drag|null} */
  let drag = null;
  const spot = (/** @type {PointerEvent} */ event) => {
    const box = root.getBoundingClientRect();
    return /** @type {Pair} */ ([event.clientX - box.left, event.clientY - box.top]);
  };
  let rest = now().crosshair;
  let pressed = 0;
  root.addEventListener("pointerdown", (event) => {
    root.focus();
    if (event.timeStamp - pressed > 600) rest = now().crosshair;
    pressed = event.timeStamp;
    if (event.button === 1) event.preventDefault();
    drag = begin(name, spot(event), event);
    if (drag) root.setPointerCapture(event.pointerId);
  });
  root.addEventListener("pointermove", (event) => {
    const at = spot(event);
    hover(name, at, event.ctrlKey);
    if (drag) return drag.move(at, event);
    const pane = paneOf(now(), name);
    if (!pane) return;
    if (event.shiftKey) moveCrosshair(fromScreenOf(pane, at));
    moveRuler(pane, at);
  });
  root.addEventListener("pointerup", (event) => {
    drag?.end?.(spot(event));
    drag = null;
  });
  root.addEventListener("pointercancel", () => {
    drag?.cancel?.();
    drag = null;
  });
  root.addEventListener("pointerleave", () => change({ cursor: null, over: null }));
  root.addEventListener("contextmenu", (event) => event.preventDefault());
  root.addEventListener("dblclick", () => {
    if (now().tool !== "crosshair") return;
    // The two clicks have moved the crosshair, which a larger view must not do.
    change({ crosshair: rest });
    toggleLarge(name);
  });
  listenWheel(root, name);
}
