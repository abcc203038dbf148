// Shows a file with a small reader of NEEDLE_progressive, of our own and after its schema: finer levels of meshes
// and larger textures are fetched where the camera comes near.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

const NAME = 'NEEDLE_progressive';
const TARGET = 200_000; // triangles of what fills the screen
const SIDE = 256; // pixels of what is really drawn
const AWAY = new THREE.Vector3(0.48, 0.6, 0.64);

const load = (url) => new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).loadAsync(url);
const placeOf = (list, guid) => list.findIndex((own) => own.extensions?.[NAME]?.guid === guid);

// A loaded file, with what can be had of each of its meshes and textures.
class Progressive {
  constructor(url, { scene, parser }) {
    this.scene = scene;
    this.url = url;
    this.meshes = [];
    this.textures = [];
    this.files = new Map();
    const { associations, json } = parser;
    scene.traverse((mesh) => {
      if (!mesh.isMesh) return;
      const { meshes, primitives = 0 } = associations.get(mesh) ?? {};
      const own = json.meshes[meshes]?.extensions?.[NAME];
      if (own) this.meshes.push({ mesh, primitive: primitives, ...own, inside: mesh.geometry, level: own.lods.length });
      for (const [slot, texture] of Object.entries(mesh.material)) {
        const sizes = texture?.isTexture && json.textures[associations.get(texture)?.textures]?.extensions?.[NAME];
        if (sizes) this.textures.push({ mesh, slot, ...sizes });
      }
    });
  }

  fetch(path) {
    const url = new URL(path, new URL(this.url, location.href)).href;
    if (!this.files.has(url)) this.files.set(url, load(url));
    return this.files.get(url);
  }

  // Shows each mesh in the level that its densities ask for, and textures as large as they are seen.
  async update(camera, height) {
    for (const own of this.meshes) {
      const share = shareOf(own.mesh, own.inside, camera);
      const found = own.lods.findIndex(({ densities }) => densities[own.primitive] / share < TARGET);
      own.level = found < 0 ? own.lods.length : found;
      own.mesh.geometry = await this.geometry(own);
    }
    for (const { mesh, slot, guid, lods } of this.textures) {
      const pixels = 4 * shareOf(mesh, mesh.geometry, camera) * height;
      const size = lods.findLast((lod) => lod.height > pixels) ?? lods[0];
      const { parser } = await this.fetch(size.path);
      const texture = await parser.getDependency('texture', placeOf(parser.json.textures, guid));
      const before = mesh.material[slot];
      Object.assign(texture, { colorSpace: before.colorSpace, flipY: before.flipY, channel: before.channel, needsUpdate: true });
      mesh.material[slot] = texture;
    }
  }

  async geometry({ lods, level, guid, primitive, inside }) {
    if (level === lods.length) return inside;
    const { parser } = await this.fetch(lods[level].path);
    const found = await parser.getDependency('mesh', placeOf(parser.json.meshes, guid));
    return (found.isMesh ? found : found.children[primitive]).geometry;
  }
}

// The largest side of a mesh's box as it is seen, over the height of the view; its depth counts as seen from the side.
function shareOf(mesh, geometry, camera) {
  if (!geometry.boundingBox) geometry.computeBoundingBox();
  const view = geometry.boundingBox.clone().applyMatrix4(mesh.matrixWorld);
  const seen = view.clone().applyMatrix4(camera.matrixWorldInverse).applyMatrix4(camera.projectionMatrix);
  const [size, depth] = [seen.getSize(new THREE.Vector3()), view.applyMatrix4(camera.matrixWorldInverse).getSize(new THREE.Vector3())];
  const flat = Math.max(size.x * camera.aspect, size.y) / 2;
  return flat * Math.max(1, depth.z / Math.max(depth.x, depth.y));
}

function cameraAt(scene, distance, fieldOfView) {
  const box = new THREE.Box3().setFromObject(scene);
  const center = box.getCenter(new THREE.Vector3());
  const camera = new THREE.PerspectiveCamera(fieldOfView, 1, distance / 100, distance * 100);
  camera.position.copy(center).addScaledVector(AWAY, distance);
  camera.lookAt(center);
  camera.updateMatrixWorld();
  return camera;
}

// Levels of each mesh and the triangles drawn, from each distance in turn; and how the last picture differs from the
// source's from there, root of the mean square over the pixels of either.
export async function watch(canvas, { url, source, distances, height, fieldOfView }) {
  const renderer = new THREE.WebGLRenderer({ canvas });
  renderer.setSize(SIDE, SIDE, false);
  const target = new THREE.WebGLRenderTarget(SIDE, SIDE, { samples: 4, colorSpace: THREE.SRGBColorSpace });
  const draw = (scene, camera) => {
    const world = new THREE.Scene();
    const light = new THREE.DirectionalLight(0xffffff, 2);
    light.position.set(1, 2, 3);
    world.add(new THREE.HemisphereLight(), light, scene);
    renderer.setRenderTarget(target);
    renderer.render(world, camera);
    const pixels = new Uint8Array(4 * SIDE * SIDE);
    renderer.readRenderTargetPixels(target, 0, 0, SIDE, SIDE, pixels);
    return { pixels, triangles: renderer.info.render.triangles };
  };
  const own = new Progressive(url, await load(url));
  const whole = (await load(source)).scene;
  const steps = [];
  for (const distance of distances) {
    const camera = cameraAt(whole, distance, fieldOfView);
    const fresh = steps.length === 0 ? draw(own.scene, camera).triangles : undefined;
    own.scene.updateMatrixWorld(true);
    await own.update(camera, height);
    const { triangles, pixels } = draw(own.scene, camera);
    const other = draw(whole, camera).pixels;
    let [sum, count] = [0, 0];
    for (let at = 0; at < pixels.length; at += 4) {
      if (pixels[at + 3] === 0 && other[at + 3] === 0) continue;
      for (let k = 0; k < 3; k += 1) sum += (pixels[at + k] - other[at + k]) ** 2;
      count += 3;
    }
    const levels = own.meshes.map(({ level, lods }) => ({ level, numbers: lods.map(({ path }) => Number(path.match(/_lod(\d+)/)[1])) }));
    steps.push({ distance, fresh, levels, triangles, files: own.files.size, off: Math.sqrt(sum / count) / 255 });
  }
  renderer.dispose();
  return steps;
}
