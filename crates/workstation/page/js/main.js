// Puts the page together: events change the state, a change asks for one drawing.
import { followCase, placeCrosshair } from "./actions.js";
import { followFocus, keepFocus } from "./focus.js";
import { makeHelp } from "./help.js";
import { listenKeys } from "./keys.js";
import { follow as followLink, takeToken } from "./link.js";
import { followTilt } from "./live.js";
import { followTracker } from "./navigation.js";
import { followPlanes } from "./planes.js";
import { drawShell, makeHeader, speak, useTheme } from "./shell.js";
import { change, follow, now, planes } from "./state.js";
import { makePanels } from "./steps/panels.js";
import { followSeeds } from "./tools/seeds.js";
import { printPictures } from "./views/paper.js";
import { makeScene } from "./views/scene.js";
import { makeSlice } from "./views/slice.js";
import { followServer } from "./volumes.js";

const look = "supine-look";

/** What the user chose of the looks outlives a reload, nothing else does. */
function restoreLook() {
  useTheme(sessionStorage.getItem("supine-theme"));
  try {
    const { window: chosen, smooth, overlays, lines } = JSON.parse(sessionStorage.getItem(look) ?? "{}");
    if (chosen) change({ window: chosen, smooth, overlays, lines });
  } catch {
    sessionStorage.removeItem(look);
  }
}

function keepLook() {
  const { window: chosen, smooth, overlays, lines } = now();
  sessionStorage.setItem(look, JSON.stringify({ window: chosen, smooth, overlays, lines }));
}

/** @param {{draw: (state: import("./state.js").State) => void}[]} views @param {(state: import("./state.js").State) => void} drawPanels */
function drawOnChange(views, drawPanels) {
  let asked = false;
  const draw = () => {
    asked = false;
    const state = now();
    document.body.dataset.focus = state.focus;
    document.getElementById("views")?.classList.toggle("large", state.large !== null);
    drawShell(state);
    drawPanels(state);
    views.forEach((view) => view.draw(state));
    keepFocus();
  };
  // Events come faster than the screen: each picture is drawn once, of the newest state.
  const ask = () => {
    if (!asked) requestAnimationFrame(draw);
    asked = true;
  };
  follow(ask);
  ask();
}

function start() {
  takeToken();
  restoreLook();
  printPictures(() => document.querySelectorAll(".view"));
  const help = makeHelp();
  makeHeader(help);
  const views = [...planes.map(makeSlice), makeScene()];
  document.getElementById("views")?.append(...views.map((view) => view.root));
  const drawPanels = makePanels(/** @type {HTMLElement} */ (document.getElementById("panel")));
  if (matchMedia("(max-width: 999px)").matches) change({ panel: false });
  drawOnChange(views, drawPanels);
  follow(followCase);
  follow(followServer);
  follow(followSeeds);
  follow(followTracker);
  follow(followTilt);
  follow(followPlanes);
  follow((state, before) => {
    if (state.voxels !== before.voxels || state.show !== before.show) placeCrosshair(state);
    speak(state, before);
  });
  listenKeys(help);
  followFocus();
  addEventListener("pagehide", keepLook);
  // A new address in the same tab differs in its key alone, and the browser would not load the page again.
  addEventListener("hashchange", () => {
    takeToken();
    location.reload();
  });
  followLink();
}

start();
