// Drags that every tool has: pan, and window and level.
import { pan, setWindow } from "../actions.js";
import { now } from "../state.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../views/pointer.js").Drag} Drag */

/** @param {string} name @param {Pair} from @returns {Drag} */
export function beginPan(name, from) {
  let last = from;
  return {
    move(at) {
      pan(name, at[0] - last[0], at[1] - last[1]);
      last = at;
    },
  };
}

/** To the right is wider, up is a higher level (darker); wide windows change faster. @param {Pair} from @returns {Drag} */
export function beginWindow(from) {
  const { width, level } = now().window;
  const speed = Math.max(width, 100) / 300;
  return {
    move([x, y]) {
      setWindow(width + (x - from[0]) * speed, level + (from[1] - y) * speed);
    },
  };
}
