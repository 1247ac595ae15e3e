// The slice viewer. Positions are LPS, mm; spots are pixels of the canvas, x to the right, y down. A pane shows one view of
// one CT; all panes share the crosshair, the zoom and what lies in their middle.
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
