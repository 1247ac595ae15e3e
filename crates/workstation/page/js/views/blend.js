// The picture of the 3D view's layers: what is solid, over it what is seen through, the tumour's outline over all.
import { emptyBox, growBox } from "./raster.js";

/** @typedef {import("./raster.js").Layer} Layer */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {{colours: Uint32Array, shares: Uint8Array}} Veil pixels by light; how much of 255 is hidden, by how much
 *   it faces the eye */
/** @typedef {{solid: Layer, cut: Layer, skin: Layer, body: Layer, tumour: Layer}} Layers the three in the middle are veils */
/** @typedef {{shades: Uint32Array, cut: number, skin: Veil, body: Veil, tumour: number, ground: number}} Looks
 *   `shades`: pixels by part and light; `cut`, `tumour`, `ground`: pixels */

/** @param {number[]} rgb */
export const pixelOf = ([r, g, b]) => (0xff000000 | (b << 16) | (g << 8) | r) >>> 0;

/** How a veil looks: it hides more the more it turns away, as a glass does, which shows its shape.
 * @param {Triple} colour @param {number} least share hidden @param {number} most @param {number} power how narrow the rim is @returns {Veil} */
export function veilOf(colour, least, most, power) {
  const [colours, shares] = [new Uint32Array(256), new Uint8Array(256)];
  for (let n = 0; n < 256; n++) {
    const light = Math.min(1, (66 + 0.7 * n + Math.max(0, n - 210)) / 255);
    colours[n] = pixelOf(colour.map((x) => Math.round(x * light)));
    shares[n] = Math.round(255 * (least + (most - least) * (1 - n / 255) ** power));
  }
  return { colours, shares };
}

/** @param {number} under @param {number} over @param {number} share of 255 */
function mix(under, over, share) {
  const rest = 256 - share;
  const redBlue = ((Math.imul(under & 0xff00ff, rest) + Math.imul(over & 0xff00ff, share)) >>> 8) & 0xff00ff;
  const green = (Math.imul((under >>> 8) & 0xff, rest) + Math.imul((over >>> 8) & 0xff, share)) & 0xff00;
  return 0xff000000 | redBlue | green;
}

/** Nearer together than this, mm, the skin of the body and that of the mesh are one. */
const together = 6;

/** @param {Uint32Array} pixels @param {Layers} layers @param {Looks} looks */
export function compose(pixels, layers, looks) {
  const { solid, cut, skin, body } = layers;
  const { width, id, light, depth } = solid;
  const [skinFacing, bodyFacing] = [skin, body].map(({ facing }) => /** @type {Uint8Array} */ (facing));
  const box = emptyBox();
  for (const layer of [solid, cut, skin, body]) growBox(box, layer.box);
  pixels.fill(looks.ground);
  for (let row = box.top; row < box.bottom; row++) {
    for (let n = row * width + box.left, end = row * width + box.right, x = box.left; n < end; n++, x++) {
      let pixel = id[n] === 0 ? looks.ground : looks.shades[((id[n] >>> 24) << 8) | light[n]];
      // A cut is no surface of the patient: strokes across it tell.
      if (cut.depth[n] < depth[n]) pixel = mix(pixel, looks.cut, (x + row) % 8 < 2 ? 130 : 40);
      const skinned = skin.depth[n] < depth[n];
      if (skinned) pixel = mix(pixel, looks.skin.colours[skin.light[n]], looks.skin.shares[skinFacing[n]]);
      if (body.depth[n] < depth[n] && !(skinned && Math.abs(body.depth[n] - skin.depth[n]) < together)) {
        pixel = mix(pixel, looks.body.colours[body.light[n]], looks.body.shares[bodyFacing[n]]);
      }
      pixels[n] = pixel;
    }
  }
  outline(pixels, layers.tumour, solid, looks.tumour);
}

/** The tumour is never hidden: its outline is drawn over all, and what hides it is tinted, strongly where it is not the skin alone.
 * @param {Uint32Array} pixels @param {Layer} tumour @param {Layer} solid @param {number} colour */
function outline(pixels, { width, height, box, id, depth }, solid, colour) {
  const thick = width > 900 ? 2 : 1;
  const free = (/** @type {number} */ x, /** @type {number} */ y) => x < 0 || y < 0 || x >= width || y >= height || id[y * width + x] === 0;
  for (let y = box.top; y < box.bottom; y++) {
    for (let x = box.left; x < box.right; x++) {
      const n = y * width + x;
      if (id[n] === 0) continue;
      const edge = free(x - thick, y) || free(x + thick, y) || free(x, y - thick) || free(x, y + thick);
      if (edge) pixels[n] = colour;
      else pixels[n] = mix(pixels[n], colour, solid.depth[n] < depth[n] - 0.5 ? 90 : 60);
    }
  }
}
