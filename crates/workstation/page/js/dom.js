// Making and renewing elements. All text goes in as text nodes: what the server sends is never read as HTML.

/**
 * A text as people see it: characters that turn its direction, with which a name reads as another, and others that nobody sees, by their numbers.
 * The same as `visible` of the crate `supine-space`.
 * @param {string} text
 */
export function visible(text) {
  return text.replace(/[\u0000-\u0008\u000b\u000c\u000e-\u001f\u007f-\u009f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/g, (c) =>
    `\u27e8U+${c.charCodeAt(0).toString(16).toUpperCase().padStart(4, "0")}\u27e9`);
}

/** @param {Element} made @param {Record<string, any>} properties @param {(Node|string)[]} children @returns {any} */
function furnish(made, properties, children) {
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value === true ? "" : String(value));
  }
  made.append(...children.map((child) => (typeof child === "string" ? visible(child) : child)));
  return made;
}

/**
 * @param {string} tag
 * @param {Record<string, any>} [properties] attributes; `on…` are listeners; false, null and undefined are left out
 * @param {...(Node|string)} children
 * @returns {any}
 */
export function element(tag, properties = {}, ...children) {
  return furnish(document.createElement(tag), properties, children);
}

/** The same of an SVG drawing. @param {string} tag @param {Record<string, any>} [properties] @param {...(Node|string)} children @returns {any} */
export function graphic(tag, properties = {}, ...children) {
  return furnish(document.createElementNS("http://www.w3.org/2000/svg", tag), properties, children);
}

/** @type {WeakMap<Element, string>} */
const shown = new WeakMap();

/**
 * Makes the children of `root` anew when `data` differs from what they were made of; the focus stays on the element
 * with the same `data-key`.
 * @template T
 * @param {HTMLElement} root
 * @param {T} data
 * @param {(data: T) => (Node|string)[]} make
 */
export function remake(root, data, make) {
  const text = JSON.stringify(data) ?? "";
  if (shown.get(root) === text) return;
  shown.set(root, text);
  const active = /** @type {HTMLElement|null} */ (document.activeElement);
  const key = active && root.contains(active) ? active.dataset.key : undefined;
  root.replaceChildren(...make(data));
  if (key === undefined) return;
  /** @type {HTMLElement|null} */ (root.querySelector(`[data-key="${CSS.escape(key)}"]`))?.focus();
}

/** Sets a text only when it differs, so that screen readers and the layout are left alone.
 * @param {Element} place @param {string} text */
export function say(place, text) {
  const seen = visible(text);
  if (place.textContent !== seen) place.textContent = seen;
}

/** Sets a field's value unless the user is typing in it.
 * @param {HTMLInputElement|HTMLSelectElement} field @param {string} value */
export function show(field, value) {
  if (document.activeElement === field || field.value === value) return;
  field.value = value;
  field.setCustomValidity("");
}

/** A number with a true minus sign. @param {number} x @param {number} [digits] */
export function fixed(x, digits = 1) {
  const text = x.toFixed(digits);
  return /^-0(\.0*)?$/.test(text) ? text.slice(1) : text.replace("-", "\u2212");
}
