// The one state of the page. Events change it, drawing reads it; nothing else is remembered anywhere.

/** @typedef {import("./geometry.js").Triple} Triple */
/** @typedef {import("./geometry.js").Pair} Pair */
/** @typedef {import("./geometry.js").Grid} Grid */
/** @typedef {import("./geometry.js").View} View */
/** @typedef {Grid & {id: string, key: string, type: string, simulated?: boolean, fresh?: boolean,
 *   names?: Record<string, string>, body?: [Triple, Triple]|null}} Volume `body`: first and last voxel of the patient */
/** @typedef {{centre_mm: Triple, radius_mm: number}} Sphere */
/** @typedef {Sphere & {what: "tumour"|"region"}} Draft a sphere being dragged, not sent yet */
/** @typedef {"chest_wall"|"soft_tissue"|"exclude"|"erase"} Tissue */
/** @typedef {{tissue: Tissue, radius: number, points: Triple[]}} Stroke balls along a line, mm */
/** @typedef {{n: number, stroke: Stroke, state: "going"|"taken"|"failed"}} Waiting a stroke that the labels do not have yet */
/** @typedef {{segmenter: "none"|"preparing"|"ready", share: number|null, following: boolean, problem: Problem|null}} Live */
/** @typedef {{ap: number, lat: number}} Angles of the table */
/** @typedef {{slice: number, x0: number, y0: number, width: number, height: number, hu: Int16Array}} Patched a piece of a plane */
/** @typedef {Angles & {moved: number|null, ms: number, planes: Record<string, Patched>, load: Load|null}} Preview the CT as the table
 *   would have it; `load`: with an applicator */
/** @typedef {{state: "none"|"preparing"|"ready"|"failed", share: number|null, message: string|null}} Ready */
/** @typedef {Ready & {tetrahedra: number|null, final_mm: number|null}} PreviewTilt */
/** @typedef {{centre: Triple, axis: Triple, radius: number, shaft: number, contact: "tied"|"frictionless", shift: Triple, turn: Triple,
 *   inserted: boolean, tracked?: boolean}} Applicator `tracked`: where a tracker had it; put in at `centre`, its shaft along `axis`; since then moved, mm, and turned, radians about its centre */
/** @typedef {{force: number, moment: number, tumour: Triple|null, away: number|null, gap: number|null}} Load force in N, moment in
 *   N mm, the tumour's place now; how far its centre and its surface are from the applicator's surface, mm */
/** @typedef {{state: "ok"|"predicted"|"late"|"stale", age_ms: number|null, within_mm: number|null, moved_mm: number|null, from_surface_mm: number|null,
 *   from_axis_mm: number|null, force_n: number|null, solver_error_mm: number|null, tumour: Triple, radius_mm: number,
 *   sphere_radius_mm: number|null, shaft_radius_mm: number|null, rest: Triple|null,
 *   centre: Triple, axis: Triple, stamp: number|null}} Answer of a navigation; `rest`: where the tumour is without the applicator */
/** @typedef {{phase: "off"|"connecting"|"following"|"gone", address: string|null, answer: Answer|null, rate: number|null, status: string|null,
 *   why: string|null, passed: number, passed_why: string|null}} Navigation */
/** @typedef {{message: string, advice: string|null}} Problem */
/** @typedef {{key: string, mine: any, theirs: any}} Conflict */
/** @typedef {{id: string, name: string, changed: number}} Unsaved a case in no file; `changed`: seconds since 1970 */
/** @typedef {{id: string, stage: string, code: string, message: string, ticked: boolean, old?: boolean, place_mm: Triple|null}} Warning */
/** @typedef {{group: string, name: string, text: string, level: "good"|"watch"|"bad"|null, old?: boolean}} Figure */
/** @typedef {{centre_mm: Triple, area_cm2: number, error_mm: number, name: string}} Patch */
/** @typedef {{what: string, share: number|null, can_cancel: boolean}} Job */
/** @typedef {{name: string, state: string, share: number|null, seconds: number|null, found: string|null}} Stage */
/** @typedef {{id: string, patient: string, known: string, description: string, modality: string, size: number[]|null, spacing_mm: number[]|null,
 *   files: number, usable: boolean, problems: string[], picture: boolean}} Series */
/** @typedef {{revision: number, version: string, phase: string, problem: Problem|null, command: string,
 *   case: Case|null, patient?: {name: string, id: string, born: string, study: string, series: string}|null,
 *   volumes: Volume[], views: View[], stages: Stage[], job: Job|null, warnings: Warning[], patches: Patch[], patches_old?: boolean, unsaved?: Unsaved[],
 *   unsaved_gone?: number,
 *   inspection: null|{dir: string, name: string, series: Series[], objects?: {kind: string, name: string}[]},
 *   surfaces?: Named[], lines?: {volume: string, key: string}[], figures?: Figure[],
 *   nodes?: {id: string, name: string, address: string}[], sent?: {to: string, text: string, ok: boolean}|null,
 *   tumour?: Way|null, result?: Result|null, live?: Live|null, preview_tilt?: PreviewTilt|null,
 *   preview_applicator?: Ready|null, own?: Own|null, beside?: Beside[]}} Server */
/** @typedef {{volume_ml: number, mean_gy: number, d98_gy: number, d50_gy: number, d2_gy: number, max_gy: number,
 *   shares: number[]}} Curve `shares`: of the volume, 0 to 1, with at least n steps of dose */
/** @typedef {{region: string, dose: string, step_gy: number, before: Curve, after: Curve|null,
 *   outside: number|null}} Histogram */
/** @typedef {{fresh: boolean, structures: {name: string, file: string, colour: string|null,
 *   volume_ml: [number, number|null]|null}[],
 *   doses: {file: string, max_gy: [number, number|null], levels_gy: number[]}[], histograms: Histogram[], notes: string[]}} Own
 *   structures and doses before and after; `fresh`: after is of what is given now; `levels_gy`: of isodoses, the highest first */
/** @typedef {{id: string, kind: "structures"|"dose"|"segmentation", name: string, on: boolean, regions: string[]}} Beside an object
 *   drawn beside the CT; `on`: the case carries it along; `regions`: those that can be a tumour */
/** @typedef {{part: string, key: string, shape?: "ct"|"deformed"|"both", kind?: "triangles"|"arrows"|"points"}} Named a surface that can be had */
/** @typedef {{distance_mm: number, length_mm: [number, number]|null, within_mm: number|null, level: number|null,
 *   reason?: string|null}} Way the tumour's */
/** @typedef {{name: string, saved: boolean, kept?: boolean, astray?: string|null, can_undo?: boolean, can_redo?: boolean, values: Record<string, any>,
 *   tumour: Sphere|null, region: Sphere|null, side_proposed?: boolean}} Case `side_proposed`: from the tumour's place, by nobody since; `kept`: in
 *   no file, but for the next start; `astray`: why what its file says now is not shown */
/** @typedef {{name: string, old?: boolean, lacks_ticks?: boolean, verdict: "green"|"amber"|"red", headline: string, reasons: string[], outputs: string[],
 *   verified?: {ok: boolean, text: string}|null, confirm?: string|null}} Result */
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
