// The focus stays where the user works: a button that goes, or that cannot be pressed for a while, must not send it to the top of the page.

/** What had the focus in the panel, and in which of its sections. @type {{id: string, key: string|undefined, panel: Element|null}|null} */
let last = null;
/** The section stands in for it. */
let standsIn = false;

const panelNow = () => /** @type {HTMLElement|null} */ (document.querySelector("#panel .step-panel:not([hidden])"));

/** @param {FocusEvent} event */
function note({ target }) {
  if (!(target instanceof HTMLElement) || target.classList.contains("step-panel")) return;
  standsIn = false;
  last = target.closest("#panel") ? { id: target.id, key: target.dataset.key, panel: target.closest(".step-panel") } : null;
}

/** The same element as it is now, if it can take the focus. @param {NonNullable<typeof last>} before @returns {HTMLElement|null} */
function again({ id, key }) {
  const found = id ? document.getElementById(id) : key ? document.querySelector(`#panel [data-key="${CSS.escape(key)}"]`) : null;
  return found instanceof HTMLElement && found.offsetParent && !found.matches(":disabled") ? found : null;
}

/** Brings a lost focus back, after the page was drawn. */
export function keepFocus() {
  const active = document.activeElement;
  const lost = active === null || active === document.body || (active instanceof HTMLElement && !active.offsetParent);
  if (!last || (!lost && !standsIn)) return;
  const place = again(last);
  if (place) return place.focus({ preventScroll: true });
  if (!lost) return;
  panelNow()?.focus({ preventScroll: true });
  standsIn = true;
}

/** Who clicks beside everything wants no focus. */
export function followFocus() {
  document.addEventListener("focusin", note);
  document.addEventListener("pointerdown", () => {
    last = null;
    standsIn = false;
  }, true);
}
