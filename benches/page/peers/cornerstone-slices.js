import { Enums, RenderingEngine, init, setVolumesForViewports, volumeLoader } from "@cornerstonejs/core";
import { scroll, views, volume } from "./common.js";

const { size, spacing, voxels } = await volume();
await init();
const metadata = {
  BitsAllocated: 16, BitsStored: 16, HighBit: 15, SamplesPerPixel: 1, PixelRepresentation: 1, PhotometricInterpretation: "MONOCHROME2",
  Modality: "CT", ImageOrientationPatient: [1, 0, 0, 0, 1, 0], PixelSpacing: [spacing[1], spacing[0]], Columns: size[0], Rows: size[1],
  FrameOfReferenceUID: "1.2.3", voiLut: [{ windowCenter: 40, windowWidth: 400 }], VOILUTFunction: "LINEAR",
};
volumeLoader.createLocalVolume("ct", {
  metadata, dimensions: size, spacing, origin: [0, 0, 0], direction: [1, 0, 0, 0, 1, 0, 0, 0, 1], scalarData: voxels,
});
const engine = new RenderingEngine("bench");
const names = ["axial", "sagittal", "coronal"];
engine.setViewports(views("div", 3).map((element, n) => {
  element.addEventListener(Enums.Events.IMAGE_RENDERED, () => bench.painted(names[n]));
  return { viewportId: names[n], element, type: Enums.ViewportType.ORTHOGRAPHIC, defaultOptions: { orientation: names[n] } };
}));
await setVolumesForViewports(engine, [{
  volumeId: "ct", callback: ({ volumeActor }) => volumeActor.getProperty().getRGBTransferFunction(0).setRange(-160, 240),
}], names);
const all = engine.getViewports();
scroll(size, (voxel, step) => {
  if (step === 0) engine.render();
  else all.forEach((viewport) => viewport.scroll(step));
});
