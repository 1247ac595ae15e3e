// The applicator by mouse: its sphere carries it, the square on its shaft turns it. It follows at once, the picture as fast as it comes.
import { moveCrosshair } from "../actions.js";
import { carryTo, isTracked, turnTo, unit } from "../applicator.js";
import { along, dot, length, minus } from "../geometry.js";
import { change, now } from "../state.js";
import { heldIn } from "../views/applicator.js";
import { depthOf, fromScreenOf } from "../views/pane.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../views/pane.js").Pane} Pane */
/** @typedef {import("../views/pointer.js").Drag} Drag */
/** @typedef {import("../views/applicator.js").Held} Held */

const near = 9;
const away = (/** @type {Pair} */ a, /** @type {Pair} */ b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
const rest = () => change({ carrying: false });

/** Within the plane: the sphere keeps its distance from it. @param {Pane} pane @param {Held} held @param {Pair} from @returns {Drag} */
function carry(pane, { centre, at: [x, y] }, from) {
  const depth = depthOf(pane, centre);
  const normal = pane.held.grid.axes[pane.view.normal];
  let moved = false;
  return {
    move(to) {
      // A click within the sphere is one for the crosshair.
      if (!moved && away(from, to) < 3) return;
      moved = true;
      change({ carrying: true });
      carryTo(along(fromScreenOf(pane, [x + to[0] - from[0], y + to[1] - from[1]]), normal, depth));
    },
    end(to) {
      rest();
      if (!moved) moveCrosshair(fromScreenOf(pane, to));
    },
    cancel: rest,
  };
}

/** The shaft turns within the plane; what of it stands out of the plane stays. @param {Pane} pane @param {Held} held @param {number} mm from the centre to where it is held
 * @returns {Drag} */
function turn(pane, { centre, axis }, mm) {
  const normal = pane.held.grid.axes[pane.view.normal];
  const [depth, out] = [depthOf(pane, centre), mm * dot(axis, normal)];
  return {
    move(to) {
      const place = along(fromScreenOf(pane, to), normal, depth);
      const way = along(minus(place, centre), normal, out);
      if (length(way) < 1) return;
      change({ carrying: true });
      turnTo(unit(way));
    },
    end: rest, cancel: rest,
  };
}

/** @param {Pane} pane @param {Pair} at @returns {Drag|null} nothing when the applicator is not meant */
export function beginApplicator(pane, at) {
  const held = now().tool === "crosshair" && !isTracked(now()) ? heldIn(now(), pane) : null;
  if (!held) return null;
  if (held.grip && away(at, held.grip.at) <= near) return turn(pane, held, held.grip.mm);
  return held.r > 0 && away(at, held.at) <= Math.max(held.r, near) ? carry(pane, held, at) : null;
}
