// Two volumes of one grid in one picture: a curtain, a blend, a difference.
import { fromScreen, planeOf, sameGrid, walk } from "../geometry.js";
import { paintChange } from "./change.js";

/** The other volume, when both are compared and lie on one grid; the change of volume is shown over the CT, on any grid.
 * @param {import("../state.js").State} state @param {import("./pane.js").Pane} pane */
export function comparedWith(state, pane) {
  if (state.step !== "check" || state.compare.way === "off" || state.flicker) return null;
  if (state.compare.way === "volume") return pane.held.grid.id === "ct" ? state.voxels.jacobian ?? null : null;
  const other = state.voxels[pane.held.grid.id === "ct" ? "deformed" : "ct"];
  return other && sameGrid(other.grid, pane.held.grid) ? other : null;
}

/** The pane as if it showed the volume that it is compared with, which has the same voxels.
 * @param {import("../state.js").State} state @param {import("./pane.js").Pane} pane */
export function otherPane(state, pane) {
  const other = state.compare.way === "volume" ? null : comparedWith(state, pane);
  return other && { ...pane, held: other };
}

/** Red is brighter in the simulated CT, blue is darker, as in the report; in full from half the window.
 * @param {number} d simulated minus CT @param {number} width */
function differenceColour(d, width) {
  const share = Math.max(-1, Math.min(1, d / (width / 2)));
  const [strong, weak] = [Math.round(40 + 215 * Math.abs(share)), Math.round(40 * (1 - Math.abs(share)))];
  return share >= 0 ? 0xff000000 | (weak << 16) | (weak << 8) | strong : 0xff000000 | (strong << 16) | ((weak + strong >> 1) << 8) | weak;
}

/**
 * @param {Uint32Array} pixels the first volume's picture, changed
 * @param {import("./pane.js").Pane} pane @param {import("../state.js").Held} other
 * @param {{way: string, share: number}} compare @param {Uint8ClampedArray} greys @param {{width: number}} window
 */
export function blendPlanes(pixels, pane, other, { way, share }, greys, window) {
  if (way === "volume") return paintChange(pixels, pane, other);
  const { start, right, down } = walk(pane.held.grid, pane.view, pane.slice);
  const { width } = planeOf(pane.held.grid, pane.view);
  const [mine, theirs] = [pane.held.voxels, other.voxels];
  // Whichever of both is the one that is shown.
  const sign = pane.held.grid.id === "ct" ? 1 : -1;
  const edge = Math.round(fromScreen(pane.plane, pane.frame, [share * pane.box[0], 0])[0] + 0.5);
  for (let n = 0, from = start; n < pixels.length; from += down) {
    for (let x = 0, at = from; x < width; x++, n++, at += right) {
      if (way === "difference") {
        pixels[n] = differenceColour(sign * (theirs[at] - mine[at]), window.width);
        continue;
      }
      if (way === "curtain" && x < edge) continue;
      const grey = greys[theirs[at] & 0xffff];
      const mixed = way === "curtain" ? grey : Math.round((pixels[n] & 0xff) * (1 - share) + grey * share);
      pixels[n] = 0xff000000 | (mixed * 0x010101);
    }
    if (way === "curtain" && edge > 0 && edge < width) pixels[n - width + edge] = 0xff1a8cff;
  }
}
