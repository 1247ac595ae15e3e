// The workstation itself: tells the harness of its voxels and its planes, and makes each notch of the wheel a step in all three.
addEventListener("DOMContentLoaded", async () => {
  if (!document.getElementById("views")) return;
  const planes = ["axial", "sagittal", "coronal"];
  bench.want(planes);
  const put = CanvasRenderingContext2D.prototype.putImageData;
  CanvasRenderingContext2D.prototype.putImageData = function (...all) {
    put.apply(this, all);
    if (this.canvas.className === "voxels") bench.painted(this.canvas.parentElement.id.replace("view-", ""));
  };
  const { follow, now } = await import("/js/state.js");
  const { moveCrosshair, stepSlice } = await import("/js/actions.js");
  const { toPlace } = await import("/js/geometry.js");
  follow(() => {
    const { ct } = now().voxels;
    if (ct && ct.arrived === ct.voxels.length) bench.data();
  });
  // The page's own listener has moved the axial plane by the same event before.
  addEventListener("wheel", ({ deltaY }) => planes.slice(1).forEach((plane) => stepSlice(plane, -Math.round(deltaY / 120))));
  bench.centre = () => {
    const { grid } = now().voxels.ct;
    moveCrosshair(toPlace(grid, grid.size.map((n) => Math.floor(n / 2))));
  };
});
