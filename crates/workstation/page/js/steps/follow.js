// The part of step 4 that follows a running navigation: where it is, how that stands, and what it says.
import { isTracked, loadOf, toggleApplicator } from "../applicator.js";
import { element, fixed, remake, say } from "../dom.js";
import { length, minus } from "../geometry.js";
import { followAt, leave } from "../link.js";
import { hindrance } from "../live.js";
import { isFollowing, passedOver, standing, strangeness, usual } from "../navigation.js";
import { change, now } from "../state.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("../state.js").Answer} Answer */
/** @typedef {import("./parts.js").Part} Part */

const words = { ok: "ok: in balance", predicted: "predicted", late: "\u26a0 late: the pose is old", stale: "\u26a0 stale" };
/** @param {number|null} x @param {string} unit @param {number} [digits] */
const known = (x, unit, digits) => (x === null ? "not told" : `${fixed(x, digits)} ${unit}`);

/** How far the tumour has gone since the picture in the slices was made. @param {Answer} answer @param {State} state */
function behind({ tumour }, state) {
  const drawn = loadOf(state)?.tumour;
  return drawn ? `${fixed(length(minus(drawn, tumour)))} mm` : "\u2013";
}

/** Rows of the table: a name, and what an answer says of it. @type {[string, (answer: Answer, state: State) => string][]} */
const rows = [
  ["State", ({ state }) => words[state]],
  ["Tumour within, 95\u202f%", ({ within_mm: mm }) => (mm === null ? "not known" : `\u00b1 ${fixed(mm)} mm`)],
  ["Moved", ({ moved_mm: mm }) => known(mm, "mm")],
  ["Tumour centre to applicator", ({ from_surface_mm: mm }) => known(mm, "mm")],
  ["Tumour edge to applicator", ({ from_surface_mm: mm, radius_mm: r }) => known(mm === null ? null : mm - r, "mm")],
  ["Tumour centre to axis", ({ from_axis_mm: mm }) => known(mm, "mm")],
  ["Force", ({ force_n: n }) => known(n, "N", 2)],
  ["Solver\u2019s error", ({ solver_error_mm: mm }) => known(mm, "mm", 3)],
  ["Age of the pose", ({ age_ms: ms, state }) => (state === "stale" ? "not of now" : known(ms, "ms", 0))],
  ["Poses", (_, { navigation }) => (navigation?.rate ? `${fixed(navigation.rate, 0)} a second` : "\u2013")],
  ["Tumour moved since slices", behind],
];

/** Nobody reads faster than this, ms. */
const often = 200;

/** @returns {Part} */
function readings() {
  const cells = rows.map(() => element("td"));
  const table = element("table", { class: "facts" }, element("tbody", {},
    ...rows.map(([name], n) => element("tr", {}, element("th", { scope: "row" }, name), cells[n]))));
  let [drawn, at] = ["", 0];
  return { root: table, draw: (state) => {
    const answer = state.navigation?.answer ?? null;
    table.hidden = !answer;
    if (!answer || (answer.state === drawn && performance.now() - at < often)) return;
    [drawn, at] = [answer.state, performance.now()];
    table.dataset.state = answer.state;
    rows.forEach(([, of], n) => say(cells[n], of(answer, state)));
  } };
}

/** What keeps the slices from following. @param {State} state */
function slices(state) {
  const answer = state.navigation?.answer;
  if (!answer) return "";
  if (!state.applicator) return "It is not drawn: no applicator is put in above.";
  if (!state.previewOn) return "It is not drawn: the preview is switched off above.";
  if (!state.slicesFollow) return "The slices are those of the table; the applicator is an outline.";
  const away = hindrance(state);
  if (away) return away;
  if (!loadOf(state)) return "Waiting for the first picture\u2026";
  return loadOf(state)?.tumour ? "" : "\u26a0 The navigation sends no picture: the slices are those of the table.";
}

/** What does not fit together. @returns {Part} */
function doubts() {
  const root = element("div", { class: "doubts" });
  return { root, draw: (state) => {
    const answer = state.navigation?.answer ?? null;
    if (answer && answer.state !== "ok") return;
    const far = strangeness(state);
    remake(root, far && Math.round(far), () =>
      (far ? [element("p", {}, `\u26a0 Its tumour lies ${fixed(far, 0)} mm from this case\u2019s: is it the navigation of this run?`)] : []));
  } };
}

/** Where it is, and the button. @returns {Part} */
function address() {
  const field = element("input", { type: "text", id: "follow-address", value: usual, placeholder: usual, pattern: "\\S+:0*[1-9][0-9]{0,4}", required: true,
    autocomplete: "off", spellcheck: "false", "aria-describedby": "follow-form",
    onkeydown: (/** @type {KeyboardEvent} */ event) => event.key === "Enter" && !isFollowing(now()) && begin() });
  const begin = () => {
    if (!field.reportValidity()) return;
    if (!now().applicator) toggleApplicator();
    followAt(field.value.trim());
  };
  const go = element("button", { type: "button", id: "follow-go", onclick: () => (isFollowing(now()) ? leave() : begin()) });
  const root = element("div", { class: "place" },
    element("p", { class: "field" }, element("label", { for: "follow-address" }, "Address"), field, go),
    element("p", { class: "quiet", id: "follow-form" }, "host:port of supine navigate"));
  return { root, draw: (state) => {
    const on = isFollowing(state);
    say(go, on ? "Leave" : "Follow");
    field.readOnly = on;
    // Another window may have begun it.
    if (on && state.navigation?.address) field.value = state.navigation.address;
    go.disabled = !state.socket || !state.server?.case;
  } };
}

/** @returns {Part} */
export function followPart() {
  const told = element("p", { class: "standing", "aria-live": "polite" });
  const box = element("input", { type: "checkbox", id: "slices-follow", onchange: () => change({ slicesFollow: box.checked }) });
  const choice = element("label", { for: "slices-follow" }, box, " Slices follow");
  const lines = [slices, passedOver].map((of) => ({ of, line: element("p", { class: "quiet" }) }));
  const parts = [address(), doubts(), readings()];
  const root = element("div", { class: "follow", role: "group", "aria-label": "Follow a navigation" }, element("h4", {}, "Follow a navigation"),
    parts[0].root, told, choice, parts[1].root, parts[2].root, ...lines.map(({ line }) => line));
  return { root, draw: (state) => {
    parts.forEach((one) => one.draw(state));
    say(told, standing(state));
    told.hidden = told.textContent === "";
    choice.hidden = !isFollowing(state);
    box.checked = state.slicesFollow;
    root.classList.toggle("tracked", isTracked(state));
    for (const { of, line } of lines) {
      say(line, of(state));
      line.hidden = line.textContent === "";
    }
  } };
}
