// Step 1 without a case: folders, cases, runs, and the series of an inspected folder.
import { element, fixed, say } from "../dom.js";
import { discard, list, picture, send, whose } from "../link.js";
import { change, follow, now } from "../state.js";
import { kinds } from "./beside.js";
import { part } from "./parts.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Series} Series */
/** @typedef {{id: string, name: string}} Named */

/** Pictures of series by id, fetched once. @type {Map<string, Promise<string|null>>} */
const pictures = new Map();

/** @param {HTMLImageElement} image @param {string} id */
async function showPicture(image, id) {
  if (!pictures.has(id)) pictures.set(id, picture(id));
  const address = await pictures.get(id);
  if (address) image.src = address;
}

/** @param {object} what */
async function open(what) {
  if (await send("open", what)) change({ choosing: false });
}

/** Whose CT it is of, once that is known: a folder may hold several patients'. @param {string} id */
function whoseLine(id) {
  const line = element("p", { class: "whose" });
  whose(id).then((told) => { say(line, told ?? "names no patient"); });
  return line;
}

/** @param {string} kind @param {string} title @param {Named[]} all @param {(one: Named) => void} does */
function entries(kind, title, all, does) {
  if (all.length === 0) return [];
  return [element("h3", {}, title), element("ul", { class: "plain entries" }, ...all.map((one) => element("li", {},
    element("button", { type: "button", class: `entry ${kind}`, "data-key": `${kind} ${one.id}`, onclick: () => does(one) }, one.name),
    kind === "folder" ? "" : whoseLine(one.id))))];
}

/** Thrown away by a second click. @param {string} id */
function throwAway(id) {
  let sure = false;
  const button = element("button", { type: "button", "data-key": `discard ${id}`, onclick: () => {
    if (sure) discard(id);
    sure = true;
    button.textContent = "Throw away for good";
  } }, "Throw away");
  return button;
}

const when = new Intl.DateTimeFormat("en-GB", { dateStyle: "medium", timeStyle: "short" });

/** Cases that were changed here and are in no file, and how many are no longer kept. @param {{all: import("../state.js").Unsaved[], gone: number}} told */
const unsaved = ({ all, gone }) => (all.length + gone === 0 ? [] : [element("h3", {}, "Not saved"),
  gone ? element("p", { class: "quiet" }, `${gone} ${gone === 1 ? "case that was" : "cases that were"} in no file ${gone === 1 ? "is" : "are"} no longer kept: `
    + "the last 100 are, for half a year.") : "",
  element("ul", { class: "plain" }, ...all.map(({ id, name, changed }) => element("li", { class: "unsaved" },
    element("p", {}, element("strong", {}, `New case from ${name}`)), whoseLine(id), element("p", {}, `changed ${when.format(1000 * changed)}, in no file`),
    element("div", { class: "choices" }, element("button", {
      type: "button", class: "primary", "data-key": `unsaved ${id}`, onclick: () => open({ unsaved: id }) }, "Go on with it"), throwAway(id)))))]);

/** @param {NonNullable<State["list"]>} listed */
function folder(listed) {
  const { dir, up, folders, cases, runs, dicom } = listed;
  const empty = folders.length + cases.length + runs.length + dicom === 0;
  return [
    element("p", { class: "where" },
      element("button", {
        type: "button", "data-key": "up", disabled: up === null, "aria-label": "Folder above", title: "folder above", onclick: () => list(up),
      }, "\u2191"),
      element("strong", {}, dir.name)),
    dicom > 0 ? element("button", {
      type: "button", class: "primary", "data-key": "inspect", onclick: () => send("inspect", { dir: dir.id }),
    }, `Look through ${dicom} DICOM ${dicom === 1 ? "file" : "files"}`) : "",
    ...entries("case", "Cases", cases, ({ id }) => open({ case: id })),
    ...entries("run", "Results", runs, ({ id }) => open({ run: id })),
    ...entries("folder", "Folders", folders, ({ id }) => list(id)),
    empty ? element("p", { class: "quiet" }, "Nothing here that can be opened.") : "",
  ];
}

/** @param {number[]} all @param {number} digits */
const times = (all, digits) => all.map((x) => fixed(x, digits)).join(" \u00d7 ");

/** @param {Series} series */
function card(series) {
  const { id, patient, known, description, modality, size, spacing_mm: spacing, files, usable, problems } = series;
  const image = element("img", { alt: "", width: "72", height: "72" });
  if (series.picture) showPicture(image, id);
  return element("li", { class: usable ? "card" : "card unusable" },
    series.picture ? image : element("span", { class: "no-picture", "aria-hidden": "true" }, "no picture"),
    element("div", {},
      element("strong", {}, patient || "(no name)"),
      element("p", {}, known),
      element("p", {}, description || "(no description)"),
      element("p", {}, `${modality} \u00b7 ${files} ${files === 1 ? "file" : "files"}`),
      element("p", {}, size ? `${times(size, 0)} voxels` : "size unknown"),
      element("p", {}, spacing ? `${times(spacing, 2)} mm` : "spacing unknown"),
      element("p", { class: usable ? "usable" : "not-usable" }, usable ? "\u2713 usable" : "\u2715 not usable"),
      ...problems.map((text) => element("p", { class: "why" }, text)),
      usable ? element("button", {
        type: "button", class: "primary", "data-key": `series ${id}`, onclick: () => open({ series: id }),
      }, "Open") : ""));
}

/** @param {NonNullable<State["server"]>["inspection"]} inspection */
function inspected(inspection) {
  if (!inspection) return [];
  const { name, series, objects = [] } = inspection;
  const also = objects.map((one) => `${one.name} (${kinds[one.kind] ?? one.kind})`).join(", ");
  return [element("h3", {}, `Series in ${name}`),
    series.length ? element("ul", { class: "plain" }, ...series.map(card)) : element("p", { class: "quiet" }, "No series was found."),
    also ? element("p", { class: "quiet also" }, `Also in this folder: ${also}. These can be carried along once a series is open.`) : ""];
}

/** @param {State} state */
const wanted = (state) => !state.server?.case || state.choosing;

/** The list is asked for when it is first needed. @param {State} state @param {State} before */
function ask(state, before) {
  const needed = (/** @type {State} */ s) => s.link === "live" && s.server !== null && wanted(s);
  if (needed(state) && !needed(before) && !now().list) list(null);
}

export function openParts() {
  follow(ask);
  const series = part("series", (state) => (wanted(state) ? state.server?.inspection ?? null : null), inspected);
  const files = part("files", (state) => ({ is: wanted(state), listed: state.list }), ({ is, listed }) => {
    if (!is) return [];
    // The first list may have failed.
    return listed ? folder(listed) : [element("button", { type: "button", onclick: () => list(null) }, "List the folder")];
  });
  const back = part("back", (state) => state.choosing && Boolean(state.server?.case), (can) => (can
    ? [element("button", { type: "button", onclick: () => change({ choosing: false }) }, "Back to the open case")] : []));
  const left = part("left", (state) => (wanted(state)
    ? { all: state.server?.unsaved ?? [], gone: state.server?.unsaved_gone ?? 0 } : { all: [], gone: 0 }), unsaved);
  return [back, left, series, files];
}
