// The part of step 5 with the patient's own structures and doses: as given, and where the tissue carries them.
import { element, fixed, remake } from "../dom.js";
import { change, now } from "../state.js";
import { legendOf, regionColour } from "../views/own.js";
import { plot, swatch } from "./plot.js";

/** @typedef {import("../state.js").Own} Own */
/** @typedef {import("../views/own.js").Entry} Entry */

/** @param {string} name of a line */
function flip(name) {
  const { hiddenLines } = now();
  change({ hiddenLines: hiddenLines.includes(name) ? hiddenLines.filter((one) => one !== name) : [...hiddenLines, name] });
}

/** Whether a line is drawn. @param {Entry} entry @param {string[]} hidden @param {string} [label] where no words stand beside it */
const box = ({ name }, hidden, label) => element("input", {
  type: "checkbox", "data-key": `line ${name}`, "aria-label": label, checked: !hidden.includes(name), onchange: () => flip(name),
});

/** A number before and after, where they are known.
 * @param {number|null|undefined} before @param {number|null|undefined} after @param {boolean} fresh */
const pair = (before, after, fresh) => [typeof before === "number" ? fixed(before) : "\u2013", ...(typeof after === "number"
  ? [" ", element("span", { class: fresh ? "after" : "after old" }, `\u2192\u00a0${fixed(after)}`)] : [])];

/** @param {string[]} names */
const headOf = (names) => element("thead", {}, element("tr", {}, ...names.map((name) => element("th", { scope: "col" }, name))));

/** @param {Own} own @param {Entry[]} legend @param {string[]} hidden */
function structureTable({ structures, fresh }, legend, hidden) {
  const rows = structures.map(({ name, file, volume_ml: ml }, n) => element("tr", {},
    element("th", { scope: "row", title: file }, swatch(legend[n].colour, legend[n].dashes), name),
    element("td", {}, ...pair(ml?.[0], ml?.[1], fresh)), element("td", {}, box(legend[n], hidden, `Shown: ${name}`))));
  return element("table", { class: "facts" }, headOf(["Structure", "Volume, ml", "Shown"]), element("tbody", {}, ...rows));
}

/** @param {Entry[]} isodoses @param {string[]} hidden */
const isodoseList = (isodoses, hidden) => element("div", { class: "switches", role: "group", "aria-label": "Isodoses" }, "Isodoses: ",
  ...isodoses.map((one) => element("label", {}, box(one, hidden), swatch(one.colour, one.dashes), one.text)));

/** @type {[string, "mean_gy"|"d98_gy"|"d50_gy"|"d2_gy"][]} */
const measures = [["Mean", "mean_gy"], ["D98", "d98_gy"], ["D50", "d50_gy"], ["D2", "d2_gy"]];

/** The doses in a region; none where the grid of the dose does not cover it.
 * @param {import("../state.js").Histogram} histogram @param {boolean} fresh */
function doses({ before, after, outside }, fresh) {
  if (outside === null) return measures.map(([, id]) => element("td", {}, ...pair(before[id], after?.[id], fresh)));
  return [element("td", { colspan: String(measures.length) }, `\u2013, outside the dose grid (${fixed(100 * outside, 0)} %)`)];
}

/** @param {import("./plot.js").Plotted[]} all @param {boolean} fresh @param {string} title */
function doseTable(all, fresh, title) {
  const rows = all.map((one) => element("tr", {},
    element("th", { scope: "row" }, swatch(one.colour, []), one.region), ...doses(one, fresh)));
  return element("table", { class: "facts doses" }, element("caption", {}, title),
    headOf(["Region", ...measures.map(([name]) => name)]), element("tbody", {}, ...rows));
}

/** The regions in one dose: curves of several would be taken for each other. @param {Own} own @param {string} dose @returns {Node[]} */
function histogramsIn(own, dose) {
  const all = own.histograms.filter((one) => one.dose === dose).map((one) => ({ ...one, colour: regionColour(own, one.region) }));
  const words = all.some(({ after }) => after) ? "Dashed: before. Solid: after." : "Dashed: before.";
  const covered = all.filter(({ outside }) => outside === null);
  return [doseTable(all, own.fresh, own.doses.length > 1 ? `${dose}: dose, Gy` : "Dose, Gy"),
    ...(covered.length > 0 ? [plot(covered, own.fresh), element("p", { class: "quiet" }, words)] : [])];
}

/** Whether the numbers after are there, and of what is given now. @param {Own} own */
function standing({ fresh, structures, doses, histograms }) {
  if (!fresh) return [element("p", { class: "stale" }, "\u25d0 out of date: simulate again")];
  const known = (/** @type {any[]|null} */ figures) => typeof figures?.[1] === "number";
  const carried = structures.some(({ volume_ml: ml }) => known(ml)) || doses.some(({ max_gy: gy }) => known(gy))
    || histograms.some(({ after }) => after);
  return carried ? [] : [element("p", { class: "quiet" }, "As given; after a simulation: where the tissue carries them.")];
}

/** @param {Own} own @param {string[]} hidden @returns {(Node|string)[]} */
function lines(own, hidden) {
  const { structures, isodoses } = legendOf(own);
  return [
    element("h3", {}, "Structures and dose"), ...standing(own),
    ...(structures.length > 0 ? [structureTable(own, structures, hidden)] : []),
    ...(isodoses.length > 0 ? [isodoseList(isodoses, hidden)] : []),
    ...own.doses.map(({ file, max_gy: [before, after] }) => element("p", { class: "largest" },
      `Largest dose in ${file}: `, ...pair(before, after, own.fresh), " Gy")),
    ...[...new Set(own.histograms.map(({ dose }) => dose))].flatMap((dose) => histogramsIn(own, dose)),
    ...own.notes.map((note) => element("p", {}, note)),
  ];
}

/** @returns {import("./parts.js").Part} */
export function ownPart() {
  const root = element("div", { class: "own" });
  /** @type {any[]} */
  let drawn = [];
  return { root, draw: ({ server, hiddenLines }) => {
    const wanted = [server?.own, hiddenLines];
    // The curves are long: they are not written out at each step of the pointer.
    if (wanted.every((one, n) => one === drawn[n])) return;
    drawn = wanted;
    remake(root, { own: server?.own ?? null, hidden: hiddenLines }, ({ own, hidden }) => (own ? lines(own, hidden) : []));
  } };
}
