// Step 6: the whole run into a folder, and what it has written.
import { element } from "../dom.js";
import { runInto } from "../link.js";
import { part } from "./parts.js";
import { place } from "./place.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** @returns {Part} */
function before() {
  return part("before", (/** @type {State} */ { server }) => server?.warnings.length ?? 0, (open) => [
    open ? element("p", { class: "quiet" }, `\u26a0 ${open} ${open === 1 ? "warning" : "warnings"}: see Check.`) : "",
    element("p", { class: "quiet" }, "Computes all that is missing or out of date, and writes the results."),
  ]);
}

const words = { green: "\u2713", amber: "\u26a0", red: "\u2715" };

/** @param {NonNullable<NonNullable<State["server"]>["result"]>} result */
const verdict = ({ name, verdict: colour, headline, reasons, outputs }) => [
  element("h3", {}, `Written into ${name}`),
  element("p", { class: `verdict ${colour}` }, `${words[colour] ?? ""} ${headline}`),
  element("ul", { class: "plain" }, ...reasons.map((reason) => element("li", {}, reason))),
  element("ul", { class: "plain outputs" }, ...outputs.map((output) => element("li", {}, element("code", {}, output)))),
];

/** @returns {Part} */
function written() {
  return part("written", (/** @type {State} */ { server }) => server?.result ?? null, (result) => (result
    ? verdict(result) : [element("p", { class: "quiet" }, "Nothing was written yet.")]));
}

/** @returns {Part[]} */
export function exportParts() {
  const where = place({
    id: "out-name", label: "Folder", usual: "result", button: "Run and write", primary: true,
    wanted: (state) => state.server?.phase === "ready", does: runInto,
  });
  return [before(), where, written()];
}
