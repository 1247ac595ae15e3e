// The searchable help, made from the tables of keys and gestures.
import { element } from "./dom.js";
import { bindings, gestures } from "./keys.js";

const names = { ArrowUp: "\u2191", ArrowDown: "\u2193", ArrowLeft: "\u2190", ArrowRight: "\u2192", PageUp: "PgUp", PageDown: "PgDn", Escape: "Esc" };

/** @param {string} key */
const spelled = (key) => key.replace(/[A-Z][a-z]+[A-Za-z]*/g, (word) => /** @type {Record<string, string>} */ (names)[word] ?? word);

/** @param {string} wanted */
function rows(wanted) {
  const all = [...gestures, ...bindings, { group: "Help", keys: ["?"], what: "this list" }];
  const fits = all.filter(({ group, keys, what }) => `${group} ${keys.map(spelled).join(" ")} ${what}`.toLowerCase().includes(wanted));
  return [...new Set(fits.map(({ group }) => group))].flatMap((group) => [
    element("tr", {}, element("th", { colspan: "2", scope: "colgroup" }, group)),
    ...fits.filter((one) => one.group === group).map(({ keys, what }) => element("tr", {},
      element("td", {}, ...keys.flatMap((key, n) => [n ? " " : "", element("kbd", {}, spelled(key))])),
      element("td", {}, what))),
  ]);
}

/** @returns {() => void} opens the help */
export function makeHelp() {
  const body = element("tbody");
  const search = element("input", { type: "text", id: "help-search", autocomplete: "off", oninput: () => fill() });
  const fill = () => {
    const found = rows(search.value.trim().toLowerCase());
    body.replaceChildren(...found.length ? found : [element("tr", {}, element("td", { colspan: "2" }, "Nothing found."))]);
  };
  const dialog = element("dialog", { class: "help", "aria-labelledby": "help-title" },
    element("div", { class: "help-head" }, element("h2", { id: "help-title" }, "Keys and mouse"),
      element("button", { type: "button", onclick: () => dialog.close() }, "Close")),
    element("label", { for: "help-search" }, "Search"), search,
    element("div", { class: "help-list", tabindex: "0", role: "region", "aria-label": "List of keys" }, element("table", {}, body)));
  document.body.append(dialog);
  return () => {
    search.value = "";
    fill();
    dialog.showModal();
    search.focus();
  };
}
