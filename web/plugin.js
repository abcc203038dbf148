// A plugin of GLTFLoader: a node that names its levels in MSFT_lod becomes a SeamwiseLOD of them.
//
// Sizes come from `MSFT_screencoverage`, shares of the screen's area that a disk covers whose diameter is
// the node's diagonal, on the screen that the certificate in `asset.extras.seamwise` names. All nodes of an
// asset switch at the same size of the whole asset, each by its own distance.
import { Box3, Matrix4, Vector2, Vector3 } from 'three';
import { SeamwiseLOD } from './lod.js';

// The screen of files that name none.
const SCREEN = { width: 1920, height: 1080 };

export class SeamwisePlugin {
  // `renderer` tells the pixels of its picture from top to bottom, or `height` does, which may be a
  // function; `hysteresis` is a share of the size.
  constructor(parser, { renderer, height = 1080, hysteresis = 0.1 } = {}) {
    this.name = 'MSFT_lod';
    this.parser = parser;
    this.hysteresis = hysteresis;
    const size = new Vector2();
    const ofRenderer = () => renderer.getDrawingBufferSize(size).y;
    this.height = renderer ? ofRenderer : typeof height === 'function' ? height : () => height;
  }

  async afterRoot(gltf) {
    const { parser } = this;
    const { nodes = [], asset } = parser.json;
    const own = asset.extras?.seamwise;
    const screen = (own?.levels?.[0] ?? own)?.screen ?? SCREEN;
    gltf.scenes.forEach((scene) => scene.updateMatrixWorld(true));
    const withLevels = nodes.map((node, index) => ({ index, ids: node.extensions?.MSFT_lod?.ids,
      coverage: node.extras?.MSFT_screencoverage })).filter(({ ids }) => ids?.length > 0);
    const unmeasured = withLevels.filter(({ coverage }) => !Array.isArray(coverage));
    if (unmeasured.length > 0) {
      console.warn(`SeamwisePlugin: ${unmeasured.length} nodes with levels have no MSFT_screencoverage, so they `
        + 'show their source: bake without --no-evaluate');
    }
    await Promise.all(withLevels.map(async ({ index, ids, coverage }) => {
      const object = await parser.getDependency('node', index);
      if (!Array.isArray(coverage) || !object.parent) return;
      const levels = await Promise.all(ids.map((id) => parser.getDependency('node', id)));
      this.#put(object, levels, sizesOf(coverage, levels.length, screen));
    }));
  }

  // Puts a node and its levels into an LOD, in the place of the node.
  #put(object, levels, sizes) {
    const { parent } = object;
    const lod = new SeamwiseLOD();
    lod.name = object.name ? `${object.name}_LOD` : '';
    lod.height = this.height;
    lod.hysteresis = this.hysteresis;
    lod.sizes = sizes;
    lod.diagonal = diagonalOf(object);
    const center = centerOf(object);
    const place = parent.children.indexOf(object);
    [object, ...levels].forEach((level, index) => {
      lod.addLevel(level);
      level.visible = index === 0;
    });
    parent.add(lod);
    parent.children.splice(place, 0, parent.children.pop());
    lod.updateMatrixWorld(true);
    lod.center.copy(lod.anchor.worldToLocal(center));
    lod.restScale = lod.anchor.matrixWorld.getMaxScaleOnAxis();
  }
}

// Largest sizes of levels in pixels, never falling towards the finer ones.
function sizesOf(coverage, count, { width, height }) {
  const sizes = Array.from({ length: count }, (_, index) => (
    Math.sqrt(4 * Math.max(coverage[index] ?? 0, 0) * width * height / Math.PI)));
  for (let index = count - 2; index >= 0; index -= 1) sizes[index] = Math.max(sizes[index], sizes[index + 1]);
  return sizes;
}

// Diagonal of a node's bounding box in its own axes, as long as it is in the world on average over directions.
function diagonalOf(object) {
  const [box, toNode] = [new Box3(), new Matrix4().copy(object.matrixWorld).invert()];
  object.traverse(({ geometry, matrixWorld }) => {
    if (!geometry) return;
    if (!geometry.boundingBox) geometry.computeBoundingBox();
    const toOwn = new Matrix4().multiplyMatrices(toNode, matrixWorld);
    box.union(new Box3().copy(geometry.boundingBox).applyMatrix4(toOwn));
  });
  return box.getSize(new Vector3()).length() * Math.cbrt(Math.abs(object.matrixWorld.determinant()));
}

// Middle of a node's box in the world, skinned meshes in their pose.
function centerOf(object) {
  const center = new Box3().setFromObject(object).getCenter(new Vector3());
  // The box was made for this pose alone.
  object.traverse((part) => { if (part.isSkinnedMesh) part.boundingBox = null; });
  return center;
}
