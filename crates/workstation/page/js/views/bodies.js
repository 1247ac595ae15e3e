// What stands in the 3D view besides the server's surfaces, and how points get to the screen.
import { clamp, dot, minus, toPlace, toVoxel } from "../geometry.js";
import { shaftRings } from "./applicator.js";

/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../state.js").Surface} Surface */
/** @typedef {{right: Triple, up: Triple, forward: Triple, centre: Triple, scale: number, middle: [number, number]}} Eye */
/** @typedef {{centre: Triple, half: Triple, reach: number}} Span a box: its centre, half its sides, half its diagonal */

/** The eye looks at the patient from the front, turned about the head-feet axis, then lifted.
 * @param {number} turn @param {number} lift @param {Triple} centre @param {number} scale @param {[number, number]} middle @returns {Eye} */
export function eyeOf(turn, lift, centre, scale, middle) {
  const [s, c, sin, cos] = [Math.sin(turn), Math.cos(turn), Math.sin(lift), Math.cos(lift)];
  return { right: [c, s, 0], up: [-s * sin, c * sin, cos], forward: [-s * cos, c * cos, -sin], centre, scale, middle };
}

/** Points on the screen, all in full light. @param {Eye} eye @param {Float32Array} points @returns {import("./raster.js").Projected} */
export function project({ right, up, forward, centre, scale, middle }, points) {
  const count = points.length / 3;
  const [x, y, z] = [0, 0, 0].map(() => new Float32Array(count));
  for (let n = 0, p = 0; n < count; n++, p += 3) {
    const a = points[p] - centre[0];
    const b = points[p + 1] - centre[1];
    const c = points[p + 2] - centre[2];
    x[n] = middle[0] + scale * (right[0] * a + right[1] * b + right[2] * c);
    y[n] = middle[1] - scale * (up[0] * a + up[1] * b + up[2] * c);
    z[n] = forward[0] * a + forward[1] * b + forward[2] * c;
  }
  return { x, y, z, light: new Float32Array(count).fill(255) };
}

/** The light on each point and how much it faces the eye, 0 to 255. The light comes from above the eye's left shoulder: a
 * lamp at the eye would show no shape. Both sides are lit: a surface may be open, or wound either way.
 * @param {Eye} eye @param {Float32Array} normals */
export function lit({ right, up, forward }, normals) {
  const [lampX, lampY, lampZ] = right.map((x, a) => -0.42 * x + 0.48 * up[a] - 0.77 * forward[a]);
  const [aheadX, aheadY, aheadZ] = forward;
  const light = new Float32Array(normals.length / 3);
  const facing = new Float32Array(light.length);
  for (let n = 0, p = 0; n < light.length; n++, p += 3) {
    const a = normals[p];
    const b = normals[p + 1];
    const c = normals[p + 2];
    const ahead = aheadX * a + aheadY * b + aheadZ * c;
    const bright = lampX * a + lampY * b + lampZ * c;
    facing[n] = 255 * Math.abs(ahead);
    light[n] = 255 * (0.22 + 0.78 * Math.max(0, ahead > 0 ? -bright : bright));
  }
  return { light, facing };
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

/** @type {WeakMap<Surface, number>} */
const fronts = new WeakMap();

/** The sign on the screen of triangles that face the eye, of a closed surface: by the sign of the volume it holds.
 * @param {Surface} surface */
export function frontOf(surface) {
  const before = fronts.get(surface);
  if (before) return before;
  const { points, triangles } = surface;
  const corner = (/** @type {number} */ t) => [0, 1, 2].map((a) => points[3 * triangles[t] + a] - points[a]);
  let volume = 0;
  for (let t = 0; t < triangles.length; t += 3) {
    const [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = [corner(t), corner(t + 1), corner(t + 2)];
    volume += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
  }
  fronts.set(surface, volume < 0 ? 1 : -1);
  return volume < 0 ? 1 : -1;
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
  return { key: "ball", shape: "ct", kind: "triangles", values: new Float32Array(0), points: new Float32Array(points),
    triangles: new Uint32Array(triangles) };
}

/** A sphere on a shaft. @param {Triple} centre @param {Triple} axis @param {number} radius @param {number} shaft its radius @returns {Surface} */
export function applicatorBody(centre, axis, radius, shaft) {
  const sphere = ball({ centre_mm: centre, radius_mm: radius });
  const first = sphere.points.length / 3;
  const [low, high] = shaftRings(centre, axis, shaft, 0);
  const around = low.length;
  const walls = low.flatMap((_, n) => {
    const [a, b] = [first + n, first + ((n + 1) % around)];
    return [a, b, a + around, b, b + around, a + around];
  });
  // The end has points of its own: its edge is sharp.
  const cap = first + 2 * around;
  const end = high.slice(2).flatMap((_, n) => [cap, cap + n + 1, cap + n + 2]);
  return { ...sphere, key: "applicator", points: new Float32Array([...sphere.points, ...[...low, ...high, ...high].flat()]),
    triangles: new Uint32Array([...sphere.triangles, ...walls, ...end]) };
}

/** The frame of a slice, within a box of places or, without one, of the whole volume.
 * @param {import("../geometry.js").Grid} grid @param {import("../geometry.js").View} view @param {number} slice @param {Span|null} span */
export function sliceFrame(grid, view, slice, span) {
  const ends = [view.right.axis, view.down.axis].map((axis) => {
    const last = grid.size[axis] - 0.5;
    if (!span) return [-0.5, last];
    const at = toVoxel(grid, span.centre)[axis];
    const half = grid.axes[axis].reduce((sum, x, a) => sum + Math.abs(x) * (span.half[a] * 1.12 + 4), 0) / grid.spacing_mm[axis];
    return [clamp(at - half, -0.5, last), clamp(at + half, -0.5, last)];
  });
  const corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(([i, j]) => {
    /** @type {Triple} */
    const voxel = [0, 0, 0];
    voxel[view.normal] = slice;
    voxel[view.right.axis] = ends[0][i];
    voxel[view.down.axis] = ends[1][j];
    return toPlace(grid, voxel);
  });
  return { points: new Float32Array(corners.flat()), pairs: [0, 1, 1, 2, 2, 3, 3, 0] };
}

/** @type {WeakMap<Surface, number[]>} */
const edges = new WeakMap();

/** Pairs of points of each edge, once. @param {Surface} surface */
export function edgesOf(surface) {
  const before = edges.get(surface);
  if (before) return before;
  const { triangles, points } = surface;
  const seen = new Set();
  const count = points.length / 3;
  for (let t = 0; t < triangles.length; t++) {
    const [a, b] = [triangles[t], triangles[t % 3 === 2 ? t - 2 : t + 1]];
    seen.add(Math.min(a, b) * count + Math.max(a, b));
  }
  const pairs = [...seen].flatMap((both) => [Math.floor(both / count), both % count]);
  edges.set(surface, pairs);
  return pairs;
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

/** What the surfaces span. @param {Surface[]} surfaces @returns {Span|null} */
export function spanOf(surfaces) {
  const boxesOf = surfaces.filter(({ points }) => points.length > 0).map(boxOf);
  if (boxesOf.length === 0) return null;
  const low = [0, 1, 2].map((a) => Math.min(...boxesOf.map((box) => box.low[a])));
  const high = [0, 1, 2].map((a) => Math.max(...boxesOf.map((box) => box.high[a])));
  const half = /** @type {Triple} */ (minus(/** @type {Triple} */ (high), /** @type {Triple} */ (low)).map((x) => x / 2));
  return { centre: /** @type {Triple} */ (low.map((x, a) => x + half[a])), half, reach: Math.sqrt(dot(half, half)) };
}
