// A slice view: one canvas of voxels at their native size, one of lines above it at the screen's own pixels.
import { isTracked } from "../applicator.js";
import { element } from "../dom.js";
import { planeOf } from "../geometry.js";
import { change, now } from "../state.js";
import { blendPlanes, comparedWith } from "./compare.js";
import { drawOverlay, labelsFor } from "./overlay.js";
import { paneOf } from "./pane.js";
import { listenPointer } from "./pointer.js";
import { paintPatch, patchedFor } from "./preview.js";
import { brushOf } from "./strokes.js";
import { makeTables, paint } from "./voxels.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./pane.js").Pane} Pane */

const tablesOf = makeTables();

/** Tells the state how large a view is. A hidden one keeps its size until it is seen again.
 * @param {HTMLElement} root @param {string} name */
export function watchSize(root, name) {
  new ResizeObserver(([{ contentRect: { width, height } }]) => {
    if (width > 0 && height > 0) change({ boxes: { ...now().boxes, [name]: [width, height] } });
  }).observe(root);
}

/** Gives a canvas the screen's own pixels. @param {HTMLCanvasElement} canvas @param {[number, number]} box
 * @param {number} fine @returns {CanvasRenderingContext2D} scaled to CSS pixels */
export function clearCanvas(canvas, box, fine) {
  const [width, height] = box.map((x) => Math.round(x * fine));
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.setTransform(fine, 0, 0, fine, 0, 0);
  return pen;
}

/** Pieces of the live picture have no key of their own. @type {WeakMap<object, number>} */
const numbers = new WeakMap();
let count = 0;
/** @param {object|null} piece */
function numberOf(piece) {
  if (piece && !numbers.has(piece)) numbers.set(piece, ++count);
  return piece ? numbers.get(piece) : 0;
}

/** A browser may take away what a canvas holds (a screen that sleeps, a driver that starts anew) and give it back empty.
 * @param {HTMLCanvasElement} canvas @param {() => void} again */
export function paintAgain(canvas, again) {
  canvas.addEventListener("contextrestored", () => {
    again();
    change({});
  });
}

/** @param {HTMLCanvasElement} canvas */
function makePainter(canvas) {
  /** @type {ImageData|null} */
  let picture = null;
  let painted = "";
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
  paintAgain(canvas, () => (painted = ""));

  return (/** @type {State} */ state, /** @type {Pane} */ pane) => {
    const other = comparedWith(state, pane);
    const labels = state.overlays && !other && !state.preview ? labelsFor(state, pane) : null;
    const piece = other ? null : patchedFor(state, pane);
    const key = [pane.held.key, pane.held.arrived, pane.slice, numberOf(piece), labels?.key, labels?.arrived, state.window.width, state.window.level,
      other?.key, other?.arrived, other && JSON.stringify([state.compare, pane.frame, pane.box])].join(" ");
    if (key === painted) return;
    painted = key;
    const { width, height } = planeOf(pane.held.grid, pane.view);
    if (!picture || picture.width !== width || picture.height !== height) {
      [canvas.width, canvas.height] = [width, height];
      picture = new ImageData(width, height);
    }
    const pixels = new Uint32Array(picture.data.buffer);
    const { greys, colours } = tablesOf(state.window, state.voxels.labels?.grid.names ?? {});
    paint(pixels, pane.held, labels, pane.view, pane.slice, greys, colours);
    if (other) blendPlanes(pixels, pane, other, state.compare, greys, state.window);
    if (piece) paintPatch(pixels, pane, piece, greys, colours);
    pen.putImageData(picture, 0, 0);
  };
}

/** What the lines of a view depend on: a new window, the pointer and the 3D view leave them alone.
 * @param {State} s @param {string} name */
const linesOf = (s, name) => [s.voxels, s.server, s.crosshair, s.cameras[name], s.boxes[name], s.overlays, s.lines, s.section, s.hiddenLines,
  s.linesCame, s.ruler, s.draft, s.patch, s.step, s.show, s.flicker, s.compare, s.stroke, s.waiting, s.brush, s.tool, s.erasing,
  brushOf(s, name), s.preview, s.tilt, s.applicator, s.previewOn, isTracked(s) && s.navigation, window.devicePixelRatio];

/** Pixels are square in mm: the canvas's size in the page is that of the plane. @param {HTMLCanvasElement} canvas @param {Pane} pane */
function lay(canvas, { frame, plane }) {
  Object.assign(canvas.style, {
    left: `${frame.left}px`, top: `${frame.top}px`,
    width: `${plane.width * plane.across * frame.scale}px`, height: `${plane.height * plane.along * frame.scale}px`,
  });
}

/** @param {string} name @returns {{root: HTMLElement, draw: (state: State) => void}} */
export function makeSlice(name) {
  const voxels = element("canvas", { class: "voxels", "aria-hidden": "true" });
  const lines = element("canvas", { class: "lines", "aria-hidden": "true" });
  const empty = element("p", { class: "empty" });
  const title = `${name[0].toUpperCase()}${name.slice(1)}`;
  const root = element("section", {
    class: "view", id: `view-${name}`, tabindex: "0", role: "application", "aria-label": `${title} view`,
    "aria-roledescription": "slice view", title: "",
  }, voxels, lines, empty);
  const paintPlane = makePainter(voxels);
  watchSize(root, name);
  listenPointer(root, name);
  root.addEventListener("focus", () => change({ focus: name }));

  /** @type {any[]} */
  let drawn = [];
  paintAgain(lines, () => (drawn = []));
  const draw = (/** @type {State} */ state) => {
    const hidden = state.large !== null && state.large !== name;
    root.hidden = hidden;
    if (hidden) return;
    const pane = paneOf(state, name);
    voxels.hidden = lines.hidden = pane === null;
    empty.textContent = pane ? "" : `${title}: no images yet`;
    if (!pane) return;
    root.classList.toggle("coarse", !state.smooth);
    paintPlane(state, pane);
    const wanted = linesOf(state, name);
    if (wanted.every((one, n) => one === drawn[n])) return;
    drawn = wanted;
    lay(voxels, pane);
    const fine = window.devicePixelRatio || 1;
    drawOverlay(clearCanvas(lines, pane.box, fine), state, pane, fine);
  };
  return { root, draw };
}
