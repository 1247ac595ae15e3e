// The panel on the right: one section for each step, the display below.
import { makeDisplay } from "./display.js";
import { bedParts } from "./bed.js";
import { checkParts } from "./check.js";
import { exportParts } from "./export.js";
import { another, facts, findPatches, patches, runButton, save, switchVolume } from "./look.js";
import { markParts } from "./mark.js";
import { openParts } from "./open.js";
import { panel, progress, stages, warnings } from "./parts.js";

/** @typedef {import("../state.js").State} State */

/** @param {HTMLElement} root */
export function makePanels(root) {
  const job = progress();
  /** @type {Record<string, import("./parts.js").Part>} */
  const panels = {
    open: panel("open", "1 Open", [...openParts(), facts(), save(), another()]),
    mark: panel("mark", "2 Mark", markParts()),
    segment: panel("segment", "3 Segment", [runButton("Segment", "segment"), findPatches(), patches(), warnings("segment")]),
    bed: panel("bed", "4 Bed", bedParts()),
    check: panel("check", "5 Check", checkParts()),
    export: panel("export", "6 Export", exportParts()),
  };
  const [shown, all, display] = [switchVolume(), stages(), makeDisplay()];
  root.append(job.root, ...Object.values(panels).map((one) => one.root), shown.root, all.root, display.root);
  return (/** @type {State} */ state) => {
    job.draw(state);
    for (const [step, one] of Object.entries(panels)) {
      one.root.hidden = step !== state.step;
      if (step === state.step) one.draw(state);
    }
    shown.draw(state);
    all.draw(state);
    display.draw(state);
  };
}
