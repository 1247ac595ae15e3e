// The tumour and the region by mouse: moved and sized by their handles, the tumour also placed by a click.
// A drag is a draft; its end is one edit.
import { clamp } from "../geometry.js";
import { edit, refresh } from "../link.js";
import { change, now, regionOf, tumourOf } from "../state.js";
import { depthOf, fromScreenOf, toScreenOf } from "../views/pane.js";

/** @typedef {import("../geometry.js").Pair} Pair */
/** @typedef {import("../geometry.js").Triple} Triple */
/** @typedef {import("../views/pane.js").Pane} Pane */
/** @typedef {import("../views/pointer.js").Drag} Drag */
/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Sphere} Sphere */
/** @typedef {import("../state.js").Draft} Draft */
/** @typedef {{what: Draft["what"], part: "centre"|"rim", at: Pair, sphere: Sphere}} Handle `at`: pixels of the pane */

const reach = 9;
const usual = 8;
const tenth = (/** @type {number} */ x) => Math.round(x * 10) / 10;

/** The spheres with handles, the one that is meant first when both are near. `sides`: of the rim, with a handle.
 * @type {{what: Draft["what"], of: (state: State) => Sphere|null, sides: number[], radii: Pair}[]} */
export const spheres = [
  { what: "tumour", of: tumourOf, sides: [1], radii: [1, 60] },
  { what: "region", of: regionOf, sides: [1, -1], radii: [10, 300] },
];

/** The draft stays until the server's state with it has come, or it was refused. */
async function sendDraft() {
  const { draft } = now();
  if (!draft) return;
  const taken = await edit([
    { key: `${draft.what}.centre`, value: draft.centre_mm.map((x) => Math.round(x * 100) / 100) },
    { key: `${draft.what}.radius`, value: tenth(draft.radius_mm) },
  ]);
  if (taken) await refresh();
  if (now().draft === draft) change({ draft: null });
}

/** @param {Draft["what"]} what @param {Sphere} sphere */
export function setSphere(what, { centre_mm, radius_mm }) {
  change({ draft: { what, centre_mm, radius_mm } });
  return sendDraft();
}

/** @param {Pane} pane @param {Pair} at @returns {Drag} */
export function placeTumour(pane, at) {
  const radius_mm = tumourOf(now())?.radius_mm ?? usual;
  const put = (/** @type {Pair} */ to) => change({ draft: { what: "tumour", centre_mm: fromScreenOf(pane, to), radius_mm } });
  put(at);
  return {
    move: put,
    end() {
      change({ tool: "crosshair" });
      sendDraft();
    },
  };
}

/** The handles that a view shows: those on the rim lie where the plane cuts the sphere.
 * @param {State} state @param {Pane} pane @returns {Handle[]} */
export function handlesOf(state, pane) {
  if (state.step !== "mark" || pane.held.grid.simulated) return [];
  /** @type {Handle[]} */
  const all = [];
  for (const { what, of, sides } of spheres) {
    const sphere = of(state);
    const square = sphere ? sphere.radius_mm ** 2 - depthOf(pane, sphere.centre_mm) ** 2 : -1;
    if (!sphere || square < 0) continue;
    const [x, y] = toScreenOf(pane, sphere.centre_mm);
    const cut = Math.sqrt(square) * pane.frame.scale;
    // Two squares on one spot would not tell which of them is dragged.
    const hidden = all.some((one) => Math.hypot(one.at[0] - x, one.at[1] - y) < 2 * reach);
    if (!hidden) all.push({ what, part: "centre", at: [x, y], sphere });
    for (const side of sides) all.push({ what, part: "rim", at: [x + side * cut, y], sphere });
  }
  return all;
}

/** @param {Pane} pane @param {Handle} handle @param {Pair} from @returns {Drag} */
function moveCentre(pane, { what, at: [x, y], sphere }, from) {
  const depth = depthOf(pane, sphere.centre_mm);
  const normal = pane.held.grid.axes[pane.view.normal];
  return {
    move(to) {
      // Within the plane only: the centre keeps its distance from it.
      const place = fromScreenOf(pane, [x + to[0] - from[0], y + to[1] - from[1]]);
      const centre_mm = /** @type {Triple} */ (place.map((p, a) => p + depth * normal[a]));
      change({ draft: { what, radius_mm: sphere.radius_mm, centre_mm } });
    },
    end: sendDraft,
  };
}

/** @param {Pane} pane @param {Handle} handle @returns {Drag} */
function moveRim(pane, { what, sphere }) {
  const [x] = toScreenOf(pane, sphere.centre_mm);
  const depth = depthOf(pane, sphere.centre_mm);
  const [least, most] = spheres.find((one) => one.what === what)?.radii ?? [1, 300];
  return {
    move(to) {
      const radius_mm = tenth(clamp(Math.hypot((to[0] - x) / pane.frame.scale, depth), least, most));
      change({ draft: { what, centre_mm: sphere.centre_mm, radius_mm } });
    },
    end: sendDraft,
  };
}

/** Of handles that are both near the nearer one is meant. @param {Pane} pane @param {Pair} at
 * @returns {Drag|null} nothing when no handle is near */
export function beginHandle(pane, at) {
  if (now().tool !== "crosshair") return null;
  const away = (/** @type {Handle} */ one) => Math.hypot(at[0] - one.at[0], at[1] - one.at[1]);
  const near = handlesOf(now(), pane).filter((one) => away(one) <= reach).sort((a, b) => away(a) - away(b))[0];
  if (!near) return null;
  return near.part === "rim" ? moveRim(pane, near) : moveCentre(pane, near, at);
}
