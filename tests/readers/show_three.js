// Shows a file by three.js, all white on black. Levels that a file names in MSFT_lod are not shown:
// three.js does not know the extension, so it shows the source.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

const white = new THREE.MeshBasicMaterial({ color: 0xffffff, side: THREE.DoubleSide });

export async function show(canvas, url, cameras, levelNames) {
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  const { scene } = await loader.loadAsync(url);
  // Siblings called …_LOD0 and so on are levels of one thing: an engine shows one of them.
  scene.traverse((object) => {
    if (levelNames && /_LOD[1-9]\d*$/.test(object.name)) object.visible = false;
  });
  scene.traverse((object) => object.isMesh && (object.frustumCulled = false));
  scene.overrideMaterial = white;
  const world = new THREE.Scene();
  world.overrideMaterial = white;
  world.add(scene);
  const renderer = new THREE.WebGLRenderer({ canvas, preserveDrawingBuffer: true });
  renderer.setSize(canvas.width, canvas.height, false);
  const pictures = [];
  for (const { eye, target, fieldOfView, near, far } of cameras) {
    const camera = new THREE.PerspectiveCamera(fieldOfView, 1, near, far);
    camera.position.fromArray(eye);
    camera.lookAt(...target);
    renderer.render(world, camera);
    pictures.push(canvas.toDataURL());
  }
  const triangles = renderer.info.render.triangles;
  renderer.dispose();
  return { pictures, triangles };
}
