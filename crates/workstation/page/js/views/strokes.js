// Seeds in a slice: strokes and points of the case, the stroke under way, the brush at the pointer.
import { pointsOf, strokesOf, tissues } from "../tools/seeds.js";
import { cutOf } from "./cuts.js";
import { depthOf, toScreenOf } from "./pane.js";
import { colours, letter, stroke as line, swell, write } from "./pen.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Stroke} Stroke */
/** @typedef {import("../state.js").Tissue} Tissue */
/** @typedef {import("./pane.js").Pane} Pane */
/** @typedef {CanvasRenderingContext2D} Pen */

/** @type {Record<Tissue, string>} */
const tints = { chest_wall: colours.wall, soft_tissue: colours.skin, exclude: "#e394ff", erase: "#ffffff" };
/** @type {Record<string, string>} */
const letters = Object.fromEntries(tissues.map((one) => [one.id, one.letter]));

/** Slanting stripes: a dashed rim, or a hatched face. @type {Map<string, CanvasPattern|null>} */
const patterns = new Map();
/** @param {Pen} pen @param {string} colour @param {number} wide of 8 pixels */
function stripes(pen, colour, wide) {
  const key = `${colour} ${wide}`;
  if (!patterns.has(key)) {
    const tile = Object.assign(document.createElement("canvas"), { width: 8, height: 8 });
    const tilePen = /** @type {Pen} */ (tile.getContext("2d"));
    tilePen.strokeStyle = colour;
    tilePen.lineWidth = wide / Math.SQRT2;
    for (const x of [-8, 0, 8]) {
      tilePen.moveTo(x - 2, 10);
      tilePen.lineTo(x + 10, -2);
    }
    tilePen.stroke();
    patterns.set(key, pen.createPattern(tile, "repeat"));
  }
  return patterns.get(key) ?? colour;
}

/** One stroke on a sheet of its own colour: it takes away what earlier ones said, then says its own.
 * @param {Pen} pen @param {Path2D} path @param {Tissue} tissue @param {boolean} fresh not in the labels yet */
function lay(pen, path, tissue, fresh) {
  // What the labels have already is faint: it must not be taken for the chest wall's line.
  const rim = (fresh ? 1.5 : 1) * swell();
  pen.globalCompositeOperation = "destination-out";
  pen.fill(path);
  if (tissue === "erase" && !fresh) return;
  pen.globalCompositeOperation = "source-over";
  for (const [style, wide] of /** @type {[any, number][]} */ ([["rgba(0, 0, 0, 0.5)", rim + 1],
    [fresh ? stripes(pen, tints[tissue], 5) : tints[tissue], rim]])) {
    pen.globalAlpha = fresh ? 1 : 0.7;
    pen.strokeStyle = style;
    pen.lineWidth = 2 * wide;
    pen.stroke(path);
  }
  pen.globalAlpha = 1;
  // The inner half of the rim and the lines between the pieces go.
  pen.globalCompositeOperation = "destination-out";
  pen.fill(path);
  pen.globalCompositeOperation = "source-over";
  pen.globalAlpha = fresh ? 0.5 : 0.14;
  pen.fillStyle = tissue === "erase" ? stripes(pen, tints.erase, 3) : tints[tissue];
  pen.fill(path);
  pen.globalAlpha = 1;
}

/** A clear sheet of the size of a pane. @param {HTMLCanvasElement} sheet @param {Pane} pane @param {number} fine */
function clear(sheet, pane, fine) {
  const [width, height] = pane.box.map((x) => Math.round(x * fine));
  const pen = /** @type {Pen} */ (sheet.getContext("2d"));
  if (sheet.width !== width || sheet.height !== height) [sheet.width, sheet.height] = [width, height];
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.globalCompositeOperation = "source-over";
  pen.clearRect(0, 0, width, height);
  pen.setTransform(fine, 0, 0, fine, 0, 0);
  return pen;
}

/** Strokes on a sheet, and then their letters, which no later stroke takes away.
 * @param {HTMLCanvasElement} sheet @param {Pane} pane @param {Stroke[]} strokes @param {boolean} fresh @param {number} fine */
function fill(sheet, pane, strokes, fresh, fine) {
  const pen = clear(sheet, pane, fine);
  pen.lineJoin = "round";
  pen.fillStyle = "#000";
  const cuts = strokes.map((stroke) => ({ tissue: stroke.tissue, cut: cutOf(pane, stroke) }));
  for (const { tissue, cut } of cuts) if (cut) lay(pen, cut.path, tissue, fresh);
  pen.globalCompositeOperation = "source-over";
  pen.font = `bold ${letter() * 0.85}px system-ui, sans-serif`;
  for (const { tissue, cut } of cuts) {
    if (cut && (fresh || tissue !== "erase")) write(pen, letters[tissue], cut.at[0], cut.at[1] + letter() * 0.3, "center", tints[tissue]);
  }
  return cuts.some(({ cut }) => cut);
}

/** The sheets of the views with the case's strokes: kept, for a stroke under way is drawn at each move.
 * @type {Record<string, {sheet: HTMLCanvasElement, of: any[], any: boolean}>} */
const kept = {};
/** @type {HTMLCanvasElement|null} */
let scratch = null;

/** @param {State} state @param {Pane} pane @param {number} fine */
function sheetOf(state, pane, fine) {
  const of = [state.server, pane.held.key, pane.slice, pane.frame.left, pane.frame.top, pane.frame.scale, ...pane.box, fine];
  const before = kept[pane.name];
  if (before && of.every((one, n) => one === before.of[n])) return before;
  const sheet = before?.sheet ?? document.createElement("canvas");
  return (kept[pane.name] = { sheet, of, any: fill(sheet, pane, strokesOf(state), false, fine) });
}

/** Signs of points: a lozenge, a cross, a slanting cross. @type {Record<string, Pair[][]>} */
const signs = {
  chest_wall: [[[0, -1], [1, 0], [0, 1], [-1, 0], [0, -1]]], soft_tissue: [[[-1, 0], [1, 0]], [[0, -1], [0, 1]]],
  exclude: [[[-0.8, -0.8], [0.8, 0.8]], [[-0.8, 0.8], [0.8, -0.8]]],
};

/** Points of this plane; those just before or behind it are faint. @param {Pen} pen @param {State} state @param {Pane} pane */
function drawPoints(pen, state, pane) {
  const thick = pane.held.grid.spacing_mm[pane.view.normal];
  const size = 5 * swell();
  for (const { tissue, place } of pointsOf(state)) {
    const depth = Math.abs(depthOf(pane, place));
    if (depth > Math.max(2 * thick, 3)) continue;
    const [x, y] = toScreenOf(pane, place);
    pen.globalAlpha = depth <= thick / 2 + 1e-3 ? 1 : 0.45;
    line(pen, tints[tissue], 1.8 * swell(), [], () => signs[tissue].forEach((way) => way.forEach(([dx, dy], n) =>
      pen[n ? "lineTo" : "moveTo"](x + dx * size, y + dy * size))));
    write(pen, letters[tissue], x + size + 2, y - size * 0.4, "left", tints[tissue]);
  }
  pen.globalAlpha = 1;
}

/** @param {Pen} pen @param {State} state @param {Pane} pane @param {number} fine */
export function drawSeeds(pen, state, pane, fine) {
  if (state.step !== "segment" || pane.held.grid.simulated) return;
  const [width, height] = pane.box;
  if (state.lines) {
    const { sheet, any } = sheetOf(state, pane, fine);
    if (any) pen.drawImage(sheet, 0, 0, width, height);
    drawPoints(pen, state, pane);
  }
  const fresh = [...state.waiting.map(({ stroke }) => stroke), ...(state.stroke ? [state.stroke] : [])];
  if (fresh.length === 0) return;
  scratch ??= document.createElement("canvas");
  if (fill(scratch, pane, fresh, true, fine)) pen.drawImage(scratch, 0, 0, width, height);
}

/** What a view's brush depends on: only the view under the pointer follows it. @param {State} s @param {string} name */
export const brushOf = (s, name) => ((s.tool === "brush" || s.tool === "point") && s.over === name ? s.cursor : null);

/** The brush in its true size, and its letter. @param {Pen} pen @param {State} state @param {Pane} pane */
export function drawBrush(pen, state, pane) {
  const place = brushOf(state, pane.name);
  if (!place) return;
  const [x, y] = toScreenOf(pane, place);
  if (pane.held.grid.simulated) return write(pen, "Paint in the CT", x + 12, y - 12, "left", colours.simulated);
  const tissue = state.stroke?.tissue ?? (state.erasing ? "erase" : state.brush.tissue);
  const r = state.tool === "brush" ? state.brush.radius * pane.frame.scale : 6 * swell();
  if (state.tool === "brush") {
    line(pen, tints[tissue], 1.4 * swell(), tissue === "erase" ? [5 * swell(), 4 * swell()] : [], () => pen.arc(x, y, r, 0, 2 * Math.PI));
  }
  write(pen, letters[tissue], x + r * 0.75 + 4, y - r * 0.75 - 2, "left", tints[tissue]);
}
