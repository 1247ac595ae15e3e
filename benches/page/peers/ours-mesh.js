// The workstation's own 3D view, by its own modules, in a bare page: `half` draws as while a hand turns it.
import { mesh, turn, views } from "./common.js";

const own = (name) => import(`/page/js/${name}.js`);
const [{ change, now }, { makePainter }] = await Promise.all([own("state"), own("views/stage")]);
const { points, triangles } = await mesh();
const [canvas] = views("canvas");
const { paint } = makePainter(canvas);
// A solid part: the skin would be drawn as a veil, which the peers' meshes are not.
change({ surfaces: { wall: { key: "1", shape: "ct", kind: "triangles", points, triangles, values: new Float32Array(0) } } });
const moving = new URLSearchParams(location.search).has("half");
turn((angle) => {
  change({ scene: { ...now().scene, turn: angle, moving } });
  paint(now(), [640, 400]);
});
