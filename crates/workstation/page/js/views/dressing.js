// What is written over the 3D view: the patient's directions, scales with their numbers, and which shape it is.
import { isShown } from "../applicator.js";
import { shownVolume } from "../state.js";
import { drawnParts, kindOf, rampColour, scaleEnd, shapeOf } from "./cast.js";
import { followedColour, followedTumour, followedWord } from "./followed.js";
import { colours, letter, write } from "./pen.js";

/** @typedef {import("../state.js").State} State */
/** @typedef {CanvasRenderingContext2D} Pen */

/** The patient's directions at the ends of a small cross. @param {Pen} pen @param {import("./bodies.js").Eye} eye @param {[number, number]} box */
function drawLetters(pen, eye, [width, height]) {
  const size = letter();
  const reach = 2 * size;
  const [x, y] = [width - reach - 1.7 * size, height - reach - 1.6 * size];
  pen.font = `bold ${size * 0.9}px system-ui, sans-serif`;
  ["LR", "PA", "HF"].forEach((pair, a) => {
    const [dx, dy] = [eye.right[a] * reach, -eye.up[a] * reach];
    pen.strokeStyle = "#8793a3";
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(x - dx, y - dy);
    pen.lineTo(x + dx, y + dy);
    pen.stroke();
    [1, -1].forEach((sign, n) => {
      // A direction that points away from the eye is written paler.
      pen.globalAlpha = sign * eye.forward[a] > 0.3 ? 0.45 : 1;
      if (Math.hypot(dx, dy) > size * 0.7) write(pen, pair[n], x + 1.25 * sign * dx, y + 1.25 * sign * dy + size * 0.32, "center");
      pen.globalAlpha = 1;
    });
  });
}

/** A scale above the bottom on the left. @param {Pen} pen @param {number} low CSS pixels from the top @param {string} kind
 * @param {string} title @param {string[]} ends numbers at its beginning and end */
function drawScale(pen, low, kind, title, ends) {
  const size = letter() * 0.84;
  const [left, wide, high] = [10, size * 9, size * 0.7];
  pen.font = `${size}px system-ui, sans-serif`;
  for (let x = 0; x < wide; x++) {
    pen.fillStyle = `rgb(${rampColour(kind, x / wide).join(", ")})`;
    pen.fillRect(left + x, low - size * 1.2 - high, 1.5, high);
  }
  write(pen, title, left, low - size * 2.4, "left");
  write(pen, ends[0], left, low, "left");
  write(pen, ends[1], left + wide, low, "right");
}

/** @param {Pen} pen @param {State} state @param {number} height */
function drawScales(pen, state, height) {
  const all = drawnParts(state);
  const of = (/** @type {string} */ kind) => all.filter(([part, one]) => kindOf(part, one) === kind).map(([, one]) => one);
  const [arrows, scans] = [of("displacement"), of("scan")];
  let low = height - 12;
  if (arrows.length > 0) {
    drawScale(pen, low, "displacement", "Tissue displacement", ["0", `${scaleEnd(arrows)} mm`]);
    low -= letter() * 4.2;
  }
  if (scans.length > 0) drawScale(pen, low, "scan", "Scan to skin", [`\u2212${scaleEnd(scans)}`, `+${scaleEnd(scans)} mm`]);
}

/** The applicator is drawn among surfaces that do not follow it. @param {Pen} pen @param {[number, number]} box @param {boolean} some
 * @param {boolean} simulated as on the table */
function markPreview(pen, box, some, simulated) {
  const size = letter();
  pen.strokeStyle = colours.simulated;
  pen.lineWidth = 10;
  pen.setLineDash([14, 10]);
  pen.strokeRect(0, 0, ...box);
  pen.setLineDash([]);
  pen.font = `bold ${size}px system-ui, sans-serif`;
  write(pen, "PREVIEW", box[0] - 10, size * 1.3, "right", colours.simulated);
  pen.font = `${size * 0.88}px system-ui, sans-serif`;
  const note = simulated ? "surfaces without the applicator" : "surfaces as in the CT";
  if (some) write(pen, note, box[0] - 10, size * 2.5, "right", colours.simulated);
}

/** @param {Pen} pen @param {State} state @param {import("./bodies.js").Eye} eye @param {[number, number]} box @param {boolean} some bodies are there */
export function dressScene(pen, state, eye, box, some) {
  const size = letter();
  drawLetters(pen, eye, box);
  drawScales(pen, state, box[1]);
  const simulated = some && shapeOf(state) === "deformed";
  pen.font = `${size * 0.88}px system-ui, sans-serif`;
  write(pen, !some ? "3D" : simulated ? "3D \u00b7 on the operating table" : "3D \u00b7 as in the CT", 8, size * 1.2, "left");
  if (isShown(state)) {
    const followed = followedTumour(state);
    if (followed) write(pen, followedWord(followed), 8, size * 2.5, "left", followedColour(followed));
    return markPreview(pen, box, some, simulated);
  }
  if (!simulated) return;
  const old = shownVolume(state)?.grid.fresh === false;
  const colour = old ? colours.old : colours.simulated;
  pen.strokeStyle = colour;
  pen.lineWidth = 10;
  pen.strokeRect(0, 0, ...box);
  pen.font = `bold ${size}px system-ui, sans-serif`;
  write(pen, old ? "SIMULATED, OLD" : "SIMULATED", box[0] - 10, size * 1.3, "right", colour);
}
