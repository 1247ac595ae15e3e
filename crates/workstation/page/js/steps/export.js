// Step 6: what is written and where, the whole run into a folder, what it has written, and sending it.
import { element } from "../dom.js";
import { edit, runInto } from "../link.js";
import { part } from "./parts.js";
import { place } from "./place.js";
import { sendParts } from "./send.js";
import { finding, verdictLines } from "./verdict.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** @returns {Part} */
function before() {
  const open = (/** @type {State} */ { server }) => (server?.warnings ?? []).filter((one) => !one.ticked).length;
  return part("before", open, (count) => [
    count ? element("p", { class: "quiet" }, `\u26a0 ${count} ${count === 1 ? "warning is" : "warnings are"} not ticked: see Check.`) : "",
    element("p", { class: "quiet" }, "Computes all that is missing or out of date, and writes the results."),
  ]);
}

/** @type {[string, string][]} */
const switches = [["export.anonymise", "Take the patient\u2019s name out (anonymise)"], ["export.pdf", "Report as a PDF for the archive"],
  ["export.structures", "Outlines as a structure set"], ["export.registration", "Registrations with the CT"]];

/** What the values say will be written, in words. @param {Record<string, any>} values */
function inWords(values) {
  const all = ["the simulated CT", "the report", ...values["export.structures"] ? ["its outlines as a structure set"] : [],
    ...values["export.registration"] ? ["registrations with the CT"] : [], ...values["export.pdf"] ? ["the report as a PDF"] : []];
  const list = `${all.slice(0, -1).join(", ")} and ${all[all.length - 1]}`;
  const whose = values["export.anonymise"] ? "without the patient\u2019s name; who she is goes into a folder beside it that ends in -\u2060reidentification: keep it apart"
    : "under the patient\u2019s name";
  return `Writes ${list}, ${whose}.`;
}

/** @returns {Part} */
function what() {
  const data = (/** @type {State} */ { server }) => (server?.case ? Object.fromEntries(switches.map(([key]) => [key, server.case?.values[key] === true])) : null);
  return part("what", data, (values) => (values ? [
    ...switches.map(([key, text]) => element("label", {}, element("input", {
      type: "checkbox", "data-key": key, checked: values[key], onchange: (/** @type {any} */ event) => choose(event.target, key),
    }), ` ${text}`)),
    element("p", { class: "quiet", "aria-live": "polite" }, inWords(values)),
  ] : []));
}

/** @param {HTMLInputElement} box @param {string} key */
async function choose(box, key) {
  const value = box.checked;
  if (!await edit([{ key, value }])) box.checked = !value;
}

/** @param {NonNullable<NonNullable<State["server"]>["result"]>} result */
const resultLines = ({ name, verdict: colour, outputs, verified, ...told }) => [
  element("h3", {}, `Written into ${name}`),
  ...verdictLines({ colour, ...told }),
  verified ? finding(verified.ok, verified.text) : "",
  element("ul", { class: "plain outputs" }, ...outputs.map((output) => element("li", {}, element("code", {}, output)))),
];

/** @returns {Part} */
function written() {
  return part("written", (/** @type {State} */ { server }) => server?.result ?? null, (result) => (result
    ? resultLines(result) : [element("p", { class: "quiet" }, "Nothing was written yet.")]));
}

/** @returns {Part[]} */
export function exportParts() {
  const where = place({
    id: "out-name", label: "Folder", usual: "result", button: "Run and write", primary: true,
    wanted: (state) => state.server?.phase === "ready", does: runInto,
  });
  return [before(), what(), where, written(), ...sendParts()];
}
