// What stands in the 3D view besides the server's surfaces, and how points get to the screen.
import { dot, minus, planeOf, toPlace } from "../geometry.js";

/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../state.js").Surface} Surface */
/** @typedef {{right: Triple, up: Triple, forward: Triple, centre: Triple, scale: number, middle: [number, number]}} Eye */

/** The eye looks at the patient from the front, turned about the head-feet axis, then lifted.
 * @param {number} turn @param {number} lift @param {Triple} centre @param {number} scale @param {[number, number]} middle @returns {Eye} */
export function eyeOf(turn, lift, centre, scale, middle) {
  const [s, c, sin, cos] = [Math.sin(turn), Math.cos(turn), Math.sin(lift), Math.cos(lift)];
  return { right: [c, s, 0], up: [-s * sin, c * sin, cos], forward: [-s * cos, c * cos, -sin], centre, scale, middle };
}

/** @param {Eye} eye @param {Float32Array} points @param {Float32Array|null} normals without: full light */
export function project({ right, up, forward, centre, scale, middle }, points, normals) {
  const count = points.length / 3;
  const [x, y, z, light] = [0, 0, 0, 0].map(() => new Float32Array(count));
  for (let n = 0, p = 0; n < count; n++, p += 3) {
    const [a, b, c] = [points[p] - centre[0], points[p + 1] - centre[1], points[p + 2] - centre[2]];
    x[n] = middle[0] + scale * (right[0] * a + right[1] * b + right[2] * c);
    y[n] = middle[1] - scale * (up[0] * a + up[1] * b + up[2] * c);
    z[n] = forward[0] * a + forward[1] * b + forward[2] * c;
    // Both sides are lit: a surface may be open, or wound either way.
    const facing = normals ? Math.abs(forward[0] * normals[p] + forward[1] * normals[p + 1] + forward[2] * normals[p + 2]) : 1;
    light[n] = 255 * (0.18 + 0.82 * facing);
  }
  return { x, y, z, light };
}

/** The place of a pixel at a depth. @param {Eye} eye @param {number} x @param {number} y @param {number} depth @returns {Triple} */
export function unproject({ right, up, forward, centre, scale, middle }, x, y, depth) {
  const [across, above] = [(x - middle[0]) / scale, (middle[1] - y) / scale];
  return /** @type {Triple} */ (centre.map((c, a) => c + across * right[a] + above * up[a] + depth * forward[a]));
}

/** @type {WeakMap<Surface, Float32Array>} */
const kept = new WeakMap();

/** Normals of points, weighted by the areas of their triangles. @param {Surface} surface */
export function normalsOf(surface) {
  const before = kept.get(surface);
  if (before) return before;
  const { points, triangles } = surface;
  const normals = new Float32Array(points.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const [ux, uy, uz] = [points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]];
    const [vx, vy, vz] = [points[c] - points[a], points[c + 1] - points[a + 1], points[c + 2] - points[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const p of [a, b, c]) {
      normals[p] += x;
      normals[p + 1] += y;
      normals[p + 2] += z;
    }
  }
  for (let p = 0; p < normals.length; p += 3) {
    const size = Math.hypot(normals[p], normals[p + 1], normals[p + 2]) || 1;
    normals[p] /= size;
    normals[p + 1] /= size;
    normals[p + 2] /= size;
  }
  kept.set(surface, normals);
  return normals;
}

const around = 24;
/** @param {import("../state.js").Sphere} sphere @returns {Surface} */
export function ball({ centre_mm: [cx, cy, cz], radius_mm: r }) {
  const rings = around / 2;
  const points = [];
  const triangles = [];
  for (let i = 0; i <= rings; i++) {
    for (let j = 0; j < around; j++) {
      const [polar, azimuth] = [(Math.PI * i) / rings, (2 * Math.PI * j) / around];
      points.push(cx + r * Math.sin(polar) * Math.cos(azimuth), cy + r * Math.sin(polar) * Math.sin(azimuth), cz + r * Math.cos(polar));
      if (i === rings) continue;
      const [a, b] = [i * around + j, i * around + ((j + 1) % around)];
      triangles.push(a, b, a + around, b, b + around, a + around);
    }
  }
  return { key: "ball", points: new Float32Array(points), triangles: new Uint32Array(triangles) };
}

/** The frame of a slice in the volume. @param {import("../geometry.js").Grid} grid
 * @param {import("../geometry.js").View} view @param {number} slice */
export function sliceFrame(grid, view, slice) {
  const { width, height } = planeOf(grid, view);
  const corners = [[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]].map(([i, j]) => {
    /** @type {Triple} */
    const voxel = [0, 0, 0];
    voxel[view.normal] = slice;
    voxel[view.right.axis] = i;
    voxel[view.down.axis] = j;
    return toPlace(grid, voxel);
  });
  return { points: new Float32Array(corners.flat()), pairs: [0, 1, 1, 2, 2, 3, 3, 0] };
}

/** @type {WeakMap<Surface, {low: number[], high: number[]}>} */
const boxes = new WeakMap();

/** @param {Surface} surface */
function boxOf(surface) {
  const before = boxes.get(surface);
  if (before) return before;
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  const { points } = surface;
  for (let p = 0; p < points.length; p++) {
    low[p % 3] = Math.min(low[p % 3], points[p]);
    high[p % 3] = Math.max(high[p % 3], points[p]);
  }
  boxes.set(surface, { low, high });
  return { low, high };
}

/** Centre and half the size of what the surfaces span. @param {Surface[]} surfaces @returns {{centre: Triple, reach: number}|null} */
export function spanOf(surfaces) {
  const boxesOf = surfaces.filter(({ points }) => points.length > 0).map(boxOf);
  if (boxesOf.length === 0) return null;
  const low = [0, 1, 2].map((a) => Math.min(...boxesOf.map((box) => box.low[a])));
  const high = [0, 1, 2].map((a) => Math.max(...boxesOf.map((box) => box.high[a])));
  const half = /** @type {Triple} */ (minus(/** @type {Triple} */ (high), /** @type {Triple} */ (low)).map((x) => x / 2));
  return { centre: /** @type {Triple} */ (low.map((x, a) => x + half[a])), reach: Math.sqrt(dot(half, half)) };
}
