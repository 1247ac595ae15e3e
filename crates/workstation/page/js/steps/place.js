// Where something is written: a folder from the server's list, and a name.
import { element, remake, say } from "../dom.js";
import { list } from "../link.js";
import { now } from "../state.js";
import { enters } from "./parts.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** @param {NonNullable<State["list"]>} listed */
const rows = ({ up, folders }) => [
  element("li", {}, element("button", {
    type: "button", class: "entry up", "data-key": "up", disabled: up === null, onclick: () => list(up),
  }, "folder above")),
  ...folders.map(({ id, name }) => element("li", {},
    element("button", { type: "button", class: "entry", "data-key": id, onclick: () => list(id) }, name))),
];

/**
 * @param {{id: string, label: string, usual: string, button: string, primary?: boolean, wanted: (state: State) => boolean,
 *   does: (dir: string, name: string) => void}} options @returns {Part}
 */
export function place({ id, label, usual, button, primary, wanted, does }) {
  const name = element("input", { type: "text", id, value: usual, autocomplete: "off", spellcheck: "false" });
  const folder = element("strong");
  const folders = element("ul", { class: "plain entries" });
  const details = element("details", { class: "folders" }, element("summary", {}, "in ", folder), folders);
  const go = element("button", { type: "button", class: primary ? "primary" : "", onclick: () => {
    const { list: listed } = now();
    if (listed && name.value.trim()) does(listed.dir.id, name.value.trim());
  } }, button);
  enters(name, go);
  const root = element("div", { class: "place" }, element("p", { class: "field" }, element("label", { for: id }, label), name), details, go);
  let asked = false;
  return { root, draw: (state) => {
    root.hidden = !wanted(state);
    if (root.hidden) return;
    if (!state.list && !asked) list(null);
    asked = true;
    say(folder, state.list?.dir.name ?? "\u2026");
    remake(folders, state.list, (listed) => (listed ? rows(listed) : []));
    go.disabled = !state.list || Boolean(state.server?.job);
  } };
}
