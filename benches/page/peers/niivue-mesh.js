import { Niivue, NVMesh, SLICE_TYPE } from "@niivue/niivue";
import { mesh, turn, views } from "./common.js";

const { points, triangles } = await mesh();
const viewer = new Niivue({ dragAndDropEnabled: false, show3Dcrosshair: false, isOrientCube: false });
await viewer.attachToCanvas(views("canvas")[0], false);
viewer.setSliceType(SLICE_TYPE.RENDER);
viewer.addMesh(new NVMesh(points, triangles, "mesh", new Uint8Array([196, 84, 30, 255]), 1, true, viewer.gl));
viewer.scene.volScaleMultiplier = 0.92;
// What setRenderAzimuthElevation does, with the drawing in this frame.
turn((angle) => {
  viewer.scene.renderAzimuth = (angle * 180) / Math.PI;
  viewer.drawScene();
});
