// What is drawn above the voxels of a slice: outlines, spheres, crosshair, ruler, letters.
import { fixed } from "../dom.js";
import { length, minus, nearest, patientAxis, sameGrid } from "../geometry.js";
import { regionOf, tumourOf } from "../state.js";
import { handlesOf } from "../tools/handles.js";
import { linesIn } from "../planes.js";
import { drawApplicator } from "./applicator.js";
import { comparedWith, otherPane } from "./compare.js";
import { drawContours } from "./contours.js";
import { followedTumour } from "./followed.js";
import { outlinePaths } from "./lines.js";
import { depthOf, toScreenOf } from "./pane.js";
import { colours, drawBar, letter, stroke, swell, write } from "./pen.js";
import { patchedFor, previewAt, previewWord } from "./preview.js";
import { drawBrush, drawSeeds } from "./strokes.js";
import { labelColour } from "./voxels.js";

/** @typedef {import("./pane.js").Pane} Pane */
/** @typedef {import("../state.js").State} State */
/** @typedef {CanvasRenderingContext2D} Pen */

/** @param {import("../geometry.js").Grid} grid @param {number} axis @param {import("../geometry.js").Triple} place */
export function positionAlong(grid, axis, place) {
  const { n } = patientAxis(grid, axis);
  return `${"LPS"[n]} ${fixed(place[n])} mm`;
}

/** Labels belong to the CT, not to a volume on another grid or to the deformed one.
 * @param {State} state @param {Pane} pane */
export function labelsFor(state, pane) {
  const { labels } = state.voxels;
  return labels && !pane.held.grid.simulated && sameGrid(labels.grid, pane.held.grid) ? labels : null;
}

/** @param {Pen} pen @param {State} state @param {Pane} pane @param {number} fine */
function drawLabels(pen, state, pane, fine) {
  if (!state.lines) return;
  const finer = linesIn(state, pane);
  if (finer) return drawContours(pen, state, pane, finer, fine);
  const labels = labelsFor(state, pane);
  if (!labels) return;
  const { left, top, scale } = pane.frame;
  const names = labels.grid.names ?? {};
  // Soft tissue ends at the skin and at the wall: it has no line of its own.
  const inner = Object.keys(names).map(Number).filter((label) => names[label] !== "soft tissue");
  const paths = outlinePaths(labels, pane.view, pane.slice, [0, ...inner]);
  const wide = swell() / scale;
  pen.save();
  // The path is in mm: widths and dashes are divided by the scale.
  pen.setTransform(scale * fine, 0, 0, scale * fine, left * fine, top * fine);
  for (const [label, path] of paths) {
    const [r, g, b] = labelColour(names, label);
    const colour = label === 0 ? colours.skin : names[label] === "chest wall" ? colours.wall : `rgb(${r}, ${g}, ${b})`;
    stroke(pen, colour, 1.5 * wide, label === 0 ? [6 * wide, 4 * wide] : [], path);
  }
  pen.restore();
}

/** A sphere as the plane cuts it. @param {Pen} pen @param {Pane} pane @param {import("../state.js").Sphere} sphere
 * @param {string} colour @param {number[]} dashes */
function drawSphere(pen, pane, { centre_mm: centre, radius_mm: radius }, colour, dashes) {
  const square = radius * radius - depthOf(pane, centre) ** 2;
  if (square <= 0) return;
  const [x, y] = toScreenOf(pane, centre);
  const r = Math.sqrt(square) * pane.frame.scale;
  stroke(pen, colour, 1.8 * swell(), dashes.map((x) => x * swell()), () => pen.arc(x, y, r, 0, 2 * Math.PI));
}

/** @param {Pen} pen @param {State} state @param {Pane} pane */
function drawHandles(pen, state, pane) {
  const half = 4 * swell();
  for (const { what, at: [x, y] } of handlesOf(state, pane)) {
    stroke(pen, colours[what], 1.6 * swell(), [], () => pen.rect(x - half, y - half, 2 * half, 2 * half));
  }
}

/** @param {Pen} pen @param {State} state @param {Pane} pane */
function drawSpheres(pen, state, pane) {
  const region = regionOf(state);
  const tumour = tumourOf(state);
  if (region) drawSphere(pen, pane, region, colours.region, [2, 5]);
  // In the deformed CT this is where the tumour was, not where it is.
  const moved = pane.held.grid.simulated || patchedFor(state, pane);
  // Beside the place that a navigation has it would be a second one.
  if (tumour && !followedTumour(state)) drawSphere(pen, pane, tumour, colours.tumour, moved ? [6, 5] : []);
  drawHandles(pen, state, pane);
  const patch = state.server?.patches[state.patch];
  if (patch) {
    const radius_mm = Math.max(Math.sqrt((patch.area_cm2 * 100) / Math.PI), 3);
    drawSphere(pen, pane, { centre_mm: patch.centre_mm, radius_mm }, colours.uncertain, [1, 4]);
  }
}

/** @param {Pen} pen @param {State} state @param {Pane} pane */
function drawCrosshair(pen, state, pane) {
  if (!state.crosshair) return;
  const [x, y] = toScreenOf(pane, state.crosshair).map((a) => Math.round(a) + 0.5);
  const [width, height] = pane.box;
  const gap = 10;
  pen.globalAlpha = 0.65;
  pen.strokeStyle = colours.crosshair;
  pen.lineWidth = Math.max(1, Math.round(swell()));
  pen.beginPath();
  for (const [a, b, c, d] of [[0, y, x - gap, y], [x + gap, y, width, y], [x, 0, x, y - gap], [x, y + gap, x, height]]) {
    pen.moveTo(a, b);
    pen.lineTo(c, d);
  }
  pen.stroke();
  pen.globalAlpha = 1;
}

/** @param {Pen} pen @param {State} state @param {Pane} pane */
function drawRuler(pen, state, pane) {
  const { ruler } = state;
  if (!ruler || ruler.view !== pane.name || ruler.slice !== pane.slice) return;
  const [[a, b], [c, d]] = [toScreenOf(pane, ruler.from), toScreenOf(pane, ruler.to)];
  stroke(pen, colours.ruler, 1.6 * swell(), [], () => {
    pen.moveTo(a, b);
    pen.lineTo(c, d);
    for (const [x, y] of [[a, b], [c, d]]) {
      pen.moveTo(x + 3, y);
      pen.arc(x, y, 3, 0, 2 * Math.PI);
    }
  });
  write(pen, `${fixed(length(minus(ruler.to, ruler.from)))} mm`, c + 8, d - 8, "left", colours.ruler);
}

/** The word and the frame that keep a picture from being taken for the patient's present CT; `dashes` null: no frame.
 * @param {State} state @param {Pane} pane @returns {{word: string, colour: string, note?: string, dashes?: number[]|null}|null} `note`: below the word */
function standing(state, pane) {
  const other = comparedWith(state, pane);
  if (other && state.compare.way === "volume") return { word: `VOLUME CHANGE${other.grid.fresh === false ? ", OLD" : ""}`, colour: colours.simulated };
  if (other) {
    const [mine, theirs] = [pane.held, other].map(({ grid }) => `${grid.simulated ? "SIMULATED" : "CT"}${grid.fresh === false ? ", OLD" : ""}`);
    const [before, after] = pane.held.grid.simulated ? [theirs, mine] : [mine, theirs];
    const words = { curtain: `${mine} | ${theirs}`, blend: `${mine} + ${theirs}`, difference: `${after} \u2212 ${before}` };
    return { word: /** @type {Record<string, string>} */ (words)[state.compare.way], colour: colours.simulated };
  }
  const live = previewWord(state, pane);
  if (live) return { ...live, colour: live.framed ? colours.simulated : colours.text, dashes: live.framed ? [14, 10] : null };
  const { simulated, fresh } = pane.held.grid;
  if (simulated && fresh === false) return { word: "SIMULATED, OLD", colour: colours.old };
  if (simulated) return { word: "SIMULATED", colour: colours.simulated };
  if (fresh === false) return { word: "OLD", colour: colours.old };
  const labels = labelsFor(state, pane);
  if (labels?.grid.fresh === false && (state.lines || state.overlays)) {
    // Labels that follow a stroke at once would make a frame flash.
    return { word: "LABELS OLD", colour: colours.old, dashes: state.server?.live?.following ? null : [] };
  }
  return null;
}

/** @param {Pen} pen @param {State} state @param {Pane} pane */
function dress(pen, state, pane) {
  const [width, height] = pane.box;
  const [left, right, top, bottom] = pane.view.letters;
  const size = letter();
  pen.font = `bold ${size}px system-ui, sans-serif`;
  write(pen, left, 7, height / 2 + size * 0.35, "left");
  write(pen, right, width - 7, height / 2 + size * 0.35, "right");
  write(pen, top, width / 2, size * 1.2, "center");
  write(pen, bottom, width / 2, height - 7, "center");
  pen.font = `${size * 0.88}px system-ui, sans-serif`;
  const place = state.crosshair ? positionAlong(pane.held.grid, pane.view.normal, state.crosshair) : "";
  const axis = "ijk"[pane.view.normal];
  const name = pane.name[0].toUpperCase() + pane.name.slice(1);
  write(pen, `${name}  ${axis} ${pane.slice} \u00b7 ${place}`, 8, size * 1.2, "left");
  const word = standing(state, pane);
  if (word) {
    pen.strokeStyle = word.colour;
    pen.lineWidth = 10;
    pen.setLineDash(word.dashes ?? []);
    if (word.dashes !== null) pen.strokeRect(0, 0, width, height);
    pen.setLineDash([]);
    pen.font = `bold ${size}px system-ui, sans-serif`;
    write(pen, word.word, width - 10, size * 1.3, "right", word.colour);
  }
  pen.font = `${size * 0.88}px system-ui, sans-serif`;
  if (word?.note) write(pen, word.note, width - 10, size * 2.5, "right", word.colour);
  drawBar(pen, pane, size);
}

/** Outlines and spheres of one volume. @param {Pen} pen @param {State} state @param {Pane} pane @param {number} fine */
function drawPatient(pen, state, pane, fine) {
  // The lines are those of the CT as it was acquired.
  if (!patchedFor(state, pane)) drawLabels(pen, state, pane, fine);
  pen.font = `${letter()}px system-ui, sans-serif`;
  if (state.lines) drawSpheres(pen, state, pane);
}

/** The part of a pane between two shares of its width. @param {Pen} pen @param {Pane} pane @param {number} from @param {number} to
 * @param {() => void} draw */
function within(pen, { box: [width, height] }, from, to, draw) {
  pen.save();
  pen.beginPath();
  pen.rect(from * width, 0, (to - from) * width, height);
  pen.clip();
  draw();
  pen.restore();
}

/** Under a curtain each side has the lines of what it shows: the tumour of the CT is not that of the simulated one.
 * @param {Pen} pen @param {State} state @param {Pane} pane @param {number} fine */
function drawPatients(pen, state, pane, fine) {
  const other = otherPane(state, pane);
  if (!other) return drawPatient(pen, state, pane, fine);
  if (state.compare.way === "curtain") {
    within(pen, pane, 0, state.compare.share, () => drawPatient(pen, state, pane, fine));
    return within(pen, pane, state.compare.share, 1, () => drawPatient(pen, state, other, fine));
  }
  drawPatient(pen, state, pane, fine);
  // Both are one picture: where the tumour is in the other, too.
  const lines = state.lines ? linesIn(state, other)?.filter(({ name }) => name === "tumour") : null;
  if (lines) drawContours(pen, state, other, lines, fine);
}

/** @param {Pen} pen scaled to CSS pixels @param {State} state @param {Pane} pane @param {number} fine device pixels a CSS pixel */
export function drawOverlay(pen, state, pane, fine) {
  drawPatients(pen, state, pane, fine);
  pen.font = `${letter()}px system-ui, sans-serif`;
  drawSeeds(pen, state, pane, fine);
  drawApplicator(pen, state, pane);
  drawCrosshair(pen, state, pane);
  drawRuler(pen, state, pane);
  drawBrush(pen, state, pane);
  dress(pen, state, pane);
}

/** What stands at a place: HU and label. @param {State} state @param {import("../state.js").Held} held
 * @param {import("../geometry.js").Triple} place */
export function readAt(state, held, place) {
  const at = nearest(held.grid, place);
  const n = at[0] + held.grid.size[0] * (at[1] + held.grid.size[1] * at[2]);
  const live = held.grid.id === "ct" ? previewAt(state, at) : undefined;
  const hu = live ?? (n < held.arrived ? held.voxels[n] : null);
  if (live !== undefined) return { hu, label: "preview" };
  const { labels } = state.voxels;
  const usable = labels && !held.grid.simulated && sameGrid(labels.grid, held.grid) && n < labels.arrived;
  const label = usable ? labels.grid.names?.[labels.voxels[n]] ?? "outside" : null;
  return { hu, label: held.grid.simulated ? "simulated CT" : label };
}
