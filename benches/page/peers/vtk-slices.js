import "@kitware/vtk.js/Rendering/Profiles/Volume";
import vtkDataArray from "@kitware/vtk.js/Common/Core/DataArray";
import vtkImageData from "@kitware/vtk.js/Common/DataModel/ImageData";
import vtkImageMapper from "@kitware/vtk.js/Rendering/Core/ImageMapper";
import vtkImageSlice from "@kitware/vtk.js/Rendering/Core/ImageSlice";
import vtkGenericRenderWindow from "@kitware/vtk.js/Rendering/Misc/GenericRenderWindow";
import { paintedAll, scroll, views, volume } from "./common.js";

const { size, spacing, voxels } = await volume();
const image = vtkImageData.newInstance({ spacing });
image.setDimensions(size);
image.getPointData().setScalars(vtkDataArray.newInstance({ values: voxels, numberOfComponents: 1 }));
/** Of each plane: the axis it is normal to, where the eye looks, what is up. */
const planes = [[2, [0, 0, 1], [0, -1, 0]], [0, [-1, 0, 0], [0, 0, 1]], [1, [0, 1, 0], [0, 0, 1]]];
const panes = views("div", 3).map((container, n) => {
  const [axis, forward, up] = planes[n];
  const mapper = vtkImageMapper.newInstance({ slicingMode: axis });
  mapper.setInputData(image);
  mapper.setSlice(Math.floor(size[axis] / 2));
  const actor = vtkImageSlice.newInstance();
  actor.setMapper(mapper);
  actor.getProperty().setColorWindow(400);
  actor.getProperty().setColorLevel(40);
  const view = vtkGenericRenderWindow.newInstance({ background: [0, 0, 0], listenWindowResize: false });
  view.setContainer(container);
  view.resize();
  const camera = view.getRenderer().getActiveCamera();
  camera.setParallelProjection(true);
  camera.setDirectionOfProjection(...forward);
  camera.setViewUp(...up);
  view.getRenderer().addViewProp(actor);
  view.getRenderer().resetCamera();
  // The whole plane, as high as the view: half of its height in mm.
  const down = axis === 2 ? 1 : 2;
  camera.setParallelScale((spacing[down] * size[down]) / 2);
  return { axis, mapper, view };
});
scroll(size, (voxel) => {
  for (const { axis, mapper, view } of panes) {
    mapper.setSlice(voxel[axis]);
    view.getRenderer().resetCameraClippingRange();
    view.getRenderWindow().render();
  }
  paintedAll();
});
