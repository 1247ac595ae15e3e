// The painter of the 3D view: its bodies are drawn when something of them changes, the guides at every step.
import { isShown, isTracked, loadOf } from "../applicator.js";
import { clamp, nearest, toPlace } from "../geometry.js";
import { planes, shownVolume, tumourOf, turnOf, viewOf } from "../state.js";
import { compose } from "./blend.js";
import { edgesOf, eyeOf, frontOf, lit, normalsOf, project, sliceFrame, spanOf, unproject } from "./bodies.js";
import { baseOf, drawnParts, kindOf, looksOf, number, scaleEnd, shapeOf } from "./cast.js";
import { followedTumour } from "./followed.js";
import { clearLayer, copyLayer, drawDots, drawLines, fillTriangles, makeLayer } from "./raster.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Surface} Surface */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("./raster.js").Layer} Layer */
/** @typedef {import("./bodies.js").Eye} Eye */
/** @typedef {import("./bodies.js").Span} Span */
/** @typedef {{eye: Eye, bodies: Layer, solid: Layer, cut: Layer, skin: Layer, body: Layer, tumour: Layer, fine: number}} Drawn
 *   `solid`: the bodies with the guides; `tumour`: it alone; the others are seen through */

/** More pixels than this are not drawn: they cost time and show nothing. */
const most = 800_000;
/** How large a point of a scan is, mm. */
const dotSize = 2.5;

/** A tracker moves the applicator. @param {State} state */
const isLed = (state) => isTracked(state) && state.navigation?.answer?.state !== "stale";

/** Half as fine while something moves. @param {State} state @param {[number, number]} box */
function finenessOf(state, box) {
  const wanted = state.scene.moving || state.draft || state.carrying || isLed(state) ? 0.5 : window.devicePixelRatio || 1;
  return Math.min(wanted, Math.sqrt(most / (box[0] * box[1])));
}

/** A tumour alone is no picture of the patient. @param {State} state */
export const hasBodies = (state) => Object.keys(state.surfaces).some((part) => baseOf(part) !== "tumour");

/** Skin or chest wall is drawn, within the body. @param {State} state */
const hasMesh = (state) => drawnParts(state).some(([part, one]) => ["skin", "chest wall"].includes(kindOf(part, one)));

/** What is looked at: the mesh in all its shapes, so that the eye stands still when the other one is shown; else all
 * there is; else the CT. @param {State} state @returns {Span|null} */
export function spanOfState(state) {
  const all = Object.entries(state.surfaces);
  const mesh = all.filter(([part, one]) => ["skin", "chest wall", "cut"].includes(kindOf(part, one)));
  const span = hasBodies(state) ? spanOf((mesh.length > 0 ? mesh : all).map(([, one]) => one)) : null;
  const held = shownVolume(state);
  if (span || !held) return span;
  const { size, spacing_mm: spacing } = held.grid;
  const centre = toPlace(held.grid, /** @type {Triple} */ (size.map((n) => (n - 1) / 2)));
  const half = /** @type {Triple} */ (size.map((n, a) => (n * spacing[a]) / 2));
  return { centre, half, reach: Math.hypot(...half) };
}

/** @param {State} state @param {Drawn} drawn @param {Span} span */
function drawGuides(state, { eye, solid }, span) {
  const held = shownVolume(state);
  if (!held || !state.crosshair) return;
  const thick = Math.max(1, Math.round(solid.width / 900));
  for (const name of planes) {
    const view = viewOf(state, name);
    if (!view) continue;
    const { points, pairs } = sliceFrame(held.grid, view, nearest(held.grid, state.crosshair)[view.normal], hasBodies(state) ? span : null);
    drawLines(solid, project(eye, points), pairs, number("frames"), thick, 0.5);
  }
  const [x, y, z] = state.crosshair;
  const r = 8;
  const cross = new Float32Array([x - r, y, z, x + r, y, z, x, y - r, z, x, y + r, z, x, y, z - r, x, y, z + r]);
  // The crosshair must be seen: it is drawn in front of everything.
  drawLines(solid, project(eye, cross), [0, 1, 2, 3, 4, 5], number("crosshair"), thick + 1, 1e6);
}

/** Arrows with two short lines at each head; their light is their length. @param {Drawn} drawn @param {Surface} surface */
function drawArrows({ eye, bodies, fine }, surface) {
  const { x, y, z } = project(eye, surface.points);
  const count = surface.values.length;
  const end = scaleEnd([surface]);
  const light = Float32Array.from({ length: 2 * count }, (_, n) => Math.min(255, (255 * surface.values[n >> 1]) / end));
  drawLines(bodies, { x, y, z, light }, Uint32Array.from({ length: 2 * count }, (_, n) => n), number("displacement"), 1, 0.5);
  const [hx, hy, hz, hl] = [0, 0, 0, 0].map(() => new Float32Array(4 * count));
  for (let n = 0; n < count; n++) {
    const [a, b] = [2 * n, 2 * n + 1];
    const [dx, dy] = [x[a] - x[b], y[a] - y[b]];
    const far = Math.hypot(dx, dy);
    const share = far > 0 ? Math.min(0.45, (6 * fine) / far) : 0;
    [1, -1].forEach((side, s) => {
      const at = 4 * n + 2 * s;
      hx.set([x[b], x[b] + share * (dx - side * 0.6 * dy)], at);
      hy.set([y[b], y[b] + share * (dy + side * 0.6 * dx)], at);
      hz.set([z[b], z[b] + share * (z[a] - z[b])], at);
      hl.fill(light[a], at, at + 2);
    });
  }
  drawLines(bodies, { x: hx, y: hy, z: hz, light: hl }, Uint32Array.from({ length: 4 * count }, (_, n) => n), number("displacement"), 1, 0.5);
}

/** Those of a scan's points whose distance from the skin is known, or the others.
 * @param {import("./raster.js").Projected} points @param {Float32Array} values @param {boolean} known @returns {import("./raster.js").Projected} */
function scanned({ x, y, z, light }, values, known) {
  const chosen = (/** @type {Float32Array} */ all) => all.filter((_, n) => Number.isNaN(values[n]) !== known);
  return { x: chosen(x), y: chosen(y), z: chosen(z), light: chosen(light) };
}

/** Points of no part of the skin that is modelled are grey.
 * @param {Drawn} drawn @param {Surface} surface @param {number} end mm at the end of the scale */
function drawScan({ eye, bodies }, { points, values }, end) {
  const light = values.map((mm) => (Number.isNaN(mm) ? 255 : 127.5 * (1 + clamp(mm / end, -1, 1))));
  const all = { ...project(eye, points), light };
  const thick = Math.max(2, Math.round(dotSize * eye.scale));
  drawDots(bodies, scanned(all, values, true), number("scan"), thick, 2);
  drawDots(bodies, scanned(all, values, false), number("scan elsewhere"), thick, 2);
}

/** @param {Drawn} drawn @param {string} kind @param {Surface} surface */
function drawSolid(drawn, kind, surface) {
  const { eye, bodies, tumour } = drawn;
  const normals = normalsOf(surface);
  const veil = { skin: drawn.skin, body: drawn.body, cut: drawn.cut }[kind];
  const points = { ...project(eye, surface.points), ...lit(eye, normals) };
  // Only the body is large enough for its far side to cost time, and it is closed.
  fillTriangles(veil ?? bodies, points, surface.triangles, number(kind), kind === "body" ? frontOf(surface) : 0);
  if (baseOf(kind) === "tumour") fillTriangles(tumour, points, surface.triangles, number(kind));
}

/** @param {State} state @param {Drawn} drawn */
function drawSurfaces(state, drawn) {
  const all = drawnParts(state);
  const scans = all.filter(([part, one]) => kindOf(part, one) === "scan").map(([, one]) => one);
  const end = scaleEnd(scans);
  for (const [part, surface] of all) {
    const kind = kindOf(part, surface);
    if (kind === "displacement") drawArrows(drawn, surface);
    else if (kind === "scan") drawScan(drawn, surface, end);
    else if (kind === "mesh") drawLines(drawn.bodies, project(drawn.eye, surface.points), edgesOf(surface), number(kind), 1, 0.5);
    else drawSolid(drawn, kind, surface);
  }
}

/** What the bodies are made of: turning over slices does not draw them anew. @param {State} state */
export const madeOf = (state) => JSON.stringify([Object.entries(state.surfaces).map(([part, { key }]) => [part, key]), state.hiddenParts,
  shapeOf(state), state.scene, turnOf(state), tumourOf(state), Boolean(state.draft), state.boxes["3d"], shownVolume(state)?.grid.key, window.devicePixelRatio,
  isShown(state) && [state.applicator, loadOf(state)?.tumour, state.carrying, followedTumour(state)]]);

/** @param {number} width @param {number} height @param {number} fine @returns {Drawn} */
function makeDrawn(width, height, fine) {
  const [bodies, solid, tumour] = [0, 0, 0].map(() => makeLayer(width, height, false));
  const [cut, skin, body] = [0, 0, 0].map(() => makeLayer(width, height, true));
  return { bodies, solid, cut, skin, body, tumour, fine, eye: eyeOf(0, 0, [0, 0, 0], 1, [0, 0]) };
}

/** @param {State} state @param {Drawn} drawn @param {Span} span */
function drawBodies(state, drawn, span) {
  const { bodies, cut, skin, body, tumour } = drawn;
  const { lift, zoom: factor } = state.scene;
  const scale = (Math.min(bodies.width, bodies.height) / 2 / span.reach) * 1.15 * factor;
  drawn.eye = eyeOf(turnOf(state), lift, span.centre, scale, [bodies.width / 2, bodies.height / 2]);
  [bodies, cut, skin, body, tumour].forEach(clearLayer);
  drawSurfaces(state, drawn);
}

/** @param {HTMLCanvasElement} canvas */
export function makePainter(canvas) {
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
    const key = madeOf(state);
    if (key !== made) drawBodies(state, drawn, span);
    made = key;
    copyLayer(drawn.solid, drawn.bodies);
    drawGuides(state, drawn, span);
    compose(new Uint32Array(picture.data.buffer), drawn, looksOf(state, hasMesh(state)));
    pen.putImageData(picture, 0, 0);
    return drawn.eye;
  };
  /** The place seen at a pixel of the pane: what is behind the skin before the skin. */
  const pick = (/** @type {number} */ x, /** @type {number} */ y) => {
    if (!drawn) return null;
    const { bodies, skin, cut, body, eye, fine } = drawn;
    const [px, py] = [Math.floor(x * fine), Math.floor(y * fine)];
    const n = py * bodies.width + px;
    const layer = [bodies, skin, cut, body].find(({ id }) => id[n]);
    return layer ? unproject(eye, px + 0.5, py + 0.5, layer.depth[n]) : null;
  };
  /** The way of a drag in mm, parallel to the screen, where it begins on the applicator; else null. */
  const grasp = (/** @type {number} */ x, /** @type {number} */ y) => {
    if (!drawn) return null;
    const { bodies, eye: { right, up, scale }, fine } = drawn;
    const n = Math.floor(y * fine) * bodies.width + Math.floor(x * fine);
    if (bodies.id[n] >>> 24 !== number("applicator")) return null;
    const mm = fine / scale;
    return (/** @type {number} */ dx, /** @type {number} */ dy) => /** @type {Triple} */ (right.map((r, a) => mm * (r * dx - up[a] * dy)));
  };
  return { paint, pick, grasp };
}
