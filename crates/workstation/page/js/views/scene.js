// The 3D view: the surfaces of the shape that is shown, the frames of the three slices, the crosshair. Turned by a drag; a
// click is a place.
import { goTo, toggleLarge, turnScene, zoom } from "../actions.js";
import { carryTo, centreOf, isIn, isTracked } from "../applicator.js";
import { element, say } from "../dom.js";
import { along } from "../geometry.js";
import { change, now, shownVolume } from "../state.js";
import { dressScene } from "./dressing.js";
import { clearCanvas, paintAgain, watchSize } from "./slice.js";
import { hasBodies, madeOf, makePainter } from "./stage.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("../geometry.js").Triple} Triple */

/** @typedef {(x: number, y: number) => ((dx: number, dy: number) => Triple)|null} Grasp the way of a drag that begins on the applicator */

/** What a drag moves the applicator by, when it begins on it. @param {Grasp} grasp @param {number} x @param {number} y */
function beginCarry(grasp, x, y) {
  const one = now().applicator;
  const way = isIn(now()) && !isTracked(now()) ? grasp(x, y) : null;
  return one && way ? (/** @type {number} */ dx, /** @type {number} */ dy) => carryTo(along(centreOf(one), way(dx, dy), 1)) : null;
}

/** @param {HTMLElement} root @param {(x: number, y: number) => Triple|null} pick @param {Grasp} grasp */
function listen(root, pick, grasp) {
  /** @type {{x: number, y: number, moved: boolean, carry: ((dx: number, dy: number) => void)|null}|null} */
  let held = null;
  root.addEventListener("pointerdown", (event) => {
    root.focus();
    if (event.button !== 0) return;
    const box = root.getBoundingClientRect();
    held = { x: event.clientX, y: event.clientY, moved: false, carry: beginCarry(grasp, event.clientX - box.left, event.clientY - box.top) };
    root.setPointerCapture(event.pointerId);
  });
  root.addEventListener("pointermove", (event) => {
    if (!held) return;
    const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
    if (!held.moved && Math.hypot(dx, dy) < 4) return;
    if (held.carry) {
      held.moved = true;
      change({ carrying: true });
      return held.carry(dx, dy);
    }
    if (!held.moved) change({ scene: { ...now().scene, moving: true } });
    held = { x: event.clientX, y: event.clientY, moved: true, carry: null };
    turnScene(-dx / 150, dy / 150);
  });
  const release = (/** @type {PointerEvent} */ event) => {
    const box = root.getBoundingClientRect();
    const place = held && !held.moved && event.type === "pointerup" ? pick(event.clientX - box.left, event.clientY - box.top) : null;
    held = null;
    if (now().scene.moving) change({ scene: { ...now().scene, moving: false } });
    if (now().carrying) change({ carrying: false });
    if (place) goTo(place);
  };
  root.addEventListener("pointerup", release);
  root.addEventListener("pointercancel", release);
  root.addEventListener("dblclick", () => toggleLarge("3d"));
  root.addEventListener("contextmenu", (event) => event.preventDefault());
  root.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom("3d", Math.exp(-event.deltaY / 800));
  }, { passive: false });
  root.addEventListener("focus", () => change({ focus: "3d" }));
}

/** @returns {{root: HTMLElement, draw: (state: State) => void}} */
export function makeScene() {
  const canvas = element("canvas", { class: "scene", "aria-hidden": "true" });
  const lines = element("canvas", { class: "lines", "aria-hidden": "true" });
  const empty = element("p", { class: "empty" });
  const root = element("section", {
    class: "view view-3d", id: "view-3d", tabindex: "0", role: "application", "aria-label": "3D view", "aria-roledescription": "3D view",
  }, canvas, lines, empty);
  const { paint, pick, grasp } = makePainter(canvas);
  watchSize(root, "3d");
  listen(root, pick, grasp);
  let made = "";
  for (const one of [canvas, lines]) paintAgain(one, () => (made = ""));

  const draw = (/** @type {State} */ state) => {
    root.hidden = state.large !== null && state.large !== "3d";
    const box = state.boxes["3d"];
    if (root.hidden || !box || box[0] < 1) return;
    const some = hasBodies(state);
    canvas.hidden = lines.hidden = !some && !shownVolume(state);
    say(empty, some ? "" : "3D: the skin and the chest wall come with the mesh");
    const key = `${madeOf(state)} ${state.crosshair} ${shownVolume(state)?.grid.fresh}`;
    if (canvas.hidden || key === made) return;
    made = key;
    const eye = paint(state, box);
    if (eye) dressScene(clearCanvas(lines, box, window.devicePixelRatio || 1), state, eye, box, some);
  };
  return { root, draw };
}
