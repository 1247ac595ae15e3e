// The one state of the page. Events change it, drawing reads it; nothing else is remembered anywhere.

/** @typedef {import("./geometry.js").Triple} Triple */
/** @typedef {import("./geometry.js").Pair} Pair */
/** @typedef {import("./geometry.js").Grid} Grid */
/** @typedef {import("./geometry.js").View} View */
/** @typedef {Grid & {id: string, key: string, type: string, simulated?: boolean, fresh?: boolean,
 *   names?: Record<string, string>}} Volume */
/** @typedef {{centre_mm: Triple, radius_mm: number}} Sphere */
/** @typedef {{message: string, advice: string|null}} Problem */
/** @typedef {{stage: string, code: string, message: string}} Warning */
/** @typedef {{centre_mm: Triple, area_cm2: number, error_mm: number, name: string}} Patch */
/** @typedef {{what: string, share: number|null, can_cancel: boolean}} Job */
/** @typedef {{name: string, state: string, share: number|null, seconds: number|null, found: string|null}} Stage */
/** @typedef {{id: string, description: string, modality: string, size: number[]|null, spacing_mm: number[]|null,
 *   files: number, usable: boolean, problems: string[], picture: boolean}} Series */
/** @typedef {{revision: number, version: string, phase: string, problem: Problem|null, command: string,
 *   case: Case|null,
 *   volumes: Volume[], views: View[], stages: Stage[], job: Job|null, warnings: Warning[], patches: Patch[],
 *   inspection: null|{dir: string, name: string, series: Series[]},
 *   surfaces?: {part: string, key: string}[], tumour?: Way|null, result?: Result|null}} Server */
/** @typedef {{distance_mm: number, length_mm: [number, number]|null, within_mm: number|null, level: number|null}} Way the tumour's */
/** @typedef {{name: string, saved: boolean, can_undo?: boolean, can_redo?: boolean, values: Record<string, any>,
 *   tumour: Sphere|null, region: Sphere|null}} Case */
/** @typedef {{name: string, verdict: "green"|"amber"|"red", headline: string, reasons: string[], outputs: string[]}} Result */
/** @typedef {{key: string, grid: Volume, voxels: Int16Array|Uint8Array, arrived: number}} Held voxels in the page */
/** @typedef {{key: string, points: Float32Array, triangles: Uint32Array}} Surface */
/** @typedef {{zoom: number, middle: Pair}} Camera */
/** @typedef {{view: string, slice: number, from: Triple, to: Triple, open: boolean}} Ruler */

export const planes = ["axial", "sagittal", "coronal"];
const camera = () => ({ zoom: 1, middle: /** @type {Pair} */ ([0.5, 0.5]) });

const initial = {
  /** @type {Server|null} */ server: null,
  /** @type {"waiting"|"live"|"gone"|"refused"} */ link: "waiting",
  /** @type {Problem|null} a problem that the page itself found */ problem: null,
  /** @type {Record<string, Held>} */ voxels: {},
  /** @type {Record<string, Surface>} */ surfaces: {},
  step: "open",
  /** @type {Triple|null} */ crosshair: null,
  /** @type {Triple|null} */ cursor: null,
  focus: "axial",
  /** @type {string|null} */ large: null,
  /** @type {Record<string, Camera>} */ cameras: Object.fromEntries(planes.map((name) => [name, camera()])),
  /** @type {Record<string, Pair>} */ boxes: {},
  window: { width: 400, level: 40 },
  smooth: true, overlays: true, lines: true,
  /** @type {string} the volume that is shown */ show: "ct",
  flicker: false,
  compare: { way: "off", share: 0.5 },
  tool: "crosshair",
  /** @type {Ruler|null} */ ruler: null,
  /** @type {Sphere|null} a tumour being dragged, not sent yet */ draft: null,
  patch: -1,
  panning: false,
  panel: true,
  /** @type {string[]} surfaces that are not drawn */ hiddenParts: ["mesh"],
  /** @type {{turn: number|null, lift: number, zoom: number, moving: boolean}} */
  scene: { turn: null, lift: 0.35, zoom: 1, moving: false },
  /** @type {{dir: any, up: string|null, folders: any[], cases: any[], runs: any[], dicom: number}|null} */ list: null,
  choosing: false,
  /** @type {string[]} warnings that the user has ticked */ ticked: [],
};

/** What belongs to one CT and ends with it. */
export const ofOneCt = {
  crosshair: initial.crosshair, cursor: null, ruler: null, draft: null, patch: -1, ticked: initial.ticked, show: "ct",
  cameras: initial.cameras, scene: initial.scene, compare: initial.compare,
};

/** @typedef {typeof initial} State */

/** @type {State} */
let state = initial;
/** @type {Set<(now: State, before: State) => void>} */
const listeners = new Set();

/** @returns {State} */
export const now = () => state;

/** @param {Partial<State>} patch */
export function change(patch) {
  const before = state;
  state = { ...state, ...patch };
  for (const listener of listeners) listener(state, before);
}

/** @param {(now: State, before: State) => void} listener */
export function follow(listener) {
  listeners.add(listener);
}

/** The volume on the screen: the chosen one, the other one while D is held, or the CT when the chosen is not there.
 * @param {State} s @returns {Held|null} */
export function shownVolume(s) {
  const other = s.show === "ct" ? "deformed" : "ct";
  const wanted = s.flicker ? other : s.show;
  return s.voxels[wanted] ?? s.voxels.ct ?? null;
}

/** How far the 3D view is turned about the head-feet axis: at first it shows the breast's own side. @param {State} s */
export const turnOf = (s) => s.scene.turn ?? (s.server?.case?.values.breast === "right" ? -0.5 : 0.5);

/** @param {State} s @param {string} name @returns {View|null} */
export const viewOf = (s, name) => s.server?.views.find((view) => view.name === name) ?? null;

/** @param {State} s @returns {Sphere|null} */
export const tumourOf = (s) => s.draft ?? s.server?.case?.tumour ?? null;
