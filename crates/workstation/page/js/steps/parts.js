// Parts that the panels of several steps share.
import { element, fixed, remake } from "../dom.js";
import { cancel } from "../link.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {{root: HTMLElement, draw: (state: State) => void}} Part */

/**
 * A part that is made anew when its data changes.
 * @template T
 * @param {string} kind class of the part @param {(state: State) => T} data @param {(data: T) => (Node|string)[]} make
 * @returns {Part}
 */
export function part(kind, data, make) {
  const root = element("div", { class: kind });
  return { root, draw: (state) => remake(root, data(state), make) };
}

/** @param {string} kind @param {string} title @param {Part[]} parts @returns {Part} */
export function panel(kind, title, parts) {
  const root = element("section", { class: `step-panel ${kind}`, tabindex: "-1", "aria-label": title }, element("h2", {}, title), ...parts.map((one) => one.root));
  return { root, draw: (state) => parts.forEach((one) => one.draw(state)) };
}

/** What is of the case before its last change. */
export const oldMark = () => element("span", { class: "old-mark", title: "of the case before its last change" }, "OLD");

/** @param {number|null} share */
export const percent = (share) => (share === null ? "" : `${Math.round(100 * share)}\u202f%`);

/** The job under way, with a button that stops it. @returns {Part} */
export function progress() {
  return part("job", (state) => state.server?.job ?? null, (job) => (job ? [
    element("p", {}, element("span", { id: "job-name" }, job.what), element("span", { class: "share" }, percent(job.share))),
    element("div", { class: "bar" },
      element("progress", { max: "1", value: job.share ?? undefined, "aria-labelledby": "job-name" }),
      job.can_cancel ? element("button", { type: "button", "data-key": "cancel", onclick: cancel }, "Cancel") : ""),
  ] : []));
}

const states = { none: ["\u25cb", "not yet"], running: ["\u25d4", "running"], done: ["\u25cf", "done"], stale: ["\u25d0", "out of date"],
  failed: ["\u2715", "failed"] };

/** @param {import("../state.js").Stage} stage */
function stageRow({ name, state, share, seconds, found }) {
  const [sign, word] = /** @type {Record<string, string[]>} */ (states)[state] ?? ["?", state];
  const time = seconds === null || seconds < 0.05 ? "" : `${fixed(seconds)} s`;
  return element("li", { class: `stage ${state}` },
    element("span", { class: "sign", "aria-hidden": "true" }, sign), element("span", { class: "stage-name" }, name),
    element("span", { class: "stage-state" }, [word, percent(share), time].filter(Boolean).join(" \u00b7 ")),
    found ? element("span", { class: "found" }, found) : "");
}

/** Stages with their state in words, time and finding; those that have not begun are only counted. @returns {Part} */
export function stages() {
  return part("stages", (state) => (state.server?.case ? state.server.stages : []), (all) => {
    const begun = all.filter(({ state }) => state !== "none");
    const rest = all.length - begun.length;
    if (begun.length === 0) return [];
    return [element("h3", {}, "Stages"), element("ul", { class: "plain" }, ...begun.map(stageRow)),
      rest > 0 ? element("p", { class: "quiet", title: all.filter(({ state }) => state === "none").map(({ name }) => name).join(", ") },
        `${rest} not yet`) : ""];
  });
}

/** @param {string} [stage] of this stage only @returns {Part} */
export function warnings(stage) {
  const wanted = (/** @type {State} */ state) => (state.server?.warnings ?? []).filter((one) => !stage || one.stage === stage);
  return part("warnings", wanted, (all) => (all.length === 0 ? [] : [
    element("h3", {}, "Warnings"),
    element("ul", { class: "plain" }, ...all.map((one) => element("li", {}, element("span", { class: "sign", "aria-hidden": "true" }, "\u26a0"),
      element("span", {}, one.old ? oldMark() : "", one.message)))),
  ]));
}

/** How far the tumour moves, never without how sure that is. @returns {Part} */
export function way() {
  return part("way", (state) => state.server?.tumour ?? null, (told) => {
    if (!told) return [];
    const { distance_mm: far, length_mm: length, within_mm: within, level } = told;
    const sure = length && within !== null && level !== null
      ? `${Math.round(100 * level)}\u202f%: ${fixed(length[0])} to ${fixed(length[1])} mm, and within ${fixed(within)} mm of the place shown.`
      : "The uncertainty is not known.";
    return [element("h3", {}, "The tumour\u2019s way"), element("p", {}, element("strong", {}, `${fixed(far)} mm`), ` ${sure}`)];
  });
}

/** The number typed in a field, with a decimal point or a comma; null when it is none or out of range, which the field then says.
 * A field of type number would read a comma as nothing in some languages: 25 for 2,5.
 * @param {HTMLInputElement} field */
export function numberIn(field) {
  const text = field.value.trim().replace("\u2212", "-").replace(",", ".");
  const x = /^[+-]?(\d+\.?\d*|\.\d+)$/.test(text) ? Number(text) : null;
  const [least, most] = [field.min || "-Infinity", field.max || "Infinity"].map(Number);
  const out = x !== null && (x < least || x > most);
  const wrong = x === null && text !== "" ? "Give one number, such as 2.5 or 2,5." : out ? `Give a number from ${least} to ${most}.` : "";
  field.setCustomValidity(wrong);
  return wrong === "" ? x : null;
}

/** Enter in a field does what the button beside it says. @param {HTMLInputElement} field @param {HTMLButtonElement} button */
export function enters(field, button) {
  field.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" || event.isComposing) return;
    event.preventDefault();
    button.click();
  });
}

/** @param {string} label @param {{id: string, unit?: string, min?: number, max?: number,
 *   onchange: (value: number) => void}} options @returns {{root: HTMLElement, field: HTMLInputElement}} */
export function numberField(label, { id, unit = "", min, max, onchange }) {
  const told = () => {
    const x = numberIn(field);
    if (x === null) field.reportValidity();
    else onchange(x);
  };
  const step = (/** @type {KeyboardEvent} */ event) => {
    const [way, x] = [event.key === "ArrowUp" ? 1 : event.key === "ArrowDown" ? -1 : 0, numberIn(field)];
    if (way === 0 || x === null || field.readOnly) return;
    event.preventDefault();
    field.value = String(Number((x + way).toFixed(3)));
    told();
  };
  const field = element("input", { type: "text", inputmode: "decimal", class: "number", autocomplete: "off", id, min, max, onchange: told,
    onkeydown: step, oninput: () => field.setCustomValidity("") });
  const root = element("p", { class: "field" }, element("label", { for: id }, label), field, element("span", { class: "unit" }, unit));
  return { root, field };
}
