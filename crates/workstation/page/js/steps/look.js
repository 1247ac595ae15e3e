// Step 1 with a case: what was opened, how far the stages are, and which volume is shown.
import { goToPatch } from "../actions.js";
import { element, fixed } from "../dom.js";
import { hint } from "../keys.js";
import { list, run, saveAs } from "../link.js";
import { change, now } from "../state.js";
import { oldMark, part } from "./parts.js";
import { place } from "./place.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** @param {[string, string][]} rows */
const table = (rows) => element("table", { class: "facts" }, element("tbody", {},
  ...rows.map(([name, value]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, value)))));

/** @returns {Part} */
export function facts() {
  const data = (/** @type {State} */ { server, choosing }) => (server?.case && !choosing
    ? { ct: server.volumes.find(({ id }) => id === "ct"), values: server.case.values, phase: server.phase } : null);
  return part("facts-part", data, (told) => {
    if (!told) return [];
    if (!told.ct) return [element("p", { class: "quiet" }, told.phase === "reading" ? "Reading the CT\u2026" : "No CT yet.")];
    const { size, spacing_mm: spacing } = told.ct;
    const extent = size.map((n, a) => fixed((n * spacing[a]) / 10, 1)).join(" \u00d7 ");
    const { breast } = told.values;
    return [element("h3", {}, "CT"), table([
      ["voxels", size.join(" \u00d7 ")], ["spacing", `${spacing.map((x) => fixed(x, 2)).join(" \u00d7 ")} mm`],
      ["extent", `${extent} cm`], ...(breast ? [/** @type {[string, string]} */ (["breast", String(breast)])] : []),
    ])];
  });
}

/** A case that no file holds yet. @returns {Part} */
export const save = () => place({
  id: "case-name", label: "Save as", usual: "case.toml", button: "Save the case",
  wanted: ({ server, choosing }) => server?.case?.saved === false && server.phase === "ready" && !choosing, does: saveAs,
});

/** The folder is listed anew: something may have been written since. */
function chooseAnother() {
  change({ choosing: true });
  list(now().list?.dir.id ?? null);
}

/** @returns {Part} */
export function another() {
  return part("another", ({ server, choosing }) => Boolean(server?.case) && !choosing, (can) => (can
    ? [element("button", { type: "button", "data-key": "another", onclick: chooseAnother }, "Open another\u2026")] : []));
}

/** Original or deformed, once there are both. @returns {Part} */
export function switchVolume() {
  const data = (/** @type {State} */ state) => ({ both: Boolean(state.voxels.ct && state.voxels.deformed), show: state.show });
  return part("switch", data, ({ both, show }) => (both ? [
    element("h3", {}, "Shown"),
    element("div", { class: "choices", role: "group", "aria-label": "Volume shown", title: hint("flicker") },
      ...[["ct", "CT"], ["deformed", "Simulated"]].map(([id, name]) => element("button", {
        type: "button", "data-key": id, "aria-pressed": String(show === id), onclick: () => change({ show: id }),
      }, name))),
    element("p", { class: "quiet" }, "Hold D for the other one."),
  ] : []));
}

/** @param {string} text @param {string|null} until @returns {Part} */
export function runButton(text, until) {
  const data = (/** @type {State} */ { server }) => ({ ready: server?.phase === "ready", busy: Boolean(server?.job) });
  return part("run", data, ({ ready, busy }) => [element("button", {
    type: "button", class: "primary", "data-key": "run", disabled: !ready || busy, onclick: () => run(until),
  }, text)]);
}

/** Uncertain places are found with the region. @returns {Part} */
export function findPatches() {
  const data = (/** @type {State} */ { server, voxels }) => ({ wanted: Boolean(voxels.labels) && server?.patches.length === 0
    && server.stages.some(({ name, state }) => name === "region" && state !== "done"), busy: Boolean(server?.job) });
  return part("run", data, ({ wanted, busy }) => (wanted ? [element("button", {
    type: "button", "data-key": "region", disabled: busy, onclick: () => run("region"),
  }, "Find the region and uncertain places")] : []));
}

/** @param {import("../state.js").Patch} patch */
const patchText = ({ name, area_cm2: area, error_mm: error }) =>
  `${name || "patch"}: ${fixed(area, area < 1 ? 2 : 1)}\u00a0cm\u00b2, \u00b1${fixed(error)}\u00a0mm`;

/** Uncertain patches of the wall, largest first as the server has them. @returns {Part} */
export function patches() {
  const data = (/** @type {State} */ state) => ({ all: state.server?.patches ?? [], patch: state.patch, old: state.server?.patches_old });
  return part("patches", data, ({ all, patch, old }) => {
    if (all.length === 0) return [];
    const area = all.reduce((sum, one) => sum + one.area_cm2, 0);
    return [
      element("h3", {}, old ? oldMark() : "", `Uncertain wall: ${fixed(area)} cm\u00b2`),
      element("button", { type: "button", "data-key": "next", title: hint("patch"), onclick: () => goToPatch() }, "Next (X)"),
      element("ol", { class: "plain" }, ...all.map((one, n) => element("li", { "aria-current": n === patch && "true" },
        element("button", { type: "button", class: "jump", "data-key": `patch ${n}`, onclick: () => goToPatch(n) },
          patchText(one), "\u00a0\u25b8")))),
    ];
  });
}
