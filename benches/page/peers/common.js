// What the peers' pages share: the same voxels and triangles, the same wheel, the same turning, one drawing a frame.
const read = async (name) => (await fetch(name)).arrayBuffer();

/** @returns {Promise<{size: number[], spacing: number[], voxels: Int16Array}>} */
export async function volume() {
  const grid = await (await fetch("volume.json")).json();
  const voxels = new Int16Array(await read("volume.raw"));
  bench.want(["axial", "sagittal", "coronal"]);
  bench.data();
  return { ...grid, voxels };
}

/** @returns {Promise<{points: Float32Array, triangles: Uint32Array}>} */
export async function mesh() {
  const name = new URLSearchParams(location.search).get("mesh");
  const [points, triangles] = [new Float32Array(await read(`${name}.points`)), new Uint32Array(await read(`${name}.triangles`))];
  bench.want(["mesh"]);
  bench.data();
  return { points, triangles };
}

export const paintedAll = () => ["axial", "sagittal", "coronal"].forEach(bench.painted);

/** Draws once, then for each frame in which the wheel was turned. @param {number[]} size @param {(voxel: number[], step: number) => void} draw */
export function scroll(size, draw) {
  const middle = size.map((n) => Math.floor(n / 2));
  let voxel = middle;
  let [step, asked] = [0, false];
  const paint = () => {
    draw(voxel, step);
    [step, asked] = [0, false];
  };
  const ask = () => {
    if (!asked) requestAnimationFrame(paint);
    asked = true;
  };
  // Before the peer's own listener, which would move one plane alone.
  addEventListener("wheel", (event) => {
    event.preventDefault();
    event.stopImmediatePropagation();
    const notches = -Math.round(event.deltaY / 120);
    if (notches === 0) return;
    step += notches;
    voxel = voxel.map((x, a) => Math.min(size[a] - 1, Math.max(0, x + notches)));
    ask();
  }, { passive: false, capture: true });
  bench.centre = () => { [voxel, step] = [middle, 0]; ask(); };
  ask();
}

/** Half a degree more in each frame. @param {(radians: number) => void} draw */
export function turn(draw) {
  let angle = 0;
  const paint = () => {
    draw((angle += Math.PI / 360));
    bench.painted("mesh");
    requestAnimationFrame(paint);
  };
  requestAnimationFrame(paint);
}

/** @param {number} [count] canvases or boxes */
export function views(tag, count = 1) {
  return Array.from({ length: count }, () => document.getElementById("views").appendChild(document.createElement(tag)));
}
