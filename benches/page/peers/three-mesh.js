import { AmbientLight, BufferAttribute, BufferGeometry, DirectionalLight, Mesh, MeshLambertMaterial, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import { mesh, turn, views } from "./common.js";

const { points, triangles } = await mesh();
const [canvas] = views("canvas");
const renderer = new WebGLRenderer({ canvas, antialias: false });
renderer.setSize(640, 400, false);
const geometry = new BufferGeometry();
geometry.setAttribute("position", new BufferAttribute(points, 3));
geometry.setIndex(new BufferAttribute(triangles, 1));
geometry.computeVertexNormals();
const body = new Mesh(geometry, new MeshLambertMaterial({ color: 0xc4541e }));
const light = new DirectionalLight(0xffffff, 3);
light.position.set(-1, 1, 2);
const scene = new Scene().add(body, light, new AmbientLight(0xffffff, 0.5));
const camera = new PerspectiveCamera(30, 640 / 400, 1, 2000);
camera.position.z = 525;
turn((angle) => {
  body.rotation.y = angle;
  renderer.render(scene, camera);
});
