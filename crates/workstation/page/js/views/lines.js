// Outlines of labels in a plane, by marching squares, joined to lines and kept.
import { planeOf, walk } from "../geometry.js";

/** @typedef {import("../state.js").Held} Held */
/** @typedef {import("../geometry.js").View} View */

// Of a cell of four voxels: top, right, bottom, left side; from and to for each set of corners within, which stay on the left.
const [T, R, B, L] = [0, 1, 2, 3];
const crossings = [[], [L, T], [T, R], [L, R], [R, B], [L, T, R, B], [T, B], [L, B], [B, L], [B, T], [T, R, B, L], [B, R],
  [R, L], [R, T], [T, L], []];

/** The labels of a plane. @param {Held} labels @param {View} view @param {number} slice */
function planeLabels(labels, view, slice) {
  const { width, height } = planeOf(labels.grid, view);
  const { start, right, down } = walk(labels.grid, view, slice);
  const plane = new Uint8Array(width * height);
  let n = 0;
  for (let y = 0; y < height; y++) {
    for (let x = 0, from = start + y * down; x < width; x++, n++, from += right) plane[n] = labels.voxels[from];
  }
  return { plane, width, height };
}

/** For each crossed side the side where the line leaves the cell; the sides above and left of voxel n are 2 n and 2 n + 1.
 * @param {Uint8Array} plane @param {Uint8Array} within by label: one within, else nothing
 * @param {number} width @param {number} height */
function sides(plane, within, width, height) {
  /** @type {Map<number, number>} */
  const next = new Map();
  const entered = new Set();
  for (let y = 0; y + 1 < height; y++) {
    let n = y * width;
    let left = within[plane[n]] | (within[plane[n + width]] << 3);
    for (const end = n + width - 1; n < end; n++) {
      const above = within[plane[n + 1]];
      const below = within[plane[n + width + 1]];
      const which = left | (above << 1) | (below << 2);
      left = above | (below << 3);
      if (which === 0 || which === 15) continue;
      const side = [2 * n, 2 * (n + 1) + 1, 2 * (n + width), 2 * n + 1];
      const ends = crossings[which];
      for (let e = 0; e < ends.length; e += 2) {
        next.set(side[ends[e]], side[ends[e + 1]]);
        entered.add(side[ends[e + 1]]);
      }
    }
  }
  // Lines that end at the picture's edge are followed from their beginning; rings from anywhere.
  const from = [...next.keys()];
  return { next, from: [...from.filter((side) => !entered.has(side)), ...from] };
}

/**
 * Lines of plane pixels, x and y in turn, without points on a straight.
 * @param {Uint8Array} plane @param {Uint8Array} within @param {number} width @param {number} height @returns {number[][]}
 */
export function outlines(plane, within, width, height) {
  const { next, from } = sides(plane, within, width, height);
  const spot = (/** @type {number} */ side) => {
    const n = side >> 1;
    const [x, y] = [n % width, Math.floor(n / width)];
    return side % 2 ? [x, y + 0.5] : [x + 0.5, y];
  };
  /** @type {number[][]} */
  const lines = [];
  for (const first of from) {
    let side = next.get(first);
    if (side === undefined) continue;
    next.delete(first);
    const line = spot(first);
    while (side !== undefined) {
      extend(line, spot(side));
      const to = next.get(side);
      next.delete(side);
      side = to;
    }
    lines.push(line);
  }
  return lines;
}

/** @param {number[]} line @param {number[]} spot */
function extend(line, [x, y]) {
  const last = line.length;
  const straight = last >= 4 && (line[last - 2] - line[last - 4]) * (y - line[last - 1])
    === (line[last - 1] - line[last - 3]) * (x - line[last - 2]);
  if (straight) line.length -= 2;
  line.push(x, y);
}

/** @param {number} label 0: any, whose outline is the skin */
function within(label) {
  const table = new Uint8Array(256);
  if (label === 0) table.fill(1, 1);
  else table[label] = 1;
  return table;
}

/** @type {Map<string, Map<number, Path2D>>} */
const kept = new Map();
const most = 64;

/**
 * The outlines of labels in mm of the plane, from its corner.
 * @param {Held} labels @param {View} view @param {number} slice @param {number[]} wanted labels; 0: any
 */
export function outlinePaths(labels, view, slice, wanted) {
  const key = `${labels.key} ${labels.arrived} ${view.name} ${slice} ${wanted}`;
  const before = kept.get(key);
  if (before) return before;
  const { plane, width, height } = planeLabels(labels, view, slice);
  const { across, along } = planeOf(labels.grid, view);
  const paths = new Map(wanted.map((label) => {
    const path = new Path2D();
    for (const line of outlines(plane, within(label), width, height)) {
      path.moveTo((line[0] + 0.5) * across, (line[1] + 0.5) * along);
      for (let n = 2; n < line.length; n += 2) path.lineTo((line[n] + 0.5) * across, (line[n + 1] + 0.5) * along);
    }
    return [label, path];
  }));
  kept.set(key, paths);
  // A map keeps its order: the first key is the oldest.
  if (kept.size > most) kept.delete(/** @type {string} */ (kept.keys().next().value));
  return paths;
}
