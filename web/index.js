export { SeamwiseLOD } from './lod.js';
export { SeamwisePlugin } from './plugin.js';
export { blendGeomorphs } from './geomorph.js';
