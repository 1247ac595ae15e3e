// Small drawings of lines: a dose-volume plot, and a line of the legend. Their ground is as dark as that of the views, whose
// colours they have.
import { fixed, graphic } from "../dom.js";
import { colours } from "../views/pen.js";

/** @typedef {import("../state.js").Curve} Curve */
/** @typedef {import("../state.js").Histogram & {colour: string}} Plotted */
/** @typedef {{x: (gy: number) => number, y: (share: number) => number}} Scales */

const [width, height] = [300, 186];
const frame = { left: 42, right: 288, top: 12, bottom: 142 };

/** How a line is drawn in the views. @param {string} colour @param {number[]} dashes */
export const swatch = (colour, dashes) => graphic("svg", { class: "swatch", viewBox: "0 0 24 10", "aria-hidden": "true" },
  graphic("line", { x1: 2, y1: 5, x2: 22, y2: 5, stroke: colour, "stroke-width": 2, "stroke-dasharray": dashes.join(" ") || null }));

/** From 0 to a round number of Gy that no curve passes. @param {Plotted[]} all @returns {number[]} */
function ticksOf(all) {
  const most = Math.max(0, ...all.flatMap(({ before, after }) => [before.max_gy, after?.max_gy ?? 0]));
  const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20].find((gy) => 6 * gy >= most) ?? 50;
  return Array.from({ length: Math.max(1, Math.ceil(most / step)) + 1 }, (_, n) => n * step);
}

/** @param {number} end Gy @returns {Scales} */
const scalesTo = (end) => ({
  x: (gy) => frame.left + (gy / end) * (frame.right - frame.left),
  y: (share) => frame.bottom - share * (frame.bottom - frame.top),
});

/** @param {Scales} scales @param {number[]} ticks Gy */
function axes({ x, y }, ticks) {
  const rule = (/** @type {number[]} */ [x1, y1, x2, y2]) => graphic("line", { class: "rule", x1, y1, x2, y2 });
  const word = (/** @type {number} */ left, /** @type {number} */ low, /** @type {string} */ anchor, /** @type {string} */ text) =>
    graphic("text", { x: left, y: low, "text-anchor": anchor }, text);
  const middle = (frame.top + frame.bottom) / 2;
  return [
    ...[0, 0.5, 1].flatMap((share) => [rule([frame.left, y(share), frame.right, y(share)]),
      word(frame.left - 5, y(share) + 4, "end", String(100 * share))]),
    ...ticks.flatMap((gy) => [rule([x(gy), frame.bottom, x(gy), frame.bottom + 4]),
      word(x(gy), frame.bottom + 17, "middle", String(Number(gy.toFixed(1))))]),
    word((frame.left + frame.right) / 2, height - 8, "middle", "dose, Gy"),
    graphic("text", { "text-anchor": "middle", transform: `translate(12 ${middle}) rotate(-90)` }, "volume, %"),
  ];
}

/** A curve, which ends where the dose does. @param {Scales} scales @param {Curve} curve @param {number} step Gy @param {string} colour
 * @param {string|null} dashes @param {string} title */
function curveLine({ x, y }, { shares, max_gy: most }, step, colour, dashes, title) {
  const all = [...shares.map((share, n) => [n * step, share]).filter(([gy]) => gy <= most), [most, 0]];
  const points = all.map(([gy, share]) => `${x(gy).toFixed(1)},${y(share).toFixed(1)}`).join(" ");
  return graphic("polyline", { points, stroke: colour, "stroke-dasharray": dashes }, graphic("title", {}, title));
}

/** @param {Plotted[]} all of one dose @param {boolean} fresh whether what is after is of what is given now */
export function plot(all, fresh) {
  const ticks = ticksOf(all);
  const scales = scalesTo(ticks[ticks.length - 1]);
  const name = `Dose-volume plot of ${all.map(({ region }) => region).join(", ")}: the dose up to ${fixed(ticks[ticks.length - 1])} Gy`;
  return graphic("svg", { class: "plot", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": name }, ...axes(scales, ticks),
    ...all.flatMap(({ region, after, step_gy: step, colour }) => (after
      ? [curveLine(scales, after, step, fresh ? colour : colours.old, null, `${region}, after`)] : [])),
    ...all.map(({ region, before, step_gy: step, colour }) => curveLine(scales, before, step, colour, "4 3", `${region}, before`)));
}
