// Draws a level on its way to the next with the materials of web/, beside both drawn plainly.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { blendGeomorphs } from '/web/index.js';

const SIZE = 1024; // pixels
// Pixels along each side of those that are compared, each the mean of its block. Single samples at a silhouette flip once
// on the way, and whole numbers do, so that squares add up: of sixteen equal steps each is a quarter of the switch, however
// smooth the way is.
const BLOCK = 8;
const STEPS = 16;

function means(pixels) {
  const side = SIZE / BLOCK;
  const sums = new Float32Array(4 * side * side);
  for (let at = 0; at < pixels.length; at += 1) {
    const [channel, x, y] = [at % 4, (at >> 2) % SIZE, Math.floor((at >> 2) / SIZE)];
    sums[4 * (Math.floor(y / BLOCK) * side + Math.floor(x / BLOCK)) + channel] += pixels[at];
  }
  return sums.map((sum) => sum / BLOCK ** 2);
}

export async function morph(canvas, [fine, coarse]) {
  const renderer = new THREE.WebGLRenderer({ canvas });
  renderer.setSize(SIZE, SIZE, false);
  const target = new THREE.WebGLRenderTarget(SIZE, SIZE, { type: THREE.FloatType });
  const load = async (url) => (await new GLTFLoader().loadAsync(url)).scene;
  const [first, blended, next] = [await load(fine), await load(fine), await load(coarse)];
  const box = new THREE.Box3().setFromObject(first);
  const [center, length] = [box.getCenter(new THREE.Vector3()), box.getSize(new THREE.Vector3()).length()];
  const camera = new THREE.PerspectiveCamera(30, 1, length / 100, length * 10);
  camera.position.copy(center).addScaledVector(new THREE.Vector3(0.48, 0.6, 0.64), 2 * length);
  camera.lookAt(center);
  const draw = (object) => {
    const world = new THREE.Scene();
    const light = new THREE.DirectionalLight(0xffffff, 2);
    light.position.set(1, 2, 3);
    world.add(new THREE.HemisphereLight(), light, object);
    renderer.setRenderTarget(target);
    renderer.render(world, camera);
    const pixels = new Float32Array(4 * SIZE * SIZE);
    renderer.readRenderTargetPixels(target, 0, 0, SIZE, SIZE, pixels);
    return means(pixels);
  };
  const rms = (a, b) => Math.sqrt(a.reduce((sum, own, at) => sum + (own - b[at]) ** 2, 0) / a.length);
  const time = blendGeomorphs(blended);
  const along = Array.from({ length: STEPS + 1 }, (_, step) => {
    time.value = step / STEPS;
    return draw(blended);
  });
  const [start, end] = [draw(first), draw(next)];
  const jumps = along.slice(1).map((own, at) => rms(own, along[at]));
  const found = { hard: rms(start, end), start: rms(start, along[0]), end: rms(end, along[STEPS]), jump: Math.max(...jumps), lit: rms(start, new Float32Array(start.length)) };
  renderer.dispose();
  return found;
}
