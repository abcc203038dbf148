import type { Camera, LOD, Object3D, Vector3, WebGLRenderer } from 'three';
import type { GLTF, GLTFLoaderPlugin, GLTFParser } from 'three/addons/loaders/GLTFLoader.js';

/** Options of a {@link SeamwisePlugin}. */
export interface SeamwiseOptions {
  /** Renderer whose picture is looked at: its pixels from top to bottom decide, whatever they become. */
  renderer?: Pick<WebGLRenderer, 'getDrawingBufferSize'>;
  /** Pixels from top to bottom, where no renderer is given; 1080 if left out. */
  height?: number | (() => number);
  /** Share of its size by which a coarser level comes later than it may, so that nothing flickers; 0.1 if left out. */
  hysteresis?: number;
}

/** Turns nodes with `MSFT_lod` into {@link SeamwiseLOD}s: `loader.register((parser) => new SeamwisePlugin(parser, { renderer }))`. */
export class SeamwisePlugin implements GLTFLoaderPlugin {
  constructor(parser: GLTFParser, options?: SeamwiseOptions);
  readonly name: 'MSFT_lod';
  afterRoot(gltf: GLTF): Promise<void>;
}

/** A `THREE.LOD` that shows the coarsest level that can't be told from the source at its size on screen. */
export class SeamwiseLOD extends LOD {
  constructor();
  /** Largest size of each level in pixels that `diagonal` spans, the finest first; `levels[0]` is the source. */
  sizes: number[];
  /** Length in units of the world, where the anchor is scaled by `restScale`. */
  diagonal: number;
  restScale: number;
  /** Middle of what is shown, in the space of `anchor`. */
  center: Vector3;
  /** Pixels of the picture from top to bottom. */
  height: () => number;
  /** Share of its size by which a coarser level comes later than it may. */
  hysteresis: number;
  /** What carries the middle about: the first bone of a skinned mesh, else this. */
  readonly anchor: Object3D;
  /** Pixels that the diagonal spans in a camera's picture. */
  pixels(camera: Camera): number;
  /** Distance from a camera to the middle of what is shown. */
  distance(camera: Camera): number;
}

/** What geomorphs are blended by: 0 shows the level, 1 the next coarser one. */
export interface GeomorphTime {
  value: number;
}

/** Gives the meshes below an object that say where their vertices come to lie in the next level (`bake --geomorph`) materials that blend; returns what they blend by. */
export function blendGeomorphs(object: Object3D, time?: GeomorphTime): GeomorphTime;
