// The tumour by mouse: placed by a click, moved and sized by its handles. A drag is a draft; its end is one edit.
import { clamp } from "../geometry.js";
import { edit, refresh } from "../link.js";
import { change, now, tumourOf } from "../state.js";
import { depthOf, fromScreenOf, toScreenOf } from "../views/pane.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../views/pane.js").Pane} Pane */
/** @typedef {import("../views/pointer.js").Drag} Drag */
/** @typedef {import("../state.js").Sphere} Sphere */

const reach = 9;
const usual = 8;
const tenth = (/** @type {number} */ x) => Math.round(x * 10) / 10;

/** The draft stays until the server's state with it has come, or it was refused. */
async function sendDraft() {
  const { draft } = now();
  if (!draft) return;
  const taken = await edit([
    { key: "tumour.centre", value: draft.centre_mm.map((x) => Math.round(x * 100) / 100) },
    { key: "tumour.radius", value: tenth(draft.radius_mm) },
  ]);
  if (taken) await refresh();
  if (now().draft === draft) change({ draft: null });
}

/** @param {Sphere} tumour */
export function setTumour(tumour) {
  change({ draft: tumour });
  return sendDraft();
}

/** @param {Pane} pane @param {Pair} at @returns {Drag} */
export function placeTumour(pane, at) {
  const radius_mm = tumourOf(now())?.radius_mm ?? usual;
  const put = (/** @type {Pair} */ to) => change({ draft: { centre_mm: fromScreenOf(pane, to), radius_mm } });
  put(at);
  return {
    move: put,
    end() {
      change({ tool: "crosshair" });
      sendDraft();
    },
  };
}

/** @param {Pane} pane @param {Pair} at @returns {Drag|null} nothing when no handle is near */
export function beginHandle(pane, at) {
  const tumour = tumourOf(now());
  if (now().step !== "mark" || now().tool !== "crosshair" || !tumour) return null;
  if (pane.held.grid.simulated || Math.abs(depthOf(pane, tumour.centre_mm)) > tumour.radius_mm) return null;
  const [x, y] = toScreenOf(pane, tumour.centre_mm);
  const scale = pane.frame.scale;
  const away = (/** @type {number} */ dx) => Math.hypot(at[0] - x - dx, at[1] - y);
  const [centre, rim] = [away(0), away(tumour.radius_mm * scale)];
  if (Math.min(centre, rim) > reach) return null;
  // Of a small tumour both handles are near: the nearer one is meant.
  if (rim < centre) {
    return {
      move: (to) => change({ draft: { ...tumour, radius_mm: tenth(clamp((to[0] - x) / scale, 1, 60)) } }),
      end: sendDraft,
    };
  }
  const depth = depthOf(pane, tumour.centre_mm);
  const normal = pane.held.grid.axes[pane.view.normal];
  return {
    move(to) {
      // Within the plane only: the centre keeps its distance from it.
      const place = fromScreenOf(pane, [x + to[0] - at[0], y + to[1] - at[1]]);
      const centre_mm = /** @type {Triple} */ (place.map((p, a) => p + depth * normal[a]));
      change({ draft: { ...tumour, centre_mm } });
    },
    end: sendDraft,
  };
}
