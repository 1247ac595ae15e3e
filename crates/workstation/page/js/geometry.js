// Voxels, millimetres and planes. A place is LPS in mm; a voxel is (i, j, k); a plane's pixel (x, y) is a voxel of the plane
// and whole numbers are voxel centres. Which grid axis runs where is told by the server's views.

/** @typedef {[number, number, number]} Triple */
/** @typedef {[number, number]} Pair */
/** @typedef {{size: Triple, spacing_mm: Triple, origin_mm: Triple, axes: [Triple, Triple, Triple]}} Grid */
/** @typedef {import("../../types/server.d.ts").AxisShown} Way */
/** @typedef {import("../../types/server.d.ts").ViewShown} View */
/** @typedef {{width: number, height: number, across: number, along: number}} Plane pixels and mm a pixel */
/** @typedef {{left: number, top: number, scale: number}} Frame where the plane's corner lies in its pane, and CSS pixels a mm */

/** @param {Triple} a @param {Triple} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {Triple} a @param {Triple} b @returns {Triple} */
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @param {Triple} a @param {Triple} b @param {number} t @returns {Triple} a + t b */
export const along = (a, b, t) => [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]];
/** @param {Triple} a */
export const length = (a) => Math.sqrt(dot(a, a));
/** @param {number} x @param {number} low @param {number} high */
export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

/** @param {Grid} grid @param {Triple} voxel @returns {Triple} */
export function toPlace(grid, voxel) {
  return voxel.reduce((p, index, a) => along(p, grid.axes[a], index * grid.spacing_mm[a]), grid.origin_mm);
}

/** @param {Grid} grid @param {Triple} place @returns {Triple} not rounded */
export function toVoxel(grid, place) {
  const d = minus(place, grid.origin_mm);
  return /** @type {Triple} */ (grid.axes.map((axis, a) => dot(axis, d) / grid.spacing_mm[a]));
}

/** The voxel that holds the place, or the nearest one of the grid. @param {Grid} grid @param {Triple} place @returns {Triple} */
export function nearest(grid, place) {
  return /** @type {Triple} */ (toVoxel(grid, place).map((x, a) => clamp(Math.round(x), 0, grid.size[a] - 1)));
}

/** @param {Grid} grid @param {Triple} place */
export function inside(grid, place) {
  return toVoxel(grid, place).every((x, a) => x >= -0.5 && x < grid.size[a] - 0.5);
}

/** @param {Grid} grid @param {Triple} voxel */
export const voxelAt = (grid, voxel) => voxel[0] + grid.size[0] * (voxel[1] + grid.size[1] * voxel[2]);

/** @param {Grid} a @param {Grid} b */
export function sameGrid(a, b) {
  const near = (/** @type {number[]} */ p, /** @type {number[]} */ q) => p.every((x, n) => Math.abs(x - q[n]) < 1e-3);
  return near(a.size, b.size) && near(a.spacing_mm, b.spacing_mm) && near(a.origin_mm, b.origin_mm)
    && a.axes.every((axis, n) => near(axis, b.axes[n]));
}

/** @param {Grid} grid @param {View} view @returns {Plane} */
export function planeOf(grid, view) {
  return {
    width: grid.size[view.right.axis], height: grid.size[view.down.axis],
    across: grid.spacing_mm[view.right.axis], along: grid.spacing_mm[view.down.axis],
  };
}

/** @param {Grid} grid @param {Way} way @param {number} x voxel index to plane pixel, or back */
const turned = (grid, way, x) => (way.flip ? grid.size[way.axis] - 1 - x : x);

/** @param {Grid} grid @param {View} view @param {Triple} place @returns {Pair} */
export function toPlane(grid, view, place) {
  const voxel = toVoxel(grid, place);
  return [turned(grid, view.right, voxel[view.right.axis]), turned(grid, view.down, voxel[view.down.axis])];
}

/** @param {Grid} grid @param {View} view @param {Pair} pixel @param {number} slice @returns {Triple} */
export function fromPlane(grid, view, [x, y], slice) {
  /** @type {Triple} */
  const voxel = [0, 0, 0];
  voxel[view.normal] = slice;
  voxel[view.right.axis] = turned(grid, view.right, x);
  voxel[view.down.axis] = turned(grid, view.down, y);
  return toPlace(grid, voxel);
}

/** Where the plane's first pixel lies in the volume, and the way to the next on the right and below.
 * @param {Grid} grid @param {View} view @param {number} slice */
export function walk(grid, view, slice) {
  const strides = [1, grid.size[0], grid.size[0] * grid.size[1]];
  const start = (/** @type {Way} */ way) => (way.flip ? (grid.size[way.axis] - 1) * strides[way.axis] : 0);
  const step = (/** @type {Way} */ way) => (way.flip ? -strides[way.axis] : strides[way.axis]);
  return {
    start: slice * strides[view.normal] + start(view.right) + start(view.down),
    right: step(view.right), down: step(view.down),
  };
}

/** The patient axis (0 left, 1 posterior, 2 superior) nearest to a grid axis, and whether both point the same way.
 * @param {Grid} grid @param {number} axis */
export function patientAxis(grid, axis) {
  const v = grid.axes[axis];
  const n = [0, 1, 2].reduce((best, a) => (Math.abs(v[a]) > Math.abs(v[best]) ? a : best), 0);
  return { n, sign: v[n] < 0 ? -1 : 1 };
}

/** @param {Plane} plane @param {{zoom: number, middle: Pair}} camera @param {Pair} box @returns {Frame} */
export function frameOf(plane, camera, box) {
  const [wide, high] = [plane.width * plane.across, plane.height * plane.along];
  const scale = Math.min(box[0] / wide, box[1] / high) * 0.98 * camera.zoom;
  return {
    scale,
    left: box[0] / 2 - camera.middle[0] * wide * scale,
    top: box[1] / 2 - camera.middle[1] * high * scale,
  };
}

/** @param {Plane} plane @param {Frame} frame @param {Pair} pixel @returns {Pair} */
export function toScreen(plane, frame, [x, y]) {
  return [frame.left + (x + 0.5) * plane.across * frame.scale, frame.top + (y + 0.5) * plane.along * frame.scale];
}

/** @param {Plane} plane @param {Frame} frame @param {Pair} at @returns {Pair} */
export function fromScreen(plane, frame, [x, y]) {
  return [(x - frame.left) / (plane.across * frame.scale) - 0.5, (y - frame.top) / (plane.along * frame.scale) - 0.5];
}
