// What the page is told. Made from the Rust types: SUPINE_WRITE_TYPES=1 cargo test -p supine-workstation types

/** All that the page shows, but the voxels: of each owner what it does not keep to itself. */
export interface State {
  version: string;
  inspection: InspectionShown | null;
  unsaved: UnsavedShown[];
  unsaved_gone: number;
  revision: number;
  case: CaseShown | null;
  patient: PatientIdentity | null;
  phase: Phase;
  command: string;
  beside: AdjacentShown[];
  problem: Problem | null;
  stages: StageShown[];
  job: Job | null;
  warnings: WarningShown[];
  live: LiveShown;
  preview_tilt: PreviewShown;
  preview_applicator: PreviewShown;
  volumes: VolumeShown[];
  views: ViewShown[];
  surfaces: SurfaceShown[];
  lines: LinesShown[];
  own: PlanShown | null;
  patches: PatchShown[];
  patches_old: boolean;
  tumour: TumourShown | null;
  result: ResultShown | null;
  figures: FigureShown[];
  nodes: NodeShown[];
  sent: SentShown | null;
}

/** What the page is told. */
export interface Navigation {
  phase: NavigationPhase;
  address: string | null;
  answer: AnswerShown | null;
  rate: number | null;
  status: string | null;
  why: string | null;
  passed: number;
  passed_why: string | null;
}

/** How far following is. */
export type NavigationPhase = "off" | "connecting" | "following" | "gone";

/** Where applicator and tumour are. Places and directions LPS, lengths mm. */
export interface AnswerShown {
  state: string;
  age_ms: number | null;
  within_mm: number | null;
  moved_mm: number | null;
  from_surface_mm: number | null;
  from_axis_mm: number | null;
  force_n: number | null;
  solver_error_mm: number | null;
  tumour: [number, number, number];
  radius_mm: number;
  sphere_radius_mm: number | null;
  shaft_radius_mm: number | null;
  rest: [number, number, number] | null;
  centre: [number, number, number];
  axis: [number, number, number];
  stamp: number | null;
}

/** What a folder of DICOM holds. */
export interface InspectionShown {
  dir: string;
  name: string;
  series: SeriesShown[];
  objects: ObjectShown[];
}

/** A series of it. */
export interface SeriesShown {
  id: string;
  patient: string;
  known: string;
  description: string;
  modality: string;
  size: [number, number, number] | null;
  spacing_mm: [number, number, number] | null;
  files: number;
  usable: boolean;
  problems: string[];
  picture: boolean;
}

/** An object that is no CT. */
export interface ObjectShown {
  kind: string;
  name: string;
}

/** A case that was changed before and is in no file. */
export interface UnsavedShown {
  id: string;
  name: string;
  changed: number;
}

/** What the page is told of it. */
export interface CaseShown {
  name: string;
  saved: boolean;
  kept: boolean;
  astray: string | null;
  can_undo: boolean;
  can_redo: boolean;
  values: Record<string, any>;
  tumour: SphereRecord | null;
  region: SphereRecord | null;
  side_proposed: boolean;
}

/** A sphere. */
export interface SphereRecord {
  centre_mm: [number, number, number];
  radius_mm: number;
}

/** Whose CT it is: for the eyes of those who treat her, not for logs and summaries, hence no content in its `Debug`. What is not known is empty. */
export interface PatientIdentity {
  name: string;
  id: string;
  born: string;
  study: string;
  series: string;
}

/** How far the opening is. */
export type Phase = "empty" | "reading" | "ready";

/** It as the page shows it. */
export interface AdjacentShown {
  id: string;
  kind: string;
  name: string;
  on: boolean;
  regions: string[];
}

/** What went wrong. */
export interface Problem {
  message: string;
  advice: string | null;
}

/** A stage of the flow. */
export interface StageShown {
  name: string;
  state: string;
  share: number | null;
  seconds: number | null;
  found: string | null;
}

/** What is worked on. */
export interface Job {
  what: string;
  share: number;
  can_cancel: boolean;
}

/** What the user must know. */
export interface WarningShown {
  id: string;
  ticked: boolean;
  old: boolean;
  place_mm: [number, number, number] | null;
  stage: string;
  code: string;
  message: string;
}

/** What keeps up with the brush. */
export interface LiveShown {
  segmenter: Readiness;
  share: number | null;
  following: boolean;
  busy: boolean;
  problem: Problem | null;
}

/** Whether something is ready. */
export type Readiness = "none" | "preparing" | "ready" | "failed";

/** A live picture of the table. */
export interface PreviewShown {
  state: Readiness;
  share: number | null;
  message: string | null;
  tetrahedra: number | null;
  final_mm: number | null;
}

/** A volume whose bytes the page may fetch. */
export interface VolumeShown {
  id: string;
  key: string;
  type: string;
  size: [number, number, number];
  spacing_mm: [number, number, number];
  origin_mm: [number, number, number];
  axes: [[number, number, number], [number, number, number], [number, number, number]];
  simulated: boolean;
  body: [[number, number, number], [number, number, number]] | null;
  fresh: boolean;
  names: Record<string, any>;
}

/** How the grid's own planes are shown in a view. */
export interface ViewShown {
  name: string;
  normal: number;
  right: AxisShown;
  down: AxisShown;
  letters: [string, string, string, string];
}

/** An axis of the grid along one side of a picture. */
export interface AxisShown {
  axis: number;
  flip: boolean;
}

/** A surface whose bytes the page may fetch. */
export interface SurfaceShown {
  part: string;
  key: string;
  shape: string;
  kind: string;
}

/** A volume whose planes have lines. */
export interface LinesShown {
  volume: string;
  key: string;
}

/** The patient's own structures and doses. */
export interface PlanShown {
  fresh: boolean;
  structures: StructureShown[];
  doses: DoseShown[];
  histograms: HistogramShown[];
  notes: string[];
}

/** A region. */
export interface StructureShown {
  name: string;
  file: string;
  colour: string | null;
  volume_ml: [number, number] | null;
}

/** A dose. */
export interface DoseShown {
  file: string;
  max_gy: [number | null, number | null];
  levels_gy: number[];
}

/** The dose in a structure. */
export interface HistogramShown {
  dose: string;
  structures: string;
  region: string;
  step_gy: number;
  before: DoseVolumeCurve;
  after: DoseVolumeCurve;
  outside: number | null;
}

/** Dose within a structure. */
export interface DoseVolumeCurve {
  volume_ml: number;
  beyond: number;
  mean_gy: number;
  d98_gy: number;
  d50_gy: number;
  d2_gy: number;
  max_gy: number;
  shares: number[];
}

/** An uncertain place of the chest wall. */
export interface PatchShown {
  centre_mm: [number, number, number];
  area_cm2: number;
  error_mm: number;
  name: string;
}

/** How far the tumour moves, mm, never without how sure that is. */
export interface TumourShown {
  distance_mm: number;
  length_mm: [number, number] | null;
  within_mm: number | null;
  reason: string | null;
  level: number | null;
}

export interface ResultShown {
  name: string;
  old: boolean;
  lacks_ticks: boolean;
  verdict: Colour;
  headline: string;
  reasons: string[];
  outputs: string[];
  verified: VerifiedShown | null;
  confirm: string | null;
}

/** The colour of a verdict or a reason. */
export type Colour = "green" | "amber" | "red";

export interface VerifiedShown {
  ok: boolean;
  text: string;
}

/** A figure of a stage. */
export interface FigureShown {
  group: string;
  name: string;
  text: string;
  level: string | null;
  old: boolean;
}

export interface NodeShown {
  id: string;
  name: string;
  address: string;
}

/** What became of what was sent. */
export interface SentShown {
  to: string;
  text: string;
  ok: boolean;
}
