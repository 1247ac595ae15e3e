// The written result to a DICOM node: a known one, or one that is typed.
import { element, remake } from "../dom.js";
import { sendTo } from "../link.js";
import { now } from "../state.js";
import { enters, part } from "./parts.js";
import { confirmation, confirmed, finding, once } from "./verdict.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {import("./parts.js").Part} Part */

/** The words that a doubtful result asks for. @param {State} state */
const asked = ({ server }) => ({ words: server?.result?.confirm ?? null, reasons: server?.result?.reasons ?? [] });

/** Where to: a node of the list, or the address below it. @returns {Part} */
function form() {
  const nodes = element("select", { id: "send-node", onchange: () => draw(now()) });
  const address = element("input", { type: "text", id: "send-address", placeholder: "ARCHIVE@pacs:104", pattern: "[^@:\\s]{1,16}@[^@\\s]+:0*[1-9][0-9]{0,4}",
    autocomplete: "off", spellcheck: "false", "aria-describedby": "send-form", oninput: () => draw(now()) });
  const known = element("p", { class: "field" }, element("label", { for: "send-node" }, "To"), nodes);
  const typed = element("div", { class: "typed" }, element("label", { for: "send-address" }, "Address of the node"), address,
    element("p", { class: "quiet", id: "send-form" }, "AE title@host:port"));
  const to = () => nodes.value || (address.value && address.checkValidity() ? address.value.trim() : "");
  const go = element("button", { type: "button", onclick: () => once(sendTo(to(), asked(now()).words && now().typed.trim())) }, "Send");
  const words = confirmation(asked, go);
  enters(address, go);
  const root = element("div", { class: "send" }, element("h3", {}, "Send to a DICOM node"), known, typed, words.root, go);
  const draw = (/** @type {State} */ state) => {
    root.hidden = !state.server?.result || state.server.result.old === true;
    if (root.hidden) return;
    const all = state.server?.nodes ?? [];
    const before = nodes.value;
    remake(nodes, all, () => [...all.map((one) => element("option", { value: one.address, selected: one.address === before },
      `${one.name} (${one.address})`)), element("option", { value: "" }, "another node\u2026")]);
    known.hidden = all.length === 0;
    typed.hidden = nodes.value !== "";
    words.draw(state);
    go.disabled = !to() || Boolean(state.server?.job) || !confirmed(asked(state).words, state.typed);
  };
  return { root, draw };
}

/** @returns {Part} */
const sent = () => part("sent", (/** @type {State} */ { server }) => server?.sent ?? null,
  (told) => (told ? [finding(told.ok, `${told.to}: ${told.text}`)] : []));

/** @returns {Part[]} */
export const sendParts = () => [form(), sent()];
