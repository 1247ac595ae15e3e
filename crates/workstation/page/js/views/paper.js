// Views on paper: the sheet has another shape than the window, for which they were drawn.

/** What a view shows, as one picture that keeps its shape. @param {HTMLElement} view */
function pictureOf(view) {
  const box = view.getBoundingClientRect();
  const fine = window.devicePixelRatio;
  const picture = Object.assign(document.createElement("canvas"), { className: "on-paper", width: box.width * fine, height: box.height * fine });
  const pen = /** @type {CanvasRenderingContext2D} */ (picture.getContext("2d", { alpha: false }));
  pen.scale(fine, fine);
  pen.imageSmoothingQuality = "high";
  for (const layer of view.querySelectorAll("canvas")) {
    const at = layer.getBoundingClientRect();
    if (layer.hidden || layer.width === 0 || at.width === 0) continue;
    pen.drawImage(layer, at.left - box.left, at.top - box.top, at.width, at.height);
  }
  return picture;
}

/** Puts pictures of the views in their places while the page is printed. @param {() => NodeListOf<HTMLElement>} views */
export function printPictures(views) {
  window.addEventListener("beforeprint", () => {
    for (const view of views()) view.append(pictureOf(view));
  });
  window.addEventListener("afterprint", () => {
    for (const picture of document.querySelectorAll(".on-paper")) picture.remove();
  });
}
