// A rasteriser in plain JavaScript: hospital desktops often have no graphics card, and browsers then no WebGL. It fills
// layers of depth, light and id, each within the box of what is there.

/** @typedef {{left: number, top: number, right: number, bottom: number}} Box pixels, the last ones not in it */
/** @typedef {{width: number, height: number, depth: Float32Array, light: Uint8Array, id: Uint32Array, box: Box,
 *   facing: Uint8Array|null}} Layer
 *   `id`: part in the upper 8 bits, counted from 1, triangle below; 0 where nothing is; `box`: nothing is outside;
 *   `facing`: how much the surface faces the eye, of a layer that is seen through */
/** @typedef {{x: Float32Array, y: Float32Array, z: Float32Array, light: Float32Array, facing?: Float32Array}} Projected points in
 *   pixels and depth */

const far = 1e9;
/** @returns {Box} */
export const emptyBox = () => ({ left: 1e9, top: 1e9, right: 0, bottom: 0 });

/** @param {number} width @param {number} height @param {boolean} veil is seen through @returns {Layer} */
export function makeLayer(width, height, veil) {
  const n = width * height;
  return { width, height, depth: new Float32Array(n).fill(far), light: new Uint8Array(n), id: new Uint32Array(n), box: emptyBox(),
    facing: veil ? new Uint8Array(n) : null };
}

/** @param {Box} box @param {Box} other */
export function growBox(box, other) {
  box.left = Math.min(box.left, other.left);
  box.top = Math.min(box.top, other.top);
  box.right = Math.max(box.right, other.right);
  box.bottom = Math.max(box.bottom, other.bottom);
}

/** The layer's box grows by these points and what is drawn around each. @param {Layer} layer @param {Projected} points @param {number} around */
function cover({ box, width, height }, { x, y }, around) {
  const reach = { left: 1e9, top: 1e9, right: -1e9, bottom: -1e9 };
  for (let n = 0; n < x.length; n++) {
    if (x[n] < reach.left) reach.left = x[n];
    if (x[n] > reach.right) reach.right = x[n];
    if (y[n] < reach.top) reach.top = y[n];
    if (y[n] > reach.bottom) reach.bottom = y[n];
  }
  growBox(box, {
    left: Math.max(0, Math.floor(reach.left - around)), top: Math.max(0, Math.floor(reach.top - around)),
    right: Math.min(width, Math.ceil(reach.right + around + 1)), bottom: Math.min(height, Math.ceil(reach.bottom + around + 1)),
  });
}

/** @param {Layer} layer */
export function clearLayer({ depth, id, width, box }) {
  for (let row = box.top; row < box.bottom; row++) {
    depth.fill(far, row * width + box.left, row * width + box.right);
    id.fill(0, row * width + box.left, row * width + box.right);
  }
  Object.assign(box, emptyBox());
}

/** @param {Layer} to is cleared before @param {Layer} from of the same size */
export function copyLayer(to, from) {
  clearLayer(to);
  const { width, box } = from;
  for (let row = box.top; row < box.bottom; row++) {
    const [start, end] = [row * width + box.left, row * width + box.right];
    if (end <= start) continue;
    to.depth.set(from.depth.subarray(start, end), start);
    to.light.set(from.light.subarray(start, end), start);
    to.id.set(from.id.subarray(start, end), start);
  }
  Object.assign(to.box, box);
}

/** @param {Layer} layer @param {Projected} points @param {Uint32Array} triangles @param {number} part
 * @param {number} [front] sign of the area of triangles that face the eye: the others are left out; 0 or none: all are drawn */
export function fillTriangles(layer, points, triangles, part, front = 0) {
  cover(layer, points, 0);
  const { x, y } = points;
  const right = layer.width - 1;
  const bottom = layer.height - 1;
  // No arrays and no spread in here: this runs for each triangle of each picture.
  for (let t = 0; t < triangles.length; t += 3) {
    const a = triangles[t];
    const b = triangles[t + 1];
    const c = triangles[t + 2];
    const ax = x[a], bx = x[b], cx = x[c];
    const left = Math.max(0, Math.ceil((ax < bx ? (ax < cx ? ax : cx) : (bx < cx ? bx : cx)) - 0.5));
    const last = Math.min(right, Math.floor((ax > bx ? (ax > cx ? ax : cx) : (bx > cx ? bx : cx)) - 0.5));
    if (left > last) continue;
    const ay = y[a], by = y[b], cy = y[c];
    const top = Math.max(0, Math.ceil((ay < by ? (ay < cy ? ay : cy) : (by < cy ? by : cy)) - 0.5));
    const lowest = Math.min(bottom, Math.floor((ay > by ? (ay > cy ? ay : cy) : (by > cy ? by : cy)) - 0.5));
    if (top > lowest) continue;
    const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    if (area === 0 || area * front < 0) continue;
    fillOne(layer, points, a, b, c, area, left, top, last, lowest, ((part << 24) | (t / 3)) >>> 0);
  }
}

/** One triangle within its box; depth and light run linearly over it.
 * @param {Layer} layer @param {Projected} points @param {number} a @param {number} b @param {number} c @param {number} area
 * @param {number} left @param {number} top @param {number} last @param {number} lowest @param {number} id */
function fillOne(layer, points, a, b, c, area, left, top, last, lowest, id) {
  const { x, y, z, light } = points;
  const { width, depth: depths, light: lights, id: ids, facing: facings } = layer;
  const facing = points.facing ?? light;
  const acrossC = (y[c] - y[a]) / area;
  const acrossB = (y[b] - y[a]) / area;
  const downC = (x[c] - x[a]) / area;
  const downB = (x[b] - x[a]) / area;
  const z0 = z[a], zB = z[b] - z0, zC = z[c] - z0;
  const light0 = light[a], lightB = light[b] - light0, lightC = light[c] - light0;
  const facing0 = facing[a], facingB = facing[b] - facing0, facingC = facing[c] - facing0;
  for (let row = top; row <= lowest; row++) {
    const dx = left + 0.5 - x[a];
    const dy = row + 0.5 - y[a];
    let shareB = dx * acrossC - dy * downC;
    let shareC = downB * dy - acrossB * dx;
    for (let n = row * width + left, end = n + last - left; n <= end; n++, shareB += acrossC, shareC -= acrossB) {
      if (shareB < 0 || shareC < 0 || shareB + shareC > 1) continue;
      const depth = z0 + shareB * zB + shareC * zC;
      if (depth >= depths[n]) continue;
      depths[n] = depth;
      lights[n] = light0 + shareB * lightB + shareC * lightC;
      ids[n] = id;
      if (facings) facings[n] = facing0 + shareB * facingB + shareC * facingC;
    }
  }
}

/** @param {Layer} layer @param {number} px @param {number} py @param {number} depth @param {number} light @param {number} part */
function put({ width, height, depth: depths, light: lights, id }, px, py, depth, light, part) {
  const n = py * width + px;
  if (px < 0 || py < 0 || px >= width || py >= height || depth >= depths[n]) return;
  depths[n] = depth;
  lights[n] = light;
  id[n] = (part << 24) >>> 0;
}

/** Lines between pairs of points, tested for depth; `nearer` lets lines on a surface win over it.
 * @param {Layer} layer @param {Projected} points of which `light` gives each line's, at its first point
 * @param {ArrayLike<number>} pairs @param {number} part @param {number} thick pixels @param {number} nearer mm */
export function drawLines(layer, points, pairs, part, thick, nearer) {
  cover(layer, points, thick);
  const { x, y, z, light } = points;
  for (let p = 0; p < pairs.length; p += 2) {
    const [a, b] = [pairs[p], pairs[p + 1]];
    const steps = Math.min(8192, Math.max(1, Math.ceil(Math.max(Math.abs(x[b] - x[a]), Math.abs(y[b] - y[a])))));
    for (let s = 0; s <= steps; s++) {
      const t = s / steps;
      const [px, py] = [Math.floor(x[a] + t * (x[b] - x[a])), Math.floor(y[a] + t * (y[b] - y[a]))];
      const depth = z[a] + t * (z[b] - z[a]) - nearer;
      for (let i = 0; i < thick; i++) for (let j = 0; j < thick; j++) put(layer, px + i, py + j, depth, light[a], part);
    }
  }
}

/** A square for each point, tested for depth. @param {Layer} layer @param {Projected} points @param {number} part
 * @param {number} thick pixels @param {number} nearer mm */
export function drawDots(layer, points, part, thick, nearer) {
  cover(layer, points, thick);
  const { x, y, z, light } = points;
  for (let n = 0; n < x.length; n++) {
    const [px, py] = [Math.floor(x[n] - thick / 2 + 0.5), Math.floor(y[n] - thick / 2 + 0.5)];
    // Near by a dot is large, and most of them are outside.
    if (px <= -thick || py <= -thick || px >= layer.width || py >= layer.height) continue;
    for (let i = 0; i < thick; i++) for (let j = 0; j < thick; j++) put(layer, px + i, py + j, z[n] - nearer, light[n], part);
  }
}
