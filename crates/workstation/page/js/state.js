// The one state of the page. Events change it, drawing reads it; nothing else is remembered anywhere.

/** @typedef {import("./geometry.js").Triple} Triple */
/** @typedef {import("./geometry.js").Pair} Pair */
/** @typedef {import("./geometry.js").Grid} Grid */
/** @typedef {import("./geometry.js").View} View */
// What the server tells: made from its own types, and held to them by a test.
/** @typedef {import("../../types/server.d.ts").State} Server */
/** @typedef {import("../../types/server.d.ts").VolumeShown} Volume */
/** @typedef {import("../../types/server.d.ts").SphereRecord} Sphere */
/** @typedef {import("../../types/server.d.ts").LiveShown} Live */
/** @typedef {import("../../types/server.d.ts").PreviewShown} PreviewTilt */
/** @typedef {import("../../types/server.d.ts").Problem} Problem */
/** @typedef {import("../../types/server.d.ts").UnsavedShown} Unsaved */
/** @typedef {import("../../types/server.d.ts").WarningShown} Warning */
/** @typedef {import("../../types/server.d.ts").FigureShown} Figure */
/** @typedef {import("../../types/server.d.ts").PatchShown} Patch */
/** @typedef {import("../../types/server.d.ts").Job} Job */
/** @typedef {import("../../types/server.d.ts").StageShown} Stage */
/** @typedef {import("../../types/server.d.ts").SeriesShown} Series */
/** @typedef {import("../../types/server.d.ts").DoseVolumeCurve} Curve */
/** @typedef {import("../../types/server.d.ts").HistogramShown} Histogram */
/** @typedef {import("../../types/server.d.ts").PlanShown} Own */
/** @typedef {import("../../types/server.d.ts").AdjacentShown} Beside */
/** @typedef {import("../../types/server.d.ts").SurfaceShown} Named */
/** @typedef {import("../../types/server.d.ts").TumourShown} Way */
/** @typedef {import("../../types/server.d.ts").CaseShown} Case */
/** @typedef {import("../../types/server.d.ts").ResultShown} Result */
/** @typedef {import("../../types/server.d.ts").PreviewShown} Ready */
/** @typedef {import("../../types/server.d.ts").Navigation} Navigation */
/** @typedef {import("../../types/server.d.ts").AnswerShown} Answer */
/** @typedef {Sphere & {what: "tumour"|"region"}} Draft a sphere being dragged, not sent yet */
/** @typedef {"chest_wall"|"soft_tissue"|"exclude"|"erase"} Tissue */
/** @typedef {{tissue: Tissue, radius: number, points: Triple[]}} Stroke balls along a line, mm */
/** @typedef {{n: number, stroke: Stroke, state: "going"|"taken"|"failed"}} Waiting a stroke that the labels do not have yet */
/** @typedef {{ap: number, lat: number}} Angles of the table */
/** @typedef {{slice: number, x0: number, y0: number, width: number, height: number, hu: Int16Array}} Patched a piece of a plane */
/** @typedef {Angles & {moved: number|null, ms: number, planes: Record<string, Patched>, load: Load|null}} Preview the CT as the table
 *   would have it; `load`: with an applicator */
/** @typedef {{centre: Triple, axis: Triple, radius: number, shaft: number, contact: "tied"|"frictionless", shift: Triple, turn: Triple,
 *   inserted: boolean, tracked?: boolean}} Applicator `tracked`: where a tracker had it; put in at `centre`, its shaft along `axis`; since then moved, mm, and turned, radians about its centre */
/** @typedef {{force: number, moment: number, tumour: Triple|null, away: number|null, gap: number|null}} Load force in N, moment in
 *   N mm, the tumour's place now; how far its centre and its surface are from the applicator's surface, mm */
/** @typedef {{key: string, mine: any, theirs: any}} Conflict */
/** @typedef {{key: string, grid: Volume, voxels: Int16Array|Uint8Array, arrived: number}} Held voxels in the page */
/** @typedef {{key: string, shape: "ct"|"deformed"|"both", kind: "triangles"|"arrows"|"points", points: Float32Array,
 *   triangles: Uint32Array, values: Float32Array}} Surface arrows: two points each; `values`: their lengths, or distances of points, mm */
/** @typedef {{zoom: number, middle: Pair, body?: boolean}} Camera `body`: on the patient, however large the view is */
/** @typedef {{view: string, slice: number, from: Triple, to: Triple, open: boolean}} Ruler */

export const planes = ["axial", "sagittal", "coronal"];
/** @param {boolean} body on the patient, else the whole grid @returns {Record<string, Camera>} */
export const allFitted = (body) => Object.fromEntries(planes.map((name) => [name, { zoom: 1, middle: [0.5, 0.5], body }]));

const initial = {
  /** @type {Server|null} */ server: null,
  /** @type {"waiting"|"live"|"gone"|"refused"} */ link: "waiting",
  /** @type {Problem|null} a problem that the page itself found */ problem: null,
  /** Changes of the case that were sent and not answered: nobody knows whether they are saved. */ unanswered: 0,
  /** Questions that have waited for longer than the program takes. */ late: 0,
  /** @type {Conflict[]|null} values that another window has changed too */ conflict: null,
  /** @type {Record<string, Held>} */ voxels: {},
  /** @type {Record<string, Surface>} */ surfaces: {},
  step: "open",
  /** @type {Triple|null} */ crosshair: null,
  /** @type {Triple|null} */ cursor: null,
  /** @type {string|null} the view that the pointer is in */ over: null,
  focus: "axial",
  /** @type {string|null} */ large: null,
  /** @type {Record<string, Camera>} */ cameras: allFitted(true),
  /** @type {Record<string, Pair>} */ boxes: {},
  window: { width: 400, level: 40 },
  smooth: true, overlays: true, lines: true, section: false,
  /** How often lines of the server have come: they are kept outside, and drawn anew. */ linesCame: 0,
  /** @type {string} the volume that is shown */ show: "ct",
  flicker: false,
  compare: { way: "off", share: 0.5 },
  tool: "crosshair",
  /** @type {Ruler|null} */ ruler: null,
  /** @type {Draft|null} */ draft: null,
  /** `before`: the tissue to come back to from erasing. @type {{tissue: Tissue, before: Tissue, radius: number}} */
  brush: { tissue: "chest_wall", before: "chest_wall", radius: 6 },
  erasing: false,
  /** @type {Stroke|null} the stroke under way */ stroke: null,
  /** @type {Waiting[]} */ waiting: [],
  /** @type {Angles|null} angles that are tried, sent or not */ tilt: null,
  /** A slider of the table is held. */ turning: false,
  /** @type {Preview|null} */ preview: null,
  previewOn: true,
  /** @type {Applicator|null} null: the section is switched off */ applicator: null,
  /** The applicator is being dragged. */ carrying: false,
  /** @type {Navigation|null} that is followed */ navigation: null,
  /** The applicator of a navigation pushes the tissue in the slices, too. */ slicesFollow: true,
  /** The socket is open. */ socket: false,
  patch: -1,
  panning: false,
  panel: true,
  /** @type {string[]} surfaces that are not drawn */ hiddenParts: ["mesh", "displacement", "scan, sitting", "scan, table"],
  /** @type {string[]} lines of planes that are not drawn, by their names */ hiddenLines: [],
  /** @type {{turn: number|null, lift: number, zoom: number, moving: boolean}} */
  scene: { turn: null, lift: 0.35, zoom: 1, moving: false },
  /** @type {{dir: any, up: string|null, folders: any[], cases: any[], runs: any[], dicom: number}|null} */ list: null,
  choosing: false,
  /** @type {string|null} the warning that was gone to last */ warning: null,
  /** What was typed to confirm a sending. */ typed: "",
  logOpen: false,
  /** @type {{seconds: number, stage: string, text: string}[]} */ log: [],
};

/** What belongs to one CT and ends with it. */
export const ofOneCt = {
  crosshair: initial.crosshair, cursor: null, ruler: null, draft: null, patch: -1, warning: null, typed: initial.typed, show: "ct",
  cameras: initial.cameras, scene: initial.scene, compare: initial.compare,
  stroke: null, waiting: initial.waiting, tilt: null, turning: false, preview: null,
  applicator: null, carrying: false,
  // The next patient may have a structure of the same name.
  hiddenLines: initial.hiddenLines,
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
export const tumourOf = (s) => (s.draft?.what === "tumour" ? s.draft : s.server?.case?.tumour ?? null);

/** @param {State} s @returns {Sphere|null} */
export const regionOf = (s) => (s.draft?.what === "region" ? s.draft : s.server?.case?.region ?? null);
