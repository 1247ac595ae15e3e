// What the left button does in a slice view, by the chosen tool.
import { moveCrosshair } from "../actions.js";
import { change, now } from "../state.js";
import { fromScreenOf } from "../views/pane.js";
import { beginStroke, clickPoint } from "./brush.js";
import { placeTumour } from "./handles.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../views/pane.js").Pane} Pane */
/** @typedef {import("../views/pointer.js").Drag} Drag */

/** @param {Pane} pane @param {Pair} at @returns {Drag} */
function beginCrosshair(pane, at) {
  const carry = (/** @type {Pair} */ to) => moveCrosshair(fromScreenOf(pane, to));
  carry(at);
  return { move: carry };
}

/** Two clicks, or one drag. @param {Pane} pane @param {Pair} from @returns {Drag|null} */
function beginRuler(pane, from) {
  const { ruler } = now();
  const place = fromScreenOf(pane, from);
  if (ruler?.open && ruler.view === pane.name && ruler.slice === pane.slice) {
    change({ ruler: { ...ruler, to: place, open: false } });
    return null;
  }
  change({ ruler: { view: pane.name, slice: pane.slice, from: place, to: place, open: true } });
  return {
    move: (at) => moveRuler(pane, at),
    end(at) {
      const begun = now().ruler;
      const dragged = Math.hypot(at[0] - from[0], at[1] - from[1]) > 4;
      if (begun && dragged) change({ ruler: { ...begun, to: fromScreenOf(pane, at), open: false } });
    },
  };
}

/** The ruler's open end follows the pointer. @param {Pane} pane @param {Pair} at */
export function moveRuler(pane, at) {
  const { ruler } = now();
  if (ruler?.open && ruler.view === pane.name && ruler.slice === pane.slice) change({ ruler: { ...ruler, to: fromScreenOf(pane, at) } });
}

/** @type {Record<string, (pane: Pane, at: Pair, event: PointerEvent) => Drag|null>} */
export const tools = { crosshair: beginCrosshair, ruler: beginRuler, tumour: placeTumour, brush: beginStroke, point: clickPoint };
