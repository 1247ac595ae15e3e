// What the program makes of the result, and the words that a user types before a doubtful one leaves.
import { element, remake } from "../dom.js";
import { change } from "../state.js";
import { enters, oldMark } from "./parts.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

const signs = { green: "\u2713", amber: "\u26a0", red: "\u2715" };
/** @type {Record<string, string>} */
const words = { good: "good", watch: "look at this", bad: "bad" };
/** @type {Record<string, string>} */
const levels = { good: "\u2713", watch: "\u26a0", bad: "\u2715" };

/** @param {{colour: "green"|"amber"|"red", headline: string, reasons: string[], old?: boolean, lacks_ticks?: boolean}} told @returns {(Node|string)[]} */
export const verdictLines = ({ colour, headline, reasons, old, lacks_ticks: ticks }) => [
  old ? element("p", { class: "old-line" }, oldMark(), "The case was changed since this was written: write it anew.") : "",
  ticks ? element("p", { class: "quiet" }, "The report does not tell of the last ticks yet: write it anew, which makes nothing else.") : "",
  element("p", { class: `verdict ${old ? "old" : colour}` }, element("span", { "aria-hidden": "true" }, `${signs[colour] ?? ""} `), headline),
  reasons.length > 0 ? element("ul", { class: "plain reasons" }, ...reasons.map((reason) => element("li", {}, reason))) : "",
];

/** A sign and a text: whether something was found well. @param {boolean} ok @param {string} text */
export const finding = (ok, text) => element("p", { class: ok ? "finding good" : "finding bad" },
  element("span", { class: "sign", "aria-hidden": "true" }, ok ? "\u2713" : "\u2715"), element("span", {}, text));

/** @param {import("../state.js").Figure} figure */
const figureRow = ({ name, text, level, old }) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, old ? oldMark() : "", text),
  element("td", { class: level ?? "" }, level ? element("span", { role: "img", "aria-label": words[level], title: words[level] }, levels[level]) : ""));

/** @param {import("../state.js").Figure[]} all @returns {(Node|string)[]} */
export function figureTable(all) {
  const groups = [...new Set(all.map(({ group }) => group))];
  return [element("table", { class: "facts figures" }, ...groups.map((group) => element("tbody", {},
    element("tr", {}, element("th", { colspan: "3", scope: "rowgroup", class: "group" }, group)),
    ...all.filter((one) => one.group === group).map(figureRow))))];
}

/** A field in which the words are typed that confirm a sending.
 * @param {(state: State) => {words: string|null, reasons: string[]}} asked @param {HTMLButtonElement} go what Enter in it does @returns {Part} */
export function confirmation(asked, go) {
  const field = element("input", { type: "text", id: "confirm", autocomplete: "off", spellcheck: "false", "aria-describedby": "confirm-why",
    oninput: () => change({ typed: field.value }) });
  enters(field, go);
  const label = element("label", { for: "confirm" });
  const reasons = element("ul", { class: "plain reasons", id: "confirm-why" });
  const root = element("div", { class: "confirm" }, reasons, label, field);
  return { root, draw: (state) => {
    const { words: wanted, reasons: all } = asked(state);
    root.hidden = wanted === null;
    if (wanted === null) return;
    remake(label, wanted, () => ["To send it, type ", element("strong", {}, wanted)]);
    remake(reasons, all, () => all.map((reason) => element("li", {}, reason)));
    if (field.value !== state.typed) field.value = state.typed;
  } };
}

/** Words are good for one sending: the next asks anew. @param {Promise<boolean>} step */
export async function once(step) {
  if (await step) change({ typed: "" });
}

/** Whether the words were typed, or none are asked for. @param {string|null} wanted @param {string} typed */
export const confirmed = (wanted, typed) => wanted === null || typed.trim() === wanted;
