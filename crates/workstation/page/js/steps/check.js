// Step 5: warnings first, each with its tick; then CT and simulated CT in one picture.
import { element } from "../dom.js";
import { change, now } from "../state.js";
import { part, way } from "./parts.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** @param {import("../state.js").Warning} one */
const nameOf = (one) => `${one.stage} ${one.code} ${one.message}`;

/** @param {string} name @param {boolean} on */
function tick(name, on) {
  const others = now().ticked.filter((one) => one !== name);
  change({ ticked: on ? [...others, name] : others });
}

/** @returns {Part} */
function warnings() {
  const data = (/** @type {State} */ state) => ({ all: state.server?.warnings ?? [], ticked: state.ticked });
  return part("warnings", data, ({ all, ticked }) => {
    const open = all.filter((one) => !ticked.includes(nameOf(one))).length;
    return [
      element("h3", {}, all.length === 0 ? "No warnings" : `Warnings: ${open} of ${all.length} not ticked`),
      element("ul", { class: "plain" }, ...all.map((one, n) => element("li", { class: "ticked" },
        element("input", { type: "checkbox", "data-key": `tick ${n}`, "aria-label": `Seen: ${one.message}`, checked: ticked.includes(nameOf(one)),
          onchange: (/** @type {any} */ event) => tick(nameOf(one), event.target.checked) }),
        element("span", {}, one.message)))),
      all.length ? element("p", { class: "quiet" }, "Ticks are kept in this page only.") : "",
    ];
  });
}

/** @returns {Part} */
function compare() {
  const data = (/** @type {State} */ state) => ({ both: Boolean(state.voxels.ct && state.voxels.deformed), way: state.compare.way });
  return part("compare", data, ({ both, way }) => {
    if (!both) return [element("p", { class: "quiet" }, "CT and simulated CT can be compared after a run.")];
    return [element("h3", {}, "Compare"), element("div", { class: "choices", role: "group", "aria-label": "Compare" },
      ...[["off", "One"], ["curtain", "Curtain"], ["blend", "Blend"], ["difference", "Difference"]].map(([id, name]) => element("button", {
        type: "button", "data-key": id, "aria-pressed": String(way === id), onclick: () => change({ compare: { ...now().compare, way: id } }),
      }, name)))];
  });
}

/** @returns {Part} */
function share() {
  const slider = element("input", { type: "range", id: "share", min: 0, max: 1, step: 0.01,
    oninput: () => change({ compare: { ...now().compare, share: Number(slider.value) } }) });
  const root = element("p", { class: "field" }, element("label", { for: "share" }, "Share"), slider);
  const hint = element("p", { class: "quiet" });
  return { root: element("div", {}, root, hint), draw: ({ compare: { way, share: part }, window }) => {
    root.hidden = way !== "curtain" && way !== "blend";
    hint.textContent = way === "difference" ? `Red is brighter in the other volume, blue darker; full colour from \u00b1${window.width / 2} HU.` : "";
    if (document.activeElement !== slider) slider.value = String(part);
  } };
}

/** What the run said, as long as the case is that of the run. @returns {Part} */
function reasons() {
  const data = (/** @type {State} */ { server }) => (server?.result ? { headline: server.result.headline, all: server.result.reasons } : null);
  return part("written", data, (told) => (told ? [element("h3", {}, "Verdict of the run"), element("p", {}, told.headline),
    element("ul", { class: "plain" }, ...told.all.map((one) => element("li", {}, one)))] : []));
}

/** @returns {Part[]} */
export const checkParts = () => [warnings(), way(), reasons(), compare(), share()];
