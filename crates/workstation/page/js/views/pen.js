// Lines and words that can be read on any grey: each has a dark rim.

/** Those of what the report shows too are the report's; a test holds them to its palette. */
export const colours = {
  wall: "#ec6214", skin: "#40d4ff", region: "#ececec", tumour: "#ffe233", crosshair: "#f0f0f0", ruler: "#8cff9a",
  text: "#f0f0f0", simulated: "#ff48ac", old: "#a8a8a8", uncertain: "#ffffff",
};

/** @typedef {CanvasRenderingContext2D} Pen */

let size = 0;
addEventListener("resize", () => { size = 0; });

/** The size of the page's letters, CSS pixels: the canvas writes as large as the page. */
export function letter() {
  if (size === 0) size = parseFloat(getComputedStyle(document.documentElement).fontSize);
  return size;
}

/** How much wider than on a small screen lines are. */
export const swell = () => letter() / 13.5;

/**
 * @param {Pen} pen @param {string} colour @param {number} width @param {number[]} dashes
 * @param {Path2D|(() => void)} what a path, or a function that traces one
 */
export function stroke(pen, colour, width, dashes, what) {
  pen.lineJoin = "round";
  for (const [style, wide] of /** @type {[string, number][]} */ ([["rgba(0, 0, 0, 0.55)", width * 2.2], [colour, width]])) {
    pen.strokeStyle = style;
    pen.lineWidth = wide;
    pen.setLineDash(dashes);
    if (typeof what === "function") {
      pen.beginPath();
      what();
      pen.stroke();
    } else {
      pen.stroke(what);
    }
  }
  pen.setLineDash([]);
}

/** @param {Pen} pen @param {string} text @param {number} x @param {number} y
 * @param {CanvasTextAlign} align @param {string} [colour] */
export function write(pen, text, x, y, align, colour = colours.text) {
  pen.textAlign = align;
  pen.lineWidth = 3;
  pen.lineJoin = "round";
  pen.strokeStyle = "rgba(0, 0, 0, 0.8)";
  pen.fillStyle = colour;
  pen.strokeText(text, x, y);
  pen.fillText(text, x, y);
}

/** A bar of a round length, a fifth of the pane at most. @param {Pen} pen @param {import("./pane.js").Pane} pane @param {number} size */
export function drawBar(pen, pane, size) {
  const [width, height] = pane.box;
  const bar = [100, 50, 20, 10, 5, 2, 1].find((mm) => mm * pane.frame.scale < width / 4) ?? 1;
  const [end, level] = [width - 10, height - 10];
  const start = end - bar * pane.frame.scale;
  stroke(pen, colours.text, 1.6 * swell(), [], () => {
    pen.moveTo(start, level - 4);
    pen.lineTo(start, level);
    pen.lineTo(end, level);
    pen.lineTo(end, level - 4);
  });
  write(pen, `${bar} mm`, (start + end) / 2, level - 6 - size * 0.1, "center");
}
