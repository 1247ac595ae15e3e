// Panes, and what brings them elsewhere.
// All three views side by side, or one; the simulated CT below or beside the CT.
function layOut(wide) {
  const views = data.views.filter((v) => state.plane === "all" || state.plane === v.name);
  const shows = state.show === "both" ? ["before", "after"] : [state.show];
  const columns = views.length > 1 ? views.length : shows.length;
  const gap = 4;
  const side = Math.min((wide - gap * (columns - 1)) / columns, Math.max(320, window.innerHeight - 120));
  const scale = (side / (step * size)) * state.zoom;
  panes = shows.flatMap((show) => views.map((view) => ({ view, show }))).map((pane, n) => ({
    ...pane, scale, width: side, height: side,
    x: (n % columns) * (side + gap), y: Math.floor(n / columns) * (side + gap),
  }));
  return Math.ceil(panes.length / columns) * (side + gap) - gap;
}

function drawPane(pane) {
  pen.save();
  pen.beginPath();
  pen.rect(pane.x, pane.y, pane.width, pane.height);
  pen.clip();
  pen.fillStyle = colours.nothing;
  pen.fillRect(pane.x, pane.y, pane.width, pane.height);
  const slice = drawSlice(pane);
  drawRing(pane, region.centre_mm, region.radius_mm, colours.region, [4, 6]);
  if (on("skin")) drawFaces(pane, faces.skin, colours.skin);
  if (on("cut")) drawFaces(pane, faces.cut, colours.cut);
  if (on("wall")) drawWall(pane, slice);
  if (on("tumour")) drawTumour(pane);
  drawCrosshair(pane);
  dress(pane);
  pen.restore();
}

function draw() {
  drawing = false;
  const wide = canvas.parentElement.clientWidth;
  // On paper the viewer is not laid out.
  if (wide === 0) return;
  const high = layOut(wide);
  const fine = window.devicePixelRatio || 1;
  [canvas.width, canvas.height] = [Math.round(wide * fine), Math.round(high * fine)];
  canvas.style.height = `${high}px`;
  pen.setTransform(fine, 0, 0, fine, 0, 0);
  panes.forEach(drawPane);
  root.querySelector("output").textContent = `LPS ${state.at.map(fixed).join(", ")} mm`;
  root.querySelectorAll("[data-axis]").forEach((slider) => { slider.value = state.at[slider.dataset.axis]; });
  root.querySelectorAll("[data-set]").forEach((button) => {
    const [name, value] = button.dataset.set.split("=");
    button.setAttribute("aria-pressed", state[name] === value);
  });
}

let drawing = false;
function redraw() {
  if (volumes && !drawing) requestAnimationFrame(draw);
  drawing = drawing || volumes !== null;
}

function fixed(x) {
  const text = x.toFixed(1);
  return text === "-0.0" ? "0.0" : text;
}

function moveTo(p) {
  state.at = p.map((x, a) => Math.min(Math.max(x, origin[a]), last[a]));
  redraw();
}

function scroll(view, steps) {
  const p = [...state.at];
  p[view.axis] += steps * step;
  moveTo(p);
}

// The place stays where it is seen.
function zoomAbout(p, factor) {
  const zoom = Math.min(Math.max(state.zoom * factor, 1), 12);
  state.middle = zoom === 1 ? [...region.centre_mm] : add(p, away(state.middle, p), state.zoom / zoom);
  state.zoom = zoom;
  redraw();
}

function paneAt(event) {
  const box = canvas.getBoundingClientRect();
  const at = [event.clientX - box.left, event.clientY - box.top];
  const inside = (p) => at[0] >= p.x && at[0] < p.x + p.width && at[1] >= p.y && at[1] < p.y + p.height;
  return { at, pane: panes.find(inside) };
}

let held = null;
canvas.addEventListener("pointerdown", (event) => {
  const { at, pane } = paneAt(event);
  if (!pane || event.button !== 0) return;
  held = { pane, from: at, at, moved: false };
  wheeled = pane.view;
  canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener("pointermove", (event) => {
  if (!held) return;
  const { at } = paneAt(event);
  held.moved = held.moved || Math.hypot(at[0] - held.from[0], at[1] - held.from[1]) > 3;
  if (held.moved) {
    const { view, scale } = held.pane;
    const middle = add(state.middle, view.right, (held.at[0] - at[0]) / scale);
    state.middle = add(middle, view.down, (held.at[1] - at[1]) / scale);
    redraw();
  }
  held.at = at;
});
canvas.addEventListener("pointerup", () => {
  if (held && !held.moved) moveTo(place(held.pane, held.at));
  held = null;
});
canvas.addEventListener("pointercancel", () => { held = null; });
canvas.addEventListener("wheel", (event) => {
  const { at, pane } = paneAt(event);
  if (!pane) return;
  event.preventDefault();
  wheeled = pane.view;
  if (event.ctrlKey) zoomAbout(place(pane, at), event.deltaY < 0 ? 1.2 : 1 / 1.2);
  else if (event.deltaY !== 0) scroll(pane.view, event.deltaY < 0 ? 1 : -1);
}, { passive: false });
canvas.addEventListener("keydown", (event) => {
  const does = {
    ArrowUp: () => scroll(wheeled, 1), ArrowDown: () => scroll(wheeled, -1),
    "+": () => zoomAbout(state.at, 1.25), "-": () => zoomAbout(state.at, 0.8), 0: () => zoomAbout(state.at, 0),
    b: () => { state.show = state.show === "before" ? "after" : "before"; redraw(); },
  }[event.key];
  if (!does || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  does();
});

root.addEventListener("input", (event) => {
  const { axis } = event.target.dataset;
  if (axis === undefined) return redraw();
  const p = [...state.at];
  p[axis] = Number(event.target.value);
  moveTo(p);
});
root.addEventListener("click", (event) => {
  const { set, zoom } = event.target.dataset;
  if (zoom) zoomAbout(state.at, Number(zoom));
  if (!set) return;
  const [name, value] = set.split("=");
  state[name] = value;
  redraw();
});

function numbers(text) {
  const p = (text || "").split(",").map(Number);
  return p.length === 3 && p.every(Number.isFinite) ? p : null;
}

// Anything in the page with a place brings the viewer there.
document.addEventListener("click", (event) => {
  const button = event.target.closest("[data-at]");
  const p = button && numbers(button.dataset.at);
  if (!p) return;
  moveTo(p);
  if (state.zoom > 1) state.middle = [...state.at];
  root.scrollIntoView({ block: "nearest" });
});

// `#at=1.0,2.0,3.0&show=after&plane=axial&zoom=2` in the page's address.
function fromAddress() {
  const asked = new URLSearchParams(location.hash.slice(1));
  const p = numbers(asked.get("at"));
  if (p) moveTo(p);
  if (["before", "after", "both"].includes(asked.get("show"))) state.show = asked.get("show");
  if (["all", ...data.views.map((v) => v.name)].includes(asked.get("plane"))) state.plane = asked.get("plane");
  if (Number(asked.get("zoom")) > 0) zoomAbout(state.at, Number(asked.get("zoom")) / state.zoom);
  redraw();
}

root.querySelectorAll("[data-axis]").forEach((slider) => {
  [slider.min, slider.max] = [origin[slider.dataset.axis], last[slider.dataset.axis]];
});
window.addEventListener("resize", redraw);
window.addEventListener("hashchange", fromAddress);

Promise.all([data.sheets.before, data.sheets.change, data.sheets.wall].map(decoded))
  .then(([before, change, wall]) => {
    // Bytes wrap round, as they did when the change was taken.
    volumes = { before, after: change.map((byte, n) => byte + before[n]), wall };
    document.documentElement.classList.add("live");
    fromAddress();
  })
  .catch((error) => { root.querySelector(".failed").textContent = `No slices: ${error.message}. The still pictures are below.`; });
