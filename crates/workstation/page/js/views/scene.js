// The 3D view: surfaces, the tumour, the frames of the three slices, the crosshair. Turned by a drag; a click is a place.
import { goTo, toggleLarge, turnScene, zoom } from "../actions.js";
import { element, say } from "../dom.js";
import { nearest, toPlace } from "../geometry.js";
import { change, now, shownVolume, tumourOf, turnOf, viewOf } from "../state.js";
import { ball, eyeOf, normalsOf, project, sliceFrame, spanOf, unproject } from "./bodies.js";
import { letter, write } from "./pen.js";
import { clearLayer, compose, copyLayer, drawLines, fillTriangles, makeLayer, shadeTable } from "./raster.js";
import { clearCanvas, watchSize } from "./slice.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("./raster.js").Layer} Layer */
/** @typedef {{eye: import("./bodies.js").Eye, bodies: Layer, veil: Layer, solid: Layer, fine: number}} Drawn
 *   `solid`: the bodies with the guides, which change at every step */

/** Parts by their number in the id buffer. @type {[string, Triple][]} */
const parts = [["", [0, 0, 0]], ["skin", [236, 204, 190]], ["wall", [225, 94, 10]], ["cut", [110, 110, 255]], ["tumour", [255, 221, 51]],
  ["mesh", [190, 200, 215]], ["frames", [150, 165, 185]], ["crosshair", [255, 255, 255]]];
const number = (/** @type {string} */ part) => parts.findIndex(([name]) => name === part);
/** @type {Triple} */
const ground = [16, 18, 24];
const tints = parts.map(([, colour]) => colour);
const shades = shadeTable(tints, ground);

/** More pixels than this are not drawn: they cost time and show nothing. */
const most = 800_000;

/** @param {State} state @param {[number, number]} box */
function finenessOf(state, box) {
  const wanted = state.scene.moving ? 0.5 : window.devicePixelRatio || 1;
  return Math.min(wanted, Math.sqrt(most / (box[0] * box[1])));
}

/** @param {State} state @returns {[string, import("../state.js").Surface][]} */
function surfacesOf(state) {
  // The tumour is drawn from the case: while it is dragged its surface is an old one.
  const all = Object.entries(state.surfaces).filter(([part]) => number(part) > 0 && part !== "tumour");
  const tumour = tumourOf(state);
  if (tumour) all.push(["tumour", ball(tumour)]);
  return all.filter(([part]) => !state.hiddenParts.includes(part));
}

/** A tumour alone is no picture of the patient. @param {State} state */
const hasBodies = (state) => Object.keys(state.surfaces).some((part) => part !== "tumour");

/** What is looked at: the skin and all else, or the CT's box. @param {State} state */
function spanOfState(state) {
  const span = hasBodies(state) ? spanOf(Object.values(state.surfaces)) : null;
  const held = shownVolume(state);
  if (span || !held) return span;
  const { size, spacing_mm: spacing } = held.grid;
  const centre = toPlace(held.grid, /** @type {Triple} */ (size.map((n) => (n - 1) / 2)));
  return { centre, reach: Math.hypot(...size.map((n, a) => (n * spacing[a]) / 2)) };
}

/** @param {State} state @param {Drawn} drawn */
function drawGuides(state, { eye, solid }) {
  const held = shownVolume(state);
  if (!held || !state.crosshair) return;
  const thick = Math.max(1, Math.round(solid.width / 700));
  for (const name of ["axial", "sagittal", "coronal"]) {
    const view = viewOf(state, name);
    if (!view) continue;
    const { points, pairs } = sliceFrame(held.grid, view, nearest(held.grid, state.crosshair)[view.normal]);
    drawLines(solid, project(eye, points, null), pairs, number("frames"), thick, 0.5);
  }
  const [x, y, z] = state.crosshair;
  const r = 8;
  const cross = new Float32Array([x - r, y, z, x + r, y, z, x, y - r, z, x, y + r, z, x, y, z - r, x, y, z + r]);
  // The crosshair must be seen: it is drawn in front of everything.
  drawLines(solid, project(eye, cross, null), [0, 1, 2, 3, 4, 5], number("crosshair"), thick + 1, 1e6);
}

/** @param {State} state @param {Drawn} drawn */
function drawSurfaces(state, { eye, bodies, veil }) {
  for (const [part, surface] of surfacesOf(state)) {
    const points = project(eye, surface.points, normalsOf(surface));
    if (part !== "mesh") {
      fillTriangles(part === "skin" ? veil : bodies, points, surface.triangles, number(part));
      continue;
    }
    /** @type {number[]} */
    const edges = [];
    const { triangles } = surface;
    for (let t = 0; t < triangles.length; t += 3) {
      const [a, b, c] = triangles.subarray(t, t + 3);
      edges.push(a, b, b, c, c, a);
    }
    drawLines(bodies, points, edges, number("mesh"), 1, 0.5);
  }
}

/** The patient's directions at the ends of a small cross. @param {CanvasRenderingContext2D} pen
 * @param {import("./bodies.js").Eye} eye
 * @param {[number, number]} box @param {string} title */
function drawLetters(pen, eye, [width, height], title) {
  const size = letter();
  const reach = 2 * size;
  const [x, y] = [width - reach - size, height - reach - size];
  pen.font = `bold ${size * 0.9}px system-ui, sans-serif`;
  ["LR", "PA", "HF"].forEach((pair, a) => {
    const [dx, dy] = [eye.right[a] * reach, -eye.up[a] * reach];
    pen.strokeStyle = "#8793a3";
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(x - dx, y - dy);
    pen.lineTo(x + dx, y + dy);
    pen.stroke();
    [1, -1].forEach((sign, n) => {
      // A direction that points away from the eye is written paler.
      pen.globalAlpha = sign * eye.forward[a] > 0.3 ? 0.45 : 1;
      if (Math.hypot(dx, dy) > size * 0.7) write(pen, pair[n], x + 1.25 * sign * dx, y + 1.25 * sign * dy + size * 0.32, "center");
      pen.globalAlpha = 1;
    });
  });
  pen.font = `${size * 0.88}px system-ui, sans-serif`;
  write(pen, title, 8, size * 1.2, "left");
}

/** @param {number} width @param {number} height @param {number} fine @returns {Drawn} */
function makeDrawn(width, height, fine) {
  const [bodies, veil, solid] = [0, 0, 0].map(() => makeLayer(width, height));
  return { bodies, veil, solid, fine, eye: eyeOf(0, 0, [0, 0, 0], 1, [0, 0]) };
}

/** What the bodies are made of: turning over slices does not draw them anew. @param {State} state @param {number} fine */
const madeOf = (state, fine) => JSON.stringify([Object.values(state.surfaces).map(({ key }) => key), state.hiddenParts, state.scene, turnOf(state),
  tumourOf(state), state.boxes["3d"], shownVolume(state)?.grid.key, fine]);

/** @param {State} state @param {Drawn} drawn @param {{centre: Triple, reach: number}} span */
function drawBodies(state, drawn, span) {
  const { width, height } = drawn.bodies;
  const { lift, zoom: factor } = state.scene;
  const scale = (Math.min(width, height) / 2 / span.reach) * 1.15 * factor;
  drawn.eye = eyeOf(turnOf(state), lift, span.centre, scale, [width / 2, height / 2]);
  clearLayer(drawn.bodies);
  clearLayer(drawn.veil);
  drawSurfaces(state, drawn);
}

/** @param {HTMLCanvasElement} canvas */
function makePainter(canvas) {
  /** @type {Drawn|null} */
  let drawn = null;
  let made = "";
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false }));
  /** @type {ImageData} */
  let picture;
  const paint = (/** @type {State} */ state, /** @type {[number, number]} */ box) => {
    const span = spanOfState(state);
    if (!span) return null;
    const fine = finenessOf(state, box);
    const [width, height] = box.map((x) => Math.max(1, Math.round(x * fine)));
    if (!drawn || drawn.solid.width !== width || drawn.solid.height !== height) {
      [canvas.width, canvas.height] = [width, height];
      picture = new ImageData(width, height);
      drawn = makeDrawn(width, height, fine);
      made = "";
    }
    const key = madeOf(state, fine);
    if (key !== made) drawBodies(state, drawn, span);
    made = key;
    copyLayer(drawn.solid, drawn.bodies);
    drawGuides(state, drawn);
    compose(new Uint32Array(picture.data.buffer), drawn.solid, drawn.veil, shades, tints);
    pen.putImageData(picture, 0, 0);
    return drawn.eye;
  };
  /** The place seen at a pixel of the pane: what is behind the skin before the skin. */
  const pick = (/** @type {number} */ x, /** @type {number} */ y) => {
    if (!drawn) return null;
    const { bodies, veil, eye, fine } = drawn;
    const [px, py] = [Math.floor(x * fine), Math.floor(y * fine)];
    const n = py * bodies.width + px;
    const layer = bodies.id[n] ? bodies : veil;
    return layer.id[n] ? unproject(eye, px + 0.5, py + 0.5, layer.depth[n]) : null;
  };
  return { paint, pick };
}

/** @param {HTMLElement} root @param {(x: number, y: number) => Triple|null} pick */
function listen(root, pick) {
  /** @type {{x: number, y: number, moved: boolean}|null} */
  let held = null;
  root.addEventListener("pointerdown", (event) => {
    root.focus();
    if (event.button !== 0) return;
    held = { x: event.clientX, y: event.clientY, moved: false };
    root.setPointerCapture(event.pointerId);
  });
  root.addEventListener("pointermove", (event) => {
    if (!held) return;
    const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
    if (!held.moved && Math.hypot(dx, dy) < 4) return;
    if (!held.moved) change({ scene: { ...now().scene, moving: true } });
    held = { x: event.clientX, y: event.clientY, moved: true };
    turnScene(-dx / 150, dy / 150);
  });
  const release = (/** @type {PointerEvent} */ event) => {
    const box = root.getBoundingClientRect();
    const place = held && !held.moved && event.type === "pointerup" ? pick(event.clientX - box.left, event.clientY - box.top) : null;
    held = null;
    if (now().scene.moving) change({ scene: { ...now().scene, moving: false } });
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
  const { paint, pick } = makePainter(canvas);
  watchSize(root, "3d");
  listen(root, pick);
  let made = "";

  const draw = (/** @type {State} */ state) => {
    root.hidden = state.large !== null && state.large !== "3d";
    const box = state.boxes["3d"];
    if (root.hidden || !box || box[0] < 1) return;
    const some = hasBodies(state);
    canvas.hidden = lines.hidden = !some && !shownVolume(state);
    say(empty, some ? "" : "3D: the skin and the chest wall come with the mesh");
    const key = `${madeOf(state, window.devicePixelRatio)} ${state.crosshair}`;
    if (canvas.hidden || key === made) return;
    made = key;
    const eye = paint(state, box);
    if (eye) drawLetters(clearCanvas(lines, box, window.devicePixelRatio || 1), eye, box, some ? "3D \u00b7 as in the CT" : "3D");
  };
  return { root, draw };
}
