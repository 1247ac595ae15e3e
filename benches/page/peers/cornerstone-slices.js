// `?cpu`: the library's newer viewports, which can draw without WebGL; else its usual ones.
import { Enums, RenderingEngine, init, setVolumesForViewports, utilities, volumeLoader } from "@cornerstonejs/core";
import { scroll, views, volume } from "./common.js";

const cpu = new URLSearchParams(location.search).has("cpu");
const names = ["axial", "sagittal", "coronal"];
const range = { lower: -160, upper: 240 };

const { size, spacing, voxels } = await volume();
await init(cpu ? { rendering: { planar: { renderBackend: Enums.RenderBackends.CPU } } } : {});
const ct = volumeLoader.createLocalVolume("ct", {
  metadata: {
    BitsAllocated: 16, BitsStored: 16, HighBit: 15, SamplesPerPixel: 1, PixelRepresentation: 1, PhotometricInterpretation: "MONOCHROME2",
    Modality: "CT", ImageOrientationPatient: [1, 0, 0, 0, 1, 0], PixelSpacing: [spacing[1], spacing[0]], Columns: size[0], Rows: size[1],
    FrameOfReferenceUID: "1.2.3", voiLut: [{ windowCenter: 40, windowWidth: 400 }], VOILUTFunction: "LINEAR",
  },
  dimensions: size, spacing, origin: [0, 0, 0], direction: [1, 0, 0, 0, 1, 0, 0, 0, 1], scalarData: voxels,
});
const engine = new RenderingEngine("bench");
const type = cpu ? Enums.ViewportType.PLANAR_NEXT : Enums.ViewportType.ORTHOGRAPHIC;
engine.setViewports(views("div", 3).map((element, n) => {
  element.addEventListener(Enums.Events.IMAGE_RENDERED, () => bench.painted(names[n]));
  return { viewportId: names[n], element, type, defaultOptions: { orientation: names[n] } };
}));
const all = names.map((name) => engine.getViewport(name));

if (cpu) {
  utilities.genericViewportDisplaySetMetadataProvider.add("ct", { imageIds: ct.imageIds, kind: "planar", volumeId: "ct" });
  await Promise.all(all.map(async (viewport, n) => {
    await viewport.setDisplaySets({ displaySetId: "ct", options: { orientation: names[n] } });
    viewport.setDisplaySetPresentation("ct", { voiRange: range });
  }));
} else {
  const show = ({ volumeActor }) => volumeActor.getProperty().getRGBTransferFunction(0).setRange(range.lower, range.upper);
  await setVolumesForViewports(engine, [{ volumeId: "ct", callback: show }], names);
}
scroll(size, (voxel, step) => {
  if (step === 0) engine.render();
  else all.forEach((viewport) => viewport.scroll(step));
});
