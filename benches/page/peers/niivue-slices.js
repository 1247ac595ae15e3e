import { Niivue, NVImage, SHOW_RENDER, SLICE_TYPE } from "@niivue/niivue";
import { paintedAll, scroll, views, volume } from "./common.js";

const { size, spacing, voxels } = await volume();
const [canvas] = views("canvas");
// All planes lie in one canvas, which gets the place of all four views.
canvas.style.gridArea = "1 / 1 / 3 / 3";
const viewer = new Niivue({ multiplanarShowRender: SHOW_RENDER.NEVER, dragAndDropEnabled: false });
await viewer.attachToCanvas(canvas, false);
viewer.setSliceType(SLICE_TYPE.MULTIPLANAR);
const [dx, dy, dz] = spacing;
const file = NVImage.createNiftiArray(size, spacing, [dx, 0, 0, 0, 0, dy, 0, 0, 0, 0, dz, 0, 0, 0, 0, 1], 4, voxels);
viewer.addVolume(await NVImage.loadFromUrl({ url: "ct.nii", name: "ct.nii", buffer: file.buffer, cal_min: -160, cal_max: 240 }));
scroll(size, (voxel) => {
  viewer.scene.crosshairPos = viewer.vox2frac(voxel);
  viewer.drawScene();
  paintedAll();
});
