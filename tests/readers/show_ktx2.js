// Shows the textures of a file by three.js, without light, and tells of what kind they are.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { KTX2Loader } from 'three/addons/loaders/KTX2Loader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

const SLOTS = ['map', 'normalMap', 'metalnessMap', 'roughnessMap', 'aoMap', 'emissiveMap'];

// The pixels of a file from one side, and its textures by the places where materials use them.
export async function show(canvas, url) {
  const renderer = new THREE.WebGLRenderer({ canvas, preserveDrawingBuffer: true, alpha: true });
  renderer.setSize(canvas.width, canvas.height, false);
  const textures = new KTX2Loader().setTranscoderPath('/modules/three/examples/jsm/libs/basis/');
  textures.detectSupport(renderer);
  const loader = new GLTFLoader().setKTX2Loader(textures).setMeshoptDecoder(MeshoptDecoder);
  const { scene } = await loader.loadAsync(url);
  const found = [];
  scene.traverse((object) => {
    if (!object.isMesh) return;
    for (const slot of SLOTS.filter((own) => object.material[own])) {
      const { isCompressedTexture, colorSpace, image, mipmaps } = object.material[slot];
      const { width, height } = image;
      found.push({ slot, isCompressed: !!isCompressedTexture, colorSpace, width, height, levels: mipmaps.length });
    }
    const { map, alphaTest, transparent, side } = object.material;
    object.material = new THREE.MeshBasicMaterial({ map, alphaTest, transparent, side });
  });
  const bounds = new THREE.Box3().setFromObject(scene);
  const [center, size] = [bounds.getCenter(new THREE.Vector3()), bounds.getSize(new THREE.Vector3()).length()];
  const camera = new THREE.PerspectiveCamera(40, 1, size / 100, size * 4);
  camera.position.copy(center).add(new THREE.Vector3(0.6, 0.4, 1).setLength(size * 1.2));
  camera.lookAt(center);
  renderer.render(scene, camera);
  const flat = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d');
  flat.drawImage(canvas, 0, 0);
  const { data } = flat.getImageData(0, 0, canvas.width, canvas.height);
  textures.dispose();
  renderer.dispose();
  return { data, textures: found };
}

// Peak signal to noise ratio in dB of pixels that both show, and how many they are.
export function compare(a, b) {
  let [squares, count] = [0, 0];
  for (let at = 0; at < a.length; at += 4) {
    if (a[at + 3] < 255 || b[at + 3] < 255) continue;
    count += 1;
    for (let k = 0; k < 3; k += 1) squares += (a[at + k] - b[at + k]) ** 2;
  }
  return { count, psnr: 10 * Math.log10((255 ** 2 * 3 * count) / squares) };
}
