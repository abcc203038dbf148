// Shows a file by Babylon.js, all white on black. Babylon reads MSFT_lod as stages of loading: the
// coarsest level first, each replaced by the next finer one, up to as many as are asked for.
import { Engine } from '@babylonjs/core/Engines/engine.js';
import { Scene } from '@babylonjs/core/scene.js';
import { FreeCamera } from '@babylonjs/core/Cameras/freeCamera.js';
import { Color3, Color4 } from '@babylonjs/core/Maths/math.color.js';
import { Vector3 } from '@babylonjs/core/Maths/math.vector.js';
import { StandardMaterial } from '@babylonjs/core/Materials/standardMaterial.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { MeshoptCompression } from '@babylonjs/core/Meshes/Compression/meshoptCompression.js';
import { SceneLoader } from '@babylonjs/core/Loading/sceneLoader.js';
import '@babylonjs/core/Materials/Textures/Loaders/index.js';
import '@babylonjs/core/Animations/animatable.js';
import '@babylonjs/core/Loading/loadingScreen.js';
import '@babylonjs/loaders/glTF/2.0/index.js';

// Babylon loads a script and then looks for a global of this name.
globalThis.MeshoptDecoder = MeshoptDecoder;
MeshoptCompression.Configuration = { decoder: { url: 'data:text/javascript,' } };

export async function show(canvas, url, cameras, levelNames, levelsToLoad) {
  const engine = new Engine(canvas, false, { preserveDrawingBuffer: true, stencil: false });
  const scene = new Scene(engine);
  scene.useRightHandedSystem = true;
  scene.clearColor = new Color4(0, 0, 0, 1);
  const stages = [];
  SceneLoader.OnPluginActivatedObservable.addOnce((loader) => {
    loader.animationStartMode = 0;
    loader.onExtensionLoadedObservable.add((extension) => {
      if (extension.name !== 'MSFT_lod') return;
      if (levelsToLoad) extension.maxLODsToLoad = levelsToLoad;
      extension.onNodeLODsLoadedObservable.add((stage) => stages.push(stage));
    });
  });
  const at = url.lastIndexOf('/') + 1;
  await SceneLoader.AppendAsync(url.slice(0, at), url.slice(at), scene);
  await scene.whenReadyAsync();
  const white = new StandardMaterial('white', scene);
  white.disableLighting = true;
  white.emissiveColor = Color3.White();
  white.backFaceCulling = false;
  let triangles = 0;
  for (const mesh of scene.meshes) {
    mesh.alwaysSelectAsActiveMesh = true;
    if (levelNames && isLevel(mesh)) mesh.setEnabled(false);
    if (mesh.isEnabled()) triangles += (mesh.getTotalIndices() || mesh.getTotalVertices()) / 3;
    mesh.material = white;
    mesh.useVertexColors = false;
  }
  const pictures = [];
  for (const { eye, target, fieldOfView, near, far } of cameras) {
    const camera = new FreeCamera('camera', Vector3.FromArray(eye), scene);
    camera.setTarget(Vector3.FromArray(target));
    camera.fov = (fieldOfView * Math.PI) / 180;
    [camera.minZ, camera.maxZ] = [near, far];
    scene.activeCamera = camera;
    await scene.whenReadyAsync();
    scene.render();
    pictures.push(canvas.toDataURL());
  }
  engine.dispose();
  return { pictures, triangles, stages };
}

// Siblings called …_LOD0 and so on are levels of one thing: an engine shows one of them.
function isLevel(node) {
  return node && (/_LOD[1-9]\d*/.test(node.name) || isLevel(node.parent));
}
