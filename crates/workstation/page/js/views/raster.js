// A rasteriser in plain JavaScript: hospital desktops often have no graphics card, and browsers then no WebGL. It fills
// layers of depth, light and id; a layer that is seen through is blended over one that is not.

/** @typedef {{width: number, height: number, depth: Float32Array, light: Uint8Array, id: Uint32Array}} Layer
 *   `id`: part in the upper 8 bits, counted from 1, triangle below; 0 where nothing is */
/** @typedef {{x: Float32Array, y: Float32Array, z: Float32Array, light: Float32Array}} Projected points in pixels and depth */

const far = 1e9;

/** @param {number} width @param {number} height @returns {Layer} */
export function makeLayer(width, height) {
  const n = width * height;
  return { width, height, depth: new Float32Array(n).fill(far), light: new Uint8Array(n), id: new Uint32Array(n) };
}

/** @param {Layer} layer */
export function clearLayer({ depth, id }) {
  depth.fill(far);
  id.fill(0);
}

/** @param {Layer} to @param {Layer} from of the same size */
export function copyLayer(to, from) {
  to.depth.set(from.depth);
  to.light.set(from.light);
  to.id.set(from.id);
}

/** @param {Layer} layer @param {Projected} points @param {Uint32Array} triangles @param {number} part */
export function fillTriangles(layer, points, triangles, part) {
  const { x, y } = points;
  const [right, bottom] = [layer.width - 1, layer.height - 1];
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [triangles[t], triangles[t + 1], triangles[t + 2]];
    const area = (x[b] - x[a]) * (y[c] - y[a]) - (y[b] - y[a]) * (x[c] - x[a]);
    const left = Math.max(0, Math.ceil(Math.min(x[a], x[b], x[c]) - 0.5));
    const top = Math.max(0, Math.ceil(Math.min(y[a], y[b], y[c]) - 0.5));
    const last = Math.min(right, Math.floor(Math.max(x[a], x[b], x[c]) - 0.5));
    const lowest = Math.min(bottom, Math.floor(Math.max(y[a], y[b], y[c]) - 0.5));
    if (area === 0 || left > last || top > lowest) continue;
    fillOne(layer, points, a, b, c, area, left, top, last, lowest, ((part << 24) | (t / 3)) >>> 0);
  }
}

/** One triangle within its box; depth and light run linearly over it.
 * @param {Layer} layer @param {Projected} points @param {number} a @param {number} b @param {number} c @param {number} area
 * @param {number} left @param {number} top @param {number} last @param {number} lowest @param {number} id */
function fillOne(layer, { x, y, z, light }, a, b, c, area, left, top, last, lowest, id) {
  const [toB, toC] = [z[b] - z[a], z[c] - z[a]];
  const [lightB, lightC] = [light[b] - light[a], light[c] - light[a]];
  const [stepB, stepC] = [(y[c] - y[a]) / area, -(y[b] - y[a]) / area];
  for (let row = top; row <= lowest; row++) {
    const [dx, dy] = [left + 0.5 - x[a], row + 0.5 - y[a]];
    let shareB = (dx * (y[c] - y[a]) - dy * (x[c] - x[a])) / area;
    let shareC = ((x[b] - x[a]) * dy - (y[b] - y[a]) * dx) / area;
    for (let n = row * layer.width + left, end = n + last - left; n <= end; n++, shareB += stepB, shareC += stepC) {
      if (shareB < 0 || shareC < 0 || shareB + shareC > 1) continue;
      const depth = z[a] + shareB * toB + shareC * toC;
      if (depth >= layer.depth[n]) continue;
      layer.depth[n] = depth;
      layer.light[n] = light[a] + shareB * lightB + shareC * lightC;
      layer.id[n] = id;
    }
  }
}

/** Lines between pairs of points, tested for depth; `nearer` lets lines on a surface win over it.
 * @param {Layer} layer @param {Projected} points @param {ArrayLike<number>} pairs @param {number} part
 * @param {number} thick pixels @param {number} nearer mm */
export function drawLines(layer, { x, y, z }, pairs, part, thick, nearer) {
  const { width, height } = layer;
  const put = (/** @type {number} */ px, /** @type {number} */ py, /** @type {number} */ depth) => {
    const n = py * width + px;
    if (px < 0 || py < 0 || px >= width || py >= height || depth >= layer.depth[n]) return;
    layer.depth[n] = depth;
    layer.light[n] = 255;
    layer.id[n] = (part << 24) >>> 0;
  };
  for (let p = 0; p < pairs.length; p += 2) {
    const [a, b] = [pairs[p], pairs[p + 1]];
    const steps = Math.min(8192, Math.max(1, Math.ceil(Math.max(Math.abs(x[b] - x[a]), Math.abs(y[b] - y[a])))));
    for (let s = 0; s <= steps; s++) {
      const t = s / steps;
      const [px, py] = [Math.floor(x[a] + t * (x[b] - x[a])), Math.floor(y[a] + t * (y[b] - y[a]))];
      const depth = z[a] + t * (z[b] - z[a]) - nearer;
      for (let i = 0; i < thick; i++) for (let j = 0; j < thick; j++) put(px + i, py + j, depth);
    }
  }
}

/** Pixels by part and light. @param {[number, number, number][]} colours by part @param {[number, number, number]} ground part 0 */
export function shadeTable(colours, ground) {
  const table = new Uint32Array(256 * colours.length);
  colours.forEach((colour, part) => {
    for (let light = 0; light < 256; light++) {
      const [r, g, b] = part === 0 ? ground : colour.map((x) => (x * light) / 255);
      table[(part << 8) | light] = 0xff000000 | (b << 16) | (g << 8) | r;
    }
  });
  return table;
}

/** How much a veil hides, of 256: more at its rim, which shows its shape. @param {number} light */
const share = (light) => 120 + ((110 * (255 - light)) >> 8);

/**
 * The picture of both layers.
 * @param {Uint32Array} pixels @param {Layer} solid @param {Layer} veil seen through
 * @param {Uint32Array} shades @param {[number, number, number][]} colours by part
 */
export function compose(pixels, solid, veil, shades, colours) {
  for (let n = 0; n < pixels.length; n++) {
    const part = solid.id[n] >>> 24;
    const under = shades[(part << 8) | solid.light[n]];
    const over = veil.id[n] >>> 24;
    if (over === 0 || veil.depth[n] >= solid.depth[n]) {
      pixels[n] = under;
      continue;
    }
    const light = veil.light[n];
    const part256 = share(light);
    const bright = 115 + ((140 * light) >> 8);
    const colour = colours[over];
    const [r, g, b] = [under & 0xff, (under >> 8) & 0xff, (under >> 16) & 0xff];
    const red = r + ((((colour[0] * bright) >> 8) - r) * part256 >> 8);
    const green = g + ((((colour[1] * bright) >> 8) - g) * part256 >> 8);
    const blue = b + ((((colour[2] * bright) >> 8) - b) * part256 >> 8);
    pixels[n] = 0xff000000 | (blue << 16) | (green << 8) | red;
  }
}
