// Header, problem bar, readout and command line: what stays through all steps.
import { chooseStep, steps, toggle } from "./actions.js";
import { element, fixed, remake, say } from "./dom.js";
import { hint } from "./keys.js";
import { choose, send } from "./link.js";
import { change, now, shownVolume } from "./state.js";
import { changeText } from "./views/change.js";
import { readAt } from "./views/overlay.js";
import { doseText } from "./views/own.js";

/** @typedef {import("./state.js").State} State */

const at = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** Rules of printed pages alone, and what stands in them. */
const paper = { rule: "", sheet: new CSSStyleSheet() };
document.adoptedStyleSheets.push(paper.sheet);

/** @param {State} state */
function drawCase(state) {
  const opened = state.server?.case ?? null;
  // What the program has not answered it may not have heard.
  const word = state.unanswered > 0 && state.late > 0 ? "\u25cb not saved: the program does not answer"
    : state.conflict ? "\u25cb not saved: choose a value"
    : state.unanswered > 0 ? "\u25cb saving\u2026" : opened?.saved ? "\u25cf saved" : "\u25cb not saved";
  remake(at("case"), opened && [opened.name, word], () => opened
    ? [element("span", { class: "name" }, opened.name), element("span", { class: "saved" }, word)]
    : [element("span", { class: "saved" }, "no case")]);
}

/** Whose it is at the head of every printed page: what stands in the banner is on the first alone. @param {(string | false)[]} told */
function nameOnPaper(told) {
  const rule = `@page { @top-left { content: "${CSS.escape(told.filter(Boolean).join(" \u00b7 "))}"; } }`;
  if (rule === paper.rule) return;
  paper.rule = rule;
  paper.sheet.replaceSync(rule);
}

/** Whose CT is open, in every step. @param {State} state */
function drawPatient({ server }) {
  const { patient = null, phase } = server ?? {};
  const told = patient ? [patient.name || "no name", patient.id && `ID ${patient.id}`, patient.born && `born ${patient.born}`, patient.study, patient.series]
    : server?.case && phase === "ready" ? ["The CT names no patient"] : [];
  // Who prints the page takes the name along.
  const leaves = Boolean(patient) && server?.case?.values["export.anonymise"] === true;
  at("patient").classList.toggle("unprinted", leaves);
  nameOnPaper(leaves ? [] : told.slice(0, 3));
  remake(at("patient"), [told, leaves], () => [...told.filter(Boolean).map((text, n) => element(n === 0 ? "strong" : "span", {}, text)),
    leaves ? element("span", { class: "leaves" }, "leaves de-identified") : ""]);
}

/** Takes of the state only what it needs: its buttons stay as long as the step does, and would keep the voxels of another CT.
 * @param {State} state */
function drawSteps({ step: chosen, server }) {
  const opened = Boolean(server?.case);
  remake(at("steps"), [chosen, opened], () => steps.map((step, n) => element("button", {
    type: "button", class: "step", "data-key": step, disabled: n > 0 && !opened, title: `Alt+${n + 1}`,
    "aria-current": step === chosen && "step", onclick: () => chooseStep(step),
  }, element("span", { class: "step-number" }, String(n + 1)), " ", step[0].toUpperCase() + step.slice(1))));
}

/** The colours go round: as the system has them, the other way. */
function toggleTheme() {
  const dark = getComputedStyle(document.documentElement).colorScheme.includes("dark");
  useTheme(dark ? "light" : "dark");
}

/** @param {string|null} theme */
export function useTheme(theme) {
  if (!theme) return;
  document.documentElement.dataset.theme = theme;
  sessionStorage.setItem("supine-theme", theme);
}

/** @param {() => void} help */
export function makeHeader(help) {
  const warnings = element("button", { type: "button", id: "warnings", onclick: () => chooseStep("check") });
  at("head-tools").append(warnings,
    element("button", { type: "button", title: "light or dark", "aria-label": "Light or dark", onclick: toggleTheme }, "\u25d0"),
    element("button", { type: "button", title: hint("panel"), "aria-label": "Show or hide the panel", id: "fold", onclick: () => toggle("panel") }, "\u2630"),
    element("button", { type: "button", title: "keys and mouse (?)", "aria-label": "Help", onclick: help }, "?"));
}

/** @param {State} state */
function drawWarnings(state) {
  const count = (state.server?.warnings ?? []).filter((one) => !one.ticked).length;
  const button = /** @type {HTMLButtonElement} */ (at("warnings"));
  button.hidden = count === 0;
  say(button, `\u26a0 ${count}`);
  button.setAttribute("aria-label", `${count} ${count === 1 ? "warning" : "warnings"} not ticked: go to Check`);
  at("fold").setAttribute("aria-expanded", String(state.panel));
}

/** Values by their keys, as the panels call them. @type {Record<string, string>} */
const names = { "table.ap": "table, AP", "table.lat": "table, LAT", "tumour.centre": "tumour\u2019s centre", "tumour.radius": "tumour\u2019s radius",
  "tumour.structure": "tumour, as a region", "region.centre": "region\u2019s centre", "region.radius": "region\u2019s radius" };

/** A value of the case in words. @param {any} value */
function inWords(value) {
  const numbers = (/** @type {any[]} */ all) => all.length === 3 && all.every((one) => typeof one === "number");
  if (value === null) return "not given";
  if (typeof value === "number") return fixed(value, Number.isInteger(value) ? 0 : 1);
  if (Array.isArray(value)) return numbers(value) ? placeText(/** @type {any} */ (value)) : `${value.length} entries`;
  return String(value);
}

/** Two windows have changed the same: which of both stays. @param {State} state */
const conflictRow = ({ conflict }) => (conflict ? [element("div", { class: "problem conflict" },
  element("div", {}, element("p", {}, element("strong", {}, "Another window has changed the same value.")),
    ...conflict.map(({ key, mine, theirs }) => element("p", {}, `${names[key] ?? key}: there ${inWords(theirs)}, here ${inWords(mine)}.`))),
  element("div", { class: "choices" }, element("button", { type: "button", "data-key": "theirs", onclick: () => choose(false) }, "Keep the other\u2019s"),
    element("button", { type: "button", "data-key": "mine", onclick: () => choose(true) }, "Use this one")))] : []);

/** What stays until it is so no longer. @param {State} state */
function standing(state) {
  const { late, server } = state;
  const astray = server?.case?.astray;
  return [
    ...late > 0 ? [{ message: "The program has not answered for 3 s.", advice: "What was changed last may not be saved. It goes on as soon as the program answers." }] : [],
    ...astray ? [{ message: `${server?.case?.name} was changed by another program and cannot be taken over: ${astray}`,
      advice: "What is shown is of the case before. Mend the file, or open it again." }] : [],
  ];
}

/** @param {State} state */
function drawProblems(state) {
  /** @type {{message: string, advice: string|null, own?: boolean}[]} */
  const problems = standing(state);
  if (state.problem) problems.push({ ...state.problem, own: true });
  const told = state.server?.problem;
  // A refused command may be told twice: as its answer and in the state.
  if (told && told.message !== state.problem?.message) problems.push({ ...told, own: false });
  remake(at("problems"), { problems, conflict: state.conflict }, () => [...conflictRow(state), ...problems.map(({ message, advice, own }) => element("div", { class: "problem" },
    element("p", {}, element("strong", {}, message), advice ? ` ${advice}` : ""),
    own === undefined ? "" : element("button", {
      type: "button", "aria-label": "Dismiss", onclick: () => (own ? change({ problem: null }) : send("dismiss")),
    }, "\u2715")))]);
}

/** @param {State} state */
function drawCurtain(state) {
  const opened = state.server?.case;
  const but = state.unanswered > 0 ? ", but for the last one" : "";
  const kept = !opened ? ""
    : opened.kept ? ` The case is in no file. Its changes are kept${but}: step 1 offers them when the program is started here again.`
      : !opened.saved ? (opened.can_undo || but ? " The case was not saved: no file holds it." : "")
      : state.unanswered > 0 ? ` The case is in ${opened.name}, but for the last change.` : ` The case is saved in ${opened.name}.`;
  const text = state.link === "refused"
    ? "This page\u2019s key is not valid any more. Open the address that the program printed anew."
    : state.link === "gone" ? `The program was closed.${kept}` : "";
  let curtain = document.getElementById("curtain");
  if (!text) return curtain?.remove();
  if (!curtain) {
    curtain = element("div", { id: "curtain", class: "curtain", role: "alertdialog", "aria-label": "Connection" });
    document.body.append(/** @type {HTMLElement} */ (curtain));
  }
  say(/** @type {HTMLElement} */ (curtain), text);
}

/** @param {import("./geometry.js").Triple} place */
export function placeText(place) {
  return `${place.map((x, a) => `${"LPS"[a]} ${fixed(x)}`).join("  ")} mm`;
}

/** @param {State} state */
function reading(state) {
  const held = shownVolume(state);
  const place = state.cursor ?? state.crosshair;
  if (!held || !place) return null;
  const { hu, label } = readAt(state, held, place);
  const changed = held.grid.id === "ct" ? changeText(state, place) : null;
  return {
    who: state.cursor ? "Pointer" : "Crosshair", place: placeText(place),
    hu: hu === null ? "\u2026" : `${fixed(hu, 0)} HU`, label: [label, changed, doseText(state, held, place)].filter(Boolean).join("  "),
  };
}

/** @param {State} state */
function drawReadout(state) {
  const read = reading(state);
  const { width, level } = state.window;
  remake(at("readout"), [read, width, level, state.tool], () => [
    ...(read ? [
      element("span", { class: "who" }, read.who), element("span", { class: "place" }, read.place),
      element("span", { class: "hu" }, read.hu), element("span", { class: "label" }, read.label),
    ] : [element("span", { class: "who" }, "No images")]),
    element("span", {}, `W ${width}  L ${fixed(level, 0)}`),
    ...(state.tool === "crosshair" ? [] : [element("span", { class: "tool" }, `Tool: ${state.tool}`)]),
  ]);
}

/** @param {State} state */
function drawCommand(state) {
  const command = state.server?.command ?? "";
  remake(at("command"), command, () => (command ? [
    element("code", { title: command }, `$ ${command}`),
    element("button", {
      type: "button", "data-key": "copy", onclick: (/** @type {Event} */ event) => copy(/** @type {HTMLElement} */ (event.currentTarget), command),
    }, "Copy"),
  ] : []));
}

/** @param {HTMLElement} button @param {string} text */
async function copy(button, text) {
  const done = await navigator.clipboard.writeText(text).then(() => true, () => false);
  button.textContent = done ? "Copied" : "Not allowed";
  setTimeout(() => { button.textContent = "Copy"; }, 1500);
}

let speaking = 0;
/** Speaks the crosshair when it has come to rest; the pointer's readout would never be silent.
 * @param {State} state @param {State} before */
export function speak(state, before) {
  if (state.crosshair === before.crosshair || !state.crosshair) return;
  clearTimeout(speaking);
  speaking = window.setTimeout(() => {
    const { crosshair } = now();
    const read = crosshair && reading({ ...now(), cursor: null });
    if (read) say(at("spoken"), `${read.place}, ${read.hu}${read.label ? `, ${read.label}` : ""}`);
  }, 400);
}

/** @param {State} state */
export function drawShell(state) {
  document.body.classList.toggle("folded", !state.panel);
  drawCase(state);
  drawPatient(state);
  drawSteps(state);
  drawWarnings(state);
  drawProblems(state);
  drawCurtain(state);
  drawReadout(state);
  drawCommand(state);
}
