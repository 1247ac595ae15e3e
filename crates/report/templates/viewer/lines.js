// What is drawn on a pane.
function strokePath(colour, width, dashes, trace) {
  for (const [style, wide] of [[colours.halo, width + 2], [colour, width]]) {
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
  const pixels = new Uint32Array(picture.data.buffer);
  overSlice(pane.view, (n, a, b, share) => {
    const grey = Math.round(volume[a] + (volume[b] - volume[a]) * share);
    pixels[n] = 0xff000000 | (grey * 0x010101);
  });
  context.putImageData(picture, 0, 0);
  const { first } = walk(pane.view);
  const [x, y] = spot(pane, first.map((i, a) => origin[a] + i * step));
  const pixel = step * pane.scale;
  pen.drawImage(tile, x - pixel / 2, y - pixel / 2, size * pixel, size * pixel);
  return { x, y, pixel };
}

// The boundary of the chest wall by marching squares; light where it is uncertain.
function drawWall(pane, { x: left, y: top, pixel }) {
  const depth = new Float32Array(size * size);
  const unsure = new Uint8Array(size * size);
  const wall = volumes.wall;
  overSlice(pane.view, (n, a, b, t) => {
    const [one, other] = [wall[a] % data.uncertain, wall[b] % data.uncertain];
    depth[n] = one + (other - one) * t - data.whole / 2;
    unsure[n] = wall[a] >= data.uncertain || wall[b] >= data.uncertain ? 1 : 0;
  });
  const lines = [[], []];
  for (let n = 0; n < size * (size - 1); n++) {
    if (n % size === size - 1) continue;
    const ring = [n, n + 1, n + size + 1, n + size];
    const ends = [];
    ring.forEach((a, side) => {
      const b = ring[(side + 1) % 4];
      if (depth[a] > 0 === depth[b] > 0) return;
      const t = depth[a] / (depth[a] - depth[b]);
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
  pen.strokeStyle = colours.halo;
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
