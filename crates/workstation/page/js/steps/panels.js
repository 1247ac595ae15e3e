// The panel on the right: one section for each step, the display below.
import { makeDisplay } from "./display.js";
import { tableParts } from "./table.js";
import { checkParts } from "./check.js";
import { exportParts } from "./export.js";
import { another, facts, save, switchVolume } from "./look.js";
import { logPart } from "./log.js";
import { markParts } from "./mark.js";
import { openParts } from "./open.js";
import { panel, progress, stages } from "./parts.js";
import { segmentParts } from "./segment.js";

/** @typedef {import("../state.js").State} State */

/** @param {HTMLElement} root */
export function makePanels(root) {
  const job = progress();
  /** @type {Record<string, import("./parts.js").Part>} */
  const panels = {
    open: panel("open", "1 Open", [...openParts(), facts(), save(), another()]),
    mark: panel("mark", "2 Mark", markParts()),
    segment: panel("segment", "3 Segment", segmentParts()),
    table: panel("table", "4 Table", tableParts()),
    check: panel("check", "5 Check", checkParts()),
    export: panel("export", "6 Export", exportParts()),
  };
  const [shown, all, display, log] = [switchVolume(), stages(), makeDisplay(), logPart()];
  root.append(job.root, ...Object.values(panels).map((one) => one.root), shown.root, all.root, display.root, log.root);
  let before = "";
  return (/** @type {State} */ state) => {
    const another = state.step !== before;
    before = state.step;
    job.draw(state);
    for (const [step, one] of Object.entries(panels)) {
      one.root.hidden = step !== state.step;
      if (step === state.step) one.draw(state);
    }
    shown.draw(state);
    all.draw(state);
    display.draw(state);
    log.draw(state);
    // Another step is read from its beginning, whatever was scrolled to while it was drawn.
    if (another) root.scrollTop = 0;
  };
}
