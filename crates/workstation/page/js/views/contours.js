// Draws the server's lines of a plane: each kind has its own stroke, so that colour is never the only sign.
import { planeOf } from "../geometry.js";
import { legendOf } from "./own.js";
import { colours, letter, stroke, swell, write } from "./pen.js";

/** @typedef {import("../planes.js").Line} Line */
/** @typedef {import("./pane.js").Pane} Pane */
/** @typedef {import("../state.js").State} State */
/** @typedef {CanvasRenderingContext2D} Pen */
/** @typedef {{name: string, path: Path2D, runs: number[][]}} Traced in mm of the plane, from its corner; x and y in turn */

export const cut = "#a6a6ff";

/** @type {WeakMap<Line[], Traced[]>} */
const traced = new WeakMap();

/** @param {Line[]} lines @param {Pane} pane @returns {Traced[]} */
function trace(lines, { held, view }) {
  const before = traced.get(lines);
  if (before) return before;
  const { across, along } = planeOf(held.grid, view);
  const mm = (/** @type {import("../geometry.js").Way} */ { axis, flip }, /** @type {number} */ size) => {
    const last = held.grid.size[axis] - 1;
    return (/** @type {number} */ x) => ((flip ? last - x : x) + 0.5) * size;
  };
  const [toX, toY] = [mm(view.right, across), mm(view.down, along)];
  const made = lines.map(({ name, points }) => {
    const runs = points.filter((run) => run.length > 1).map((run) => run.flatMap(([x, y]) => [toX(x), toY(y)]));
    const path = new Path2D();
    for (const run of runs) {
      path.moveTo(run[0], run[1]);
      for (let n = 2; n < run.length; n += 2) path.lineTo(run[n], run[n + 1]);
    }
    return { name, path, runs };
  });
  traced.set(lines, made);
  return made;
}

/** A band with strokes across it: uncertain wherever it lies. @param {Pen} pen @param {Path2D} path @param {number} px mm a CSS pixel */
function drawBand(pen, path, px) {
  pen.lineWidth = 9 * px;
  pen.lineCap = "butt";
  pen.strokeStyle = "rgba(255, 255, 255, 0.22)";
  pen.stroke(path);
  pen.setLineDash([1.2 * px, 3.8 * px]);
  pen.strokeStyle = "rgba(255, 255, 255, 0.75)";
  pen.stroke(path);
  pen.setLineDash([]);
}

/** @type {Record<string, {colour: string, width: number, dashes: number[]}>} */
const strokes = {
  "chest wall": { colour: colours.wall, width: 1.5, dashes: [] },
  skin: { colour: colours.skin, width: 1.5, dashes: [6, 4] },
  cut: { colour: cut, width: 1.6, dashes: [1.6, 3.4] },
  tumour: { colour: colours.tumour, width: 1.8, dashes: [] },
};

/** The lines of the patient's own structures and doses; one that no legend has is drawn all the same.
 * @param {State} state @param {Traced[]} all */
function namedOf({ server }, all) {
  const { structures, isodoses } = legendOf(server?.own ?? null);
  const legend = [...structures, ...isodoses];
  return all.filter(({ name }) => /^(structure|isodose): /.test(name)).map((one) => {
    const n = legend.findIndex(({ name }) => name === one.name);
    return { ...one, n: Math.max(n, 0), ...(legend[n] ?? { text: one.name, colour: colours.text, dashes: [] }) };
  });
}

/** Where the word of a named line stands: on its longest run, elsewhere for each name, and along it.
 * @param {Pane} pane @param {number[][]} runs @param {number} n of the name
 * @param {number} wide CSS pixels of the word @returns {{x: number, y: number, turn: number}|null} */
function wordPlace({ box, frame: { left, top, scale } }, runs, n, wide) {
  const seen = runs.map((run) => {
    const shown = [];
    for (let k = 0; k < run.length; k += 2) {
      const [x, y] = [left + run[k] * scale, top + run[k + 1] * scale];
      if (x > 30 && y > 30 && x < box[0] - 30 && y < box[1] - 30) shown.push([x, y]);
    }
    return shown;
  });
  const longest = seen.reduce((best, run) => (run.length > best.length ? run : best), []);
  // A short line bears no word: it would hide what it names.
  const far = longest.reduce((sum, [x, y], k) => sum + (k ? Math.hypot(x - longest[k - 1][0], y - longest[k - 1][1]) : 0), 0);
  if (longest.length < 2 || far < 3.5 * wide) return null;
  const at = Math.floor((longest.length - 1) * (0.15 + 0.618 * n) % (longest.length - 1));
  const [from, to] = [longest[Math.max(0, at - 3)], longest[Math.min(longest.length - 1, at + 3)]];
  const turn = Math.atan2(to[1] - from[1], to[0] - from[0]);
  return { x: longest[at][0], y: longest[at][1], turn: Math.abs(turn) > Math.PI / 2 ? turn + Math.PI : turn };
}

/** @param {Pen} pen @param {string} word @param {{x: number, y: number, turn: number}} place @param {string} colour */
function writeAlong(pen, word, { x, y, turn }, colour) {
  pen.save();
  pen.translate(x, y);
  pen.rotate(turn);
  write(pen, word, 0, letter() * 0.3, "center", colour);
  pen.restore();
}

/** The tumour's letter beside its outline, above on the right. @param {Pen} pen @param {Pane} pane @param {number[][]} runs */
function writeTumour(pen, { frame: { left, top, scale } }, runs) {
  const all = runs.flat();
  if (all.length === 0) return;
  const [xs, ys] = [all.filter((_, n) => n % 2 === 0), all.filter((_, n) => n % 2 === 1)];
  write(pen, "T", left + Math.max(...xs) * scale + 4, top + Math.min(...ys) * scale + 2, "left", colours.tumour);
}

/** What is drawn: in the CT the tumour is the case's own sphere, which follows a drag.
 * @param {State} state @param {Pane} pane @param {Traced[]} all */
const wanted = (state, pane, all) => all.filter(({ name }) => !state.hiddenLines.includes(name)
  && (name === "mesh" ? state.section : name !== "tumour" || pane.held.grid.simulated));

/** @param {Pen} pen @param {State} state @param {Pane} pane @param {Line[]} lines @param {number} fine device pixels a CSS pixel */
export function drawContours(pen, state, pane, lines, fine) {
  const { left, top, scale } = pane.frame;
  const all = wanted(state, pane, trace(lines, pane));
  const named = namedOf(state, all);
  const px = swell() / scale;
  pen.save();
  // The paths are in mm: widths and dashes are divided by the scale.
  pen.setTransform(scale * fine, 0, 0, scale * fine, left * fine, top * fine);
  for (const { path } of all.filter((one) => one.name === "uncertain")) drawBand(pen, path, px);
  for (const { path } of all.filter((one) => one.name === "mesh")) {
    pen.lineWidth = 0.8 * px;
    pen.strokeStyle = "rgba(200, 206, 214, 0.7)";
    pen.stroke(path);
  }
  for (const { path, colour, dashes } of named) stroke(pen, colour, px, dashes.map((x) => x * px), path);
  for (const { name, path } of all) {
    const how = strokes[name];
    if (how) stroke(pen, how.colour, how.width * px, how.dashes.map((x) => x * px), path);
  }
  pen.restore();
  pen.font = `${letter() * 0.84}px system-ui, sans-serif`;
  /** @type {{x: number, y: number, wide: number}[]} */
  const written = [];
  for (const { text, runs, n, colour } of named) {
    const wide = pen.measureText(text).width;
    const place = wordPlace(pane, runs, n, wide);
    const free = place && written.every((one) => Math.hypot(one.x - place.x, one.y - place.y) > (one.wide + wide) / 2);
    if (!place || !free) continue;
    writeAlong(pen, text, place, colour);
    written.push({ ...place, wide });
  }
  for (const { runs } of all.filter((one) => one.name === "tumour")) writeTumour(pen, pane, runs);
}
