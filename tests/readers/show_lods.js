// Loads a file with the plugin of web/, moves a camera, and tells which level is drawn.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { clone } from 'three/addons/utils/SkeletonUtils.js';
import { SeamwisePlugin } from '/web/index.js';

const [WIDTH, SMALL] = [96, 54]; // pixels of what is really drawn
const AWAY = new THREE.Vector3(0.48, 0.6, 0.64);

export async function watch(canvas, { url, distances, height, fieldOfView }) {
  const renderer = new THREE.WebGLRenderer({ canvas });
  renderer.setSize(WIDTH, SMALL, false);
  const load = async (options) => {
    const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
    const { scene } = await loader.register((parser) => new SeamwisePlugin(parser, options)).loadAsync(url);
    return scene;
  };
  const world = new THREE.Scene();
  world.add(new THREE.HemisphereLight());
  const scene = await load({ height });
  world.add(scene);
  const camera = new THREE.PerspectiveCamera(fieldOfView, WIDTH / SMALL);
  const all = lodsOf(scene);
  const lods = all.map((lod) => {
    all.forEach((other) => { other.visible = other === lod; });
    const triangles = lod.levels.map(({ object }) => trianglesOf(object));
    const steps = distances.map((distance) => {
      place(camera, lod, distance);
      renderer.render(world, camera);
      return { level: lod.getCurrentLevel(), drawn: renderer.info.render.triangles };
    });
    return { triangles, steps };
  });
  all.forEach((lod) => { lod.visible = true; });
  const fresh = await load({ renderer });
  const sizes = sizesOf(renderer, fresh);
  const wrong = [...wrongHits(all), ...wrongClone(scene)];
  renderer.dispose();
  return { lods, sizes, wrong };
}

function lodsOf(scene) {
  const lods = [];
  scene.traverse((object) => { if (object.isLOD) lods.push(object); });
  return lods;
}

function trianglesOf(object) {
  let triangles = 0;
  object.traverse(({ geometry }) => {
    if (geometry) triangles += (geometry.index ?? geometry.attributes.position).count / 3;
  });
  return triangles;
}

// Puts the camera at a distance from the middle of what is shown, looking at it.
function place(camera, lod, distance) {
  const center = lod.anchor.localToWorld(lod.center.clone());
  camera.position.copy(center).addScaledVector(AWAY, distance);
  [camera.near, camera.far] = [distance / 1000, distance * 1000];
  camera.updateProjectionMatrix();
  camera.lookAt(center);
  camera.updateMatrixWorld();
  return center;
}

// Sizes on screen that a level reckons with beside those of a projected rod as long as the diagonal.
function sizesOf(renderer, scene) {
  const [lod] = lodsOf(scene);
  const { diagonal } = lod;
  const sizes = [];
  const compare = (what, camera, stretch, distance) => {
    const center = place(camera, lod, distance);
    const up = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 1).setLength(diagonal * stretch / 2);
    const [top, bottom] = [1, -1].map((sign) => center.clone().addScaledVector(up, sign).project(camera).y);
    const expected = (top - bottom) / 2 * renderer.getDrawingBufferSize(new THREE.Vector2()).y;
    sizes.push({ what, pixels: lod.pixels(camera), expected });
  };
  const near = 5 * diagonal;
  const camera = new THREE.PerspectiveCamera(30, WIDTH / SMALL);
  compare('as loaded', camera, 1, near);
  renderer.setPixelRatio(2);
  compare('two pixels for one', camera, 1, near);
  camera.zoom = 3;
  compare('zoomed', camera, 1, near);
  camera.setViewOffset(WIDTH, SMALL, 10, 10, WIDTH / 4, SMALL / 4);
  compare('a part of a view', camera, 1, near);
  const [tall, wide] = [2 * diagonal, 2 * diagonal * WIDTH / SMALL];
  compare('parallel', new THREE.OrthographicCamera(-wide, wide, tall, -tall), 1, near);
  scene.scale.setScalar(7);
  scene.position.set(diagonal, -diagonal, 0);
  scene.updateMatrixWorld(true);
  compare('scaled and moved', new THREE.PerspectiveCamera(50, WIDTH / SMALL), 7, 50 * diagonal);
  return sizes;
}

// A ray hits the level that is shown.
function wrongHits(lods) {
  return lods.flatMap((lod) => {
    const center = lod.anchor.localToWorld(lod.center.clone());
    const box = new THREE.Box3().setFromObject(lod);
    const start = box.max.clone().addScaledVector(AWAY, box.getSize(new THREE.Vector3()).length());
    const ray = new THREE.Raycaster(start, center.sub(start).normalize());
    const shown = lod.levels[lod.getCurrentLevel()].object;
    const isShown = (object) => object !== null && (object === shown || isShown(object.parent));
    const hits = ray.intersectObject(lod);
    const others = hits.filter(({ object }) => !isShown(object)).length;
    return others > 0 ? [`a ray hits ${others} times what is not shown`] : [];
  });
}

// A copy switches on its own and where the first one does.
function wrongClone(scene) {
  const copy = clone(scene);
  copy.position.x += 3;
  copy.updateMatrixWorld(true);
  const camera = new THREE.PerspectiveCamera();
  return lodsOf(copy).flatMap((own, index) => {
    const lod = lodsOf(scene)[index];
    const distance = lod.levels.at(-1).distance;
    place(camera, lod, distance);
    const expected = lod.pixels(camera);
    place(camera, own, distance);
    const isSame = Math.abs(own.pixels(camera) / expected - 1) < 1e-4;
    const isOwn = own.levels.every(({ object }, level) => object !== lod.levels[level].object);
    return isSame && isOwn ? [] : [`a copy takes itself for ${own.pixels(camera)} pixels, not ${expected}`];
  });
}
