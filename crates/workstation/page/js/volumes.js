// Keeps the page's voxels and surfaces equal to those that the server's state names.
import { readSurface, readVolume } from "./link.js";
import { change, now } from "./state.js";

/** @typedef {import("./state.js").Volume} Volume */
/** @typedef {import("./state.js").State} State */

/** What is under way or has failed, by id: the same key is not asked for twice. @type {Map<string, {key: string, stop: AbortController}>} */
const asked = new Map();

/** Below any CT number: voxels that have not arrived are black, not water. */
const nothing = -32768;

/** @param {string} id @param {Partial<import("./state.js").Held>} patch */
function hold(id, patch) {
  const held = { ...now().voxels[id], ...patch };
  change({ voxels: { ...now().voxels, [id]: held } });
}

/** @param {Volume} volume @param {AbortController} stop */
async function load(volume, stop) {
  const count = volume.size[0] * volume.size[1] * volume.size[2];
  const voxels = volume.type === "u8" ? new Uint8Array(count) : new Int16Array(count);
  if (volume.type !== "u8") voxels.fill(nothing);
  const bytes = new Uint8Array(voxels.buffer);
  // A first volume is drawn while it arrives; an old one stays on the screen until the new one is whole.
  const first = !now().voxels[volume.id];
  if (first) hold(volume.id, { key: volume.key, grid: volume, voxels, arrived: 0 });
  try {
    const size = voxels.BYTES_PER_ELEMENT;
    const told = (/** @type {number} */ arrived) => first && hold(volume.id, { arrived: Math.floor(arrived / size) });
    if (!await readVolume(volume.id, volume.key, bytes, told, stop.signal)) return;
    hold(volume.id, { key: volume.key, grid: volume, voxels, arrived: count });
  } catch (error) {
    if (stop.signal.aborted) return;
    asked.delete(volume.id);
    change({ problem: { message: `The images could not be read: ${/** @type {Error} */ (error).message}.`, advice: "Reload the page." } });
  }
}

/** The server says anew whether a volume is fresh without sending it anew. @param {Volume} volume */
function renewGrid(volume) {
  const held = now().voxels[volume.id];
  if (held?.key === volume.key && held.grid.fresh !== volume.fresh) hold(volume.id, { grid: volume });
}

/** The change of volume is read when it is first looked at: it is as large as the CT. @param {Volume} volume */
const wanted = ({ id }) => id !== "jacobian" || now().compare.way === "volume";

/** @param {Volume[]} volumes */
function followVolumes(volumes) {
  for (const volume of volumes) {
    renewGrid(volume);
    if (!wanted(volume)) continue;
    const before = asked.get(volume.id);
    if (before?.key === volume.key) continue;
    before?.stop.abort();
    const stop = new AbortController();
    asked.set(volume.id, { key: volume.key, stop });
    load(volume, stop);
  }
  const named = new Set(volumes.map((volume) => volume.id));
  const gone = Object.keys(now().voxels).filter((id) => !named.has(id));
  for (const id of asked.keys()) {
    if (named.has(id)) continue;
    asked.get(id)?.stop.abort();
    asked.delete(id);
  }
  if (gone.length === 0) return;
  change({ voxels: Object.fromEntries(Object.entries(now().voxels).filter(([id]) => named.has(id))) });
}

/** @type {Map<string, string>} */
const surfacesAsked = new Map();

/** @typedef {Pick<import("./state.js").Surface, "points"|"triangles"|"values">} Body */

const none = new Uint32Array(0);

/** How the bytes of each kind are read. @type {Record<string, (buffer: ArrayBuffer) => Body>} */
const readers = {
  triangles(buffer) {
    const [points, triangles] = new Uint32Array(buffer, 0, 2);
    return {
      points: new Float32Array(buffer, 8, 3 * points), triangles: new Uint32Array(buffer, 8 + 12 * points, 3 * triangles),
      values: new Float32Array(0),
    };
  },
  arrows(buffer) {
    const [count] = new Uint32Array(buffer, 0, 1);
    const points = new Float32Array(buffer, 8, 6 * count);
    const far = (/** @type {number} */ n) => Math.hypot(...[0, 1, 2].map((a) => points[6 * n + 3 + a] - points[6 * n + a]));
    return { points, triangles: none, values: Float32Array.from({ length: count }, (_, n) => far(n)) };
  },
  points(buffer) {
    const [count] = new Uint32Array(buffer, 0, 1);
    const all = new Float32Array(buffer, 8, 4 * count);
    return {
      points: Float32Array.from({ length: 3 * count }, (_, n) => all[4 * Math.floor(n / 3) + (n % 3)]), triangles: none,
      values: Float32Array.from({ length: count }, (_, n) => all[4 * n + 3]),
    };
  },
};

/** A server that does not say which is one that has triangles of the CT only. @param {import("./state.js").Named} named */
async function loadSurface({ part, key, shape = "ct", kind = "triangles" }) {
  const buffer = await readSurface(part, key);
  if (!buffer || surfacesAsked.get(part) !== key || !readers[kind]) return;
  change({ surfaces: { ...now().surfaces, [part]: { key, shape, kind, ...readers[kind](buffer) } } });
}

/** @param {import("./state.js").Named[]} surfaces */
function followSurfaces(surfaces) {
  for (const one of surfaces) {
    if (surfacesAsked.get(one.part) === one.key) continue;
    surfacesAsked.set(one.part, one.key);
    loadSurface(one);
  }
  const named = new Set(surfaces.map((surface) => surface.part));
  const held = Object.entries(now().surfaces);
  for (const part of surfacesAsked.keys()) if (!named.has(part)) surfacesAsked.delete(part);
  if (held.some(([part]) => !named.has(part))) change({ surfaces: Object.fromEntries(held.filter(([part]) => named.has(part))) });
}

/** @param {State} state @param {State} before */
export function followServer(state, before) {
  if (!state.server || (state.server === before.server && state.compare.way === before.compare.way)) return;
  followVolumes(state.server.volumes);
  followSurfaces(state.server.surfaces ?? []);
}
