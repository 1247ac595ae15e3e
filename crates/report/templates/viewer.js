"use strict";
// The slice viewer. Positions are LPS, mm; spots are pixels of the canvas, x to the right, y down. A pane shows one view of
// one CT; all panes share the crosshair, the zoom and what lies in their middle.
(() => {
  const root = document.getElementById("viewer");
  const data = JSON.parse(document.getElementById("viewer-data").textContent);
  const canvas = root.querySelector("canvas");
  const pen = canvas.getContext("2d");
  const { size, step_mm: step, origin_mm: origin, region, colours } = data;
  const strides = [1, size, size * size];
  const last = origin.map((o) => o + step * (size - 1));
  const state = { at: [...data.focus_mm], middle: [...region.centre_mm], zoom: 1, show: "both", plane: "all" };
  const on = (name) => root.querySelector(`[name=${name}]`).checked;
  let volumes = null;
  let panes = [];
  let wheeled = data.views[0];

  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const add = (p, v, t) => p.map((x, a) => x + t * v[a]);
  const away = (p, from) => add(p, from, -1);

  // The bytes of all voxels from a sheet of slices.
  function decoded(png) {
    return new Promise((done, failed) => {
      const image = new Image();
      image.onload = () => {
        const sheet = document.createElement("canvas");
        [sheet.width, sheet.height] = [image.width, image.height];
        const context = sheet.getContext("2d", { willReadFrequently: true });
        context.drawImage(image, 0, 0);
        const rgba = context.getImageData(0, 0, image.width, image.height).data;
        const voxels = new Uint8Array(size ** 3);
        for (let line = 0; line < size * size; line++) {
          const k = Math.floor(line / size);
          const y = Math.floor(k / data.columns) * size + (line % size);
          const from = y * image.width + (k % data.columns) * size;
          for (let i = 0; i < size; i++) voxels[line * size + i] = rgba[4 * (from + i)];
        }
        done(voxels);
      };
      image.onerror = () => failed(new Error("a sheet of slices cannot be decoded"));
      image.src = "data:image/png;base64," + png;
    });
  }

  function unpacked(text, Numbers) {
    return new Numbers(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  }

  const { unit_mm: unit } = data.surface;
  const corners = { before: unpacked(data.surface.before, Int16Array), after: unpacked(data.surface.after, Int16Array) };
  const faces = { skin: unpacked(data.surface.skin, Uint32Array), cut: unpacked(data.surface.cut, Uint32Array) };

  // Where the voxels of a view's slice lie: the first one, and the way to the next on the right and below.
  function walk(view) {
    const way = (v) => v.reduce((sum, x, a) => sum + x * strides[a], 0);
    const first = [0, 1, 2].map((a) => (view.right[a] + view.down[a] < 0 ? size - 1 : 0));
    return { first, right: way(view.right), down: way(view.down) };
  }

  // Calls visit(pixel, one, other, share) for each pixel of the slice at the crosshair, which lies between two voxels.
  function overSlice(view, visit) {
    const depth = Math.min(Math.max((state.at[view.axis] - origin[view.axis]) / step, 0), size - 1);
    const k = Math.min(Math.floor(depth), size - 2);
    const { first, right, down } = walk(view);
    const start = dot(first, strides) + k * strides[view.axis];
    for (let n = 0; n < size * size; n++) {
      const voxel = start + (n % size) * right + Math.floor(n / size) * down;
      visit(n, voxel, voxel + strides[view.axis], depth - k);
    }
  }

  function spot(pane, p) {
    const d = away(p, state.middle);
    return [pane.x + pane.width / 2 + pane.scale * dot(pane.view.right, d),
      pane.y + pane.height / 2 + pane.scale * dot(pane.view.down, d)];
  }

  function place(pane, [x, y]) {
    const across = add(state.middle, pane.view.right, (x - pane.x - pane.width / 2) / pane.scale);
    const p = add(across, pane.view.down, (y - pane.y - pane.height / 2) / pane.scale);
    p[pane.view.axis] = state.at[pane.view.axis];
    return p;
  }

  function strokePath(colour, width, dashes, trace) {
    for (const [style, wide] of [["rgba(0, 0, 0, 0.6)", width + 2], [colour, width]]) {
      pen.strokeStyle = style;
      pen.lineWidth = wide;
      pen.setLineDash(dashes);
      pen.beginPath();
      trace();
      pen.stroke();
    }
    pen.setLineDash([]);
  }

  function strokeSegments(segments, colour, width) {
    strokePath(colour, width, [], () => segments.forEach(([a, b]) => {
      pen.moveTo(...a);
      pen.lineTo(...b);
    }));
  }

  // The slice in grey; gives the spot of the middle of its first pixel, and the distance of pixels.
  function drawSlice(pane) {
    const volume = volumes[pane.show];
    const tile = document.createElement("canvas");
    tile.width = tile.height = size;
    const context = tile.getContext("2d");
    const picture = context.createImageData(size, size);
    overSlice(pane.view, (n, a, b, share) => {
      const grey = volume[a] + (volume[b] - volume[a]) * share;
      picture.data.set([grey, grey, grey, 255], 4 * n);
    });
    context.putImageData(picture, 0, 0);
    const { first } = walk(pane.view);
    const [x, y] = spot(pane, first.map((i, a) => origin[a] + i * step));
    const pixel = step * pane.scale;
    pen.drawImage(tile, x - pixel / 2, y - pixel / 2, size * pixel, size * pixel);
    return { x, y, pixel };
  }

  // The boundary of the chest wall where half of it is wall, by marching squares; light where it is uncertain.
  function drawWall(pane, { x: left, y: top, pixel }) {
    const share = new Float32Array(size * size);
    const unsure = new Uint8Array(size * size);
    const wall = volumes.wall;
    overSlice(pane.view, (n, a, b, t) => {
      const [one, other] = [wall[a] % data.uncertain, wall[b] % data.uncertain];
      share[n] = one + (other - one) * t - data.whole / 2;
      unsure[n] = wall[a] >= data.uncertain || wall[b] >= data.uncertain ? 1 : 0;
    });
    const lines = [[], []];
    for (let n = 0; n < size * (size - 1); n++) {
      if (n % size === size - 1) continue;
      const ring = [n, n + 1, n + size + 1, n + size];
      const ends = [];
      ring.forEach((a, side) => {
        const b = ring[(side + 1) % 4];
        if (share[a] > 0 === share[b] > 0) return;
        const t = share[a] / (share[a] - share[b]);
        const mix = (of) => of(a) + t * (of(b) - of(a));
        ends.push([left + pixel * mix((m) => m % size), top + pixel * mix((m) => Math.floor(m / size))]);
      });
      for (let e = 0; e + 1 < ends.length; e += 2) lines[unsure[n]].push([ends[e], ends[e + 1]]);
    }
    strokeSegments(lines[0], colours.wall, 1.5);
    strokeSegments(lines[1], colours.uncertain, 2.5);
  }

  // The lines in which the plane cuts triangles of the mesh's boundary.
  function drawFaces(pane, triangles, colour) {
    const at = corners[pane.show];
    const { axis } = pane.view;
    const depth = (c) => at[3 * c + axis] * unit + region.centre_mm[axis] - state.at[axis];
    const corner = (c) => [0, 1, 2].map((a) => at[3 * c + a] * unit + region.centre_mm[a]);
    const segments = [];
    for (let n = 0; n < triangles.length; n += 3) {
      const three = [triangles[n], triangles[n + 1], triangles[n + 2]];
      const deep = three.map(depth);
      if (deep[0] >= 0 === deep[1] >= 0 && deep[1] >= 0 === deep[2] >= 0) continue;
      const ends = [];
      for (let a = 0; a < 3; a++) {
        const b = (a + 1) % 3;
        if (deep[a] >= 0 === deep[b] >= 0) continue;
        const [p, q] = [corner(three[a]), corner(three[b])];
        ends.push(spot(pane, add(p, away(q, p), deep[a] / (deep[a] - deep[b]))));
      }
      segments.push(ends);
    }
    strokeSegments(segments, colour, 1.5);
  }

  function drawRing(pane, centre, radius, colour, dashes) {
    const depth = centre[pane.view.axis] - state.at[pane.view.axis];
    const square = radius * radius - depth * depth;
    if (square <= 0) return;
    const [x, y] = spot(pane, centre);
    const r = Math.sqrt(square) * pane.scale;
    strokePath(colour, 1.8, dashes, () => {
      pen.moveTo(x + r, y);
      pen.arc(x, y, r, 0, 2 * Math.PI);
    });
  }

  // The outline of the ellipsoid in which the tumour's centre lies, seen along the view's axis.
  function drawWithin(pane, { centre_mm: centre, semi_axes_mm: axes }) {
    const [x, y] = spot(pane, centre);
    const seen = axes.map((v) => [dot(pane.view.right, v), dot(pane.view.down, v)]);
    const sum = (i, j) => seen.reduce((total, v) => total + v[i] * v[j], 0);
    const a = Math.sqrt(Math.max(sum(0, 0), 1e-12));
    const b = sum(0, 1) / a;
    const c = Math.sqrt(Math.max(sum(1, 1) - b * b, 0));
    strokePath(colours.text, 1.5, [], () => {
      for (let n = 0; n <= 72; n++) {
        const [sin, cos] = [Math.sin((n * Math.PI) / 36), Math.cos((n * Math.PI) / 36)];
        pen.lineTo(x + pane.scale * a * cos, y + pane.scale * (b * cos + c * sin));
      }
    });
  }

  function drawTumour(pane) {
    if (!data.tumour) return;
    const { centre_mm: centre, radius_mm: radius } = data.tumour;
    const after = pane.show === "after";
    drawRing(pane, centre, radius, colours.before, after ? [6, 5] : []);
    if (after && data.tumour_after_mm) drawRing(pane, data.tumour_after_mm, radius, colours.after, []);
    if (after && data.tumour_within) drawWithin(pane, data.tumour_within);
  }

  function drawCrosshair(pane) {
    const [x, y] = spot(pane, state.at);
    const gap = 10;
    pen.globalAlpha = 0.6;
    pen.strokeStyle = colours.text;
    pen.lineWidth = 1;
    pen.beginPath();
    for (const [from, to] of [[[pane.x, y], [x - gap, y]], [[x + gap, y], [pane.x + pane.width, y]],
      [[x, pane.y], [x, y - gap]], [[x, y + gap], [x, pane.y + pane.height]]]) {
      pen.moveTo(...from);
      pen.lineTo(...to);
    }
    pen.stroke();
    pen.globalAlpha = 1;
  }

  function write(text, x, y, align) {
    pen.textAlign = align;
    pen.lineWidth = 3;
    pen.strokeStyle = "#000";
    pen.fillStyle = colours.text;
    pen.strokeText(text, x, y);
    pen.fillText(text, x, y);
  }

  // Letters of the patient's directions, where the plane lies, what is shown, and a bar of 50 or 10 mm.
  function dress(pane) {
    const { x, y, width, height, view } = pane;
    const [left, right, top, bottom] = view.letters;
    pen.font = "bold 14px system-ui, sans-serif";
    write(left, x + 8, y + height / 2 + 5, "left");
    write(right, x + width - 8, y + height / 2 + 5, "right");
    write(top, x + width / 2, y + 18, "center");
    write(bottom, x + width / 2, y + height - 8, "center");
    pen.font = "12px system-ui, sans-serif";
    write(`${view.name} ${"xyz"[view.axis]} ${fixed(state.at[view.axis])}`, x + 8, y + 18, "left");
    write(pane.show === "after" ? "SIMULATED" : "CT", x + width - 8, y + 18, "right");
    const bar = 50 * pane.scale < width / 3 ? 50 : 10;
    const [end, level] = [x + width - 10, y + height - 12];
    strokeSegments([[[end - bar * pane.scale, level], [end, level]]], colours.text, 2);
    write(`${bar} mm`, end - (bar * pane.scale) / 2, level - 6, "center");
  }

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
})();
