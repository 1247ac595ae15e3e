// What the program wrote down while it worked: read when it is opened, and each second while a job runs.
import { element, fixed, remake } from "../dom.js";
import { readLog } from "../link.js";
import { change, follow, now } from "../state.js";

/** @typedef {import("../state.js").State} State */

let timer = 0;

/** Asks again as long as there may be more; once more after a job has ended. */
async function ask() {
  clearTimeout(timer);
  timer = 0;
  const busy = Boolean(now().server?.job);
  await readLog();
  if (now().logOpen && busy && timer === 0) timer = window.setTimeout(ask, 1000);
}

/** @param {State} state @param {State} before */
function followLog(state, before) {
  const begun = Boolean(state.server?.job) && !before.server?.job;
  if (state.logOpen && (!before.logOpen || (begun && timer === 0))) ask();
}

/** @param {{seconds: number, stage: string, text: string}} line */
const row = ({ seconds, stage, text }) => element("li", {}, element("span", { class: "when" }, `${fixed(seconds)} s`), " ",
  element("span", { class: "quiet" }, stage), " ", text);

/** @returns {import("./parts.js").Part} */
export function logPart() {
  follow(followLog);
  const lines = element("ol", { class: "plain log-lines", tabindex: "0", "aria-label": "Lines of the log" });
  const root = element("details", { class: "log", ontoggle: () => change({ logOpen: root.open }) }, element("summary", {}, "Log"), lines);
  return { root, draw: ({ logOpen, log }) => {
    if (!logOpen) return;
    const low = lines.scrollTop + lines.clientHeight >= lines.scrollHeight - 4;
    remake(lines, log, (all) => (all.length > 0 ? all.map(row) : [element("li", { class: "quiet" }, "Nothing yet.")]));
    // Who reads further up is not carried away by new lines.
    if (low) lines.scrollTop = lines.scrollHeight;
  } };
}
