// A THREE.LOD that chooses by pixels: each level has the largest size on screen at which it can't be told
// from the source, and the coarsest that may be shown is.
//
// The size law, for an eye at distance d from the middle of a thing whose diagonal is D, a vertical field
// of view φ and a picture of H pixels from top to bottom: S = D · H / (2 tan(φ/2) · d).
import { LOD, Vector3 } from 'three';

const _eye = new Vector3();
const _center = new Vector3();

const isParallel = (camera) => camera.projectionMatrix.elements[11] === 0;

export class SeamwiseLOD extends LOD {
  // Bone that the shown mesh hangs on, or this; found when it is first asked for, since a clone has its own.
  #anchor = null;

  constructor() {
    super();
    // Largest size of each level in pixels that `diagonal` spans, the finest first; levels[0] is the source.
    this.sizes = [];
    // Length in units of the world, where the anchor is scaled by `restScale`.
    this.diagonal = 1;
    this.restScale = 1;
    // Middle of what is shown, in the space of the anchor.
    this.center = new Vector3();
    // Pixels of the picture from top to bottom.
    this.height = () => 1080;
    // A coarser level is taken only below its size by this share, so that nothing flickers between two.
    // No level is ever shown larger than its size.
    this.hysteresis = 0.1;
  }

  // What carries the middle about: a skinned mesh follows its bones, whatever its node does.
  get anchor() {
    if (this.#anchor) return this.#anchor;
    let bone = null;
    this.levels[0]?.object.traverse((object) => { bone ??= object.skeleton?.bones[0] ?? null; });
    this.#anchor = bone ?? this;
    return this.#anchor;
  }

  // Pixels that the diagonal spans in a camera's picture.
  pixels(camera) {
    return isParallel(camera) ? this.#pixelsAtOne(camera) : this.#pixelsAtOne(camera) / this.distance(camera);
  }

  // Distance from a camera to the middle of what is shown.
  distance(camera) {
    _center.copy(this.center).applyMatrix4(this.anchor.matrixWorld);
    return _eye.setFromMatrixPosition(camera.matrixWorld).distanceTo(_center);
  }

  // Pixels of the diagonal, as it is scaled now, at distance 1; the matrix knows of zoom and of parts of a view.
  #pixelsAtOne(camera) {
    const length = this.diagonal * this.anchor.matrixWorld.getMaxScaleOnAxis() / this.restScale;
    return length * this.height() * camera.projectionMatrix.elements[5] / 2;
  }

  // Distances at which levels give way to coarser ones, as three.js has them: those at which they come
  // back are less by the share of the hysteresis, and are the certificate's.
  #setDistances(camera) {
    const unit = this.#pixelsAtOne(camera);
    this.sizes.forEach((size, index) => {
      const level = this.levels[index + 1];
      level.hysteresis = this.hysteresis;
      level.distance = unit / (size * (1 - this.hysteresis));
    });
  }

  update(camera) {
    const { levels, sizes } = this;
    if (levels.length < 2) return;
    const pixels = this.pixels(camera);
    let shown = 0;
    while (shown < sizes.length) {
      const share = shown < this._currentLevel ? 1 : 1 - this.hysteresis;
      if (pixels > sizes[shown] * share) break;
      shown += 1;
    }
    levels.forEach(({ object }, index) => { object.visible = index === shown; });
    this._currentLevel = shown;
    if (!isParallel(camera)) this.#setDistances(camera);
  }

  // Hits the level that is shown, and no other.
  raycast(raycaster, intersects) {
    const shown = this.levels[this._currentLevel];
    if (shown) raycaster.intersectObject(shown.object, true, intersects);
    return false;
  }

  copy(source) {
    super.copy(source);
    this.sizes = [...source.sizes];
    this.diagonal = source.diagonal;
    this.restScale = source.restScale;
    this.center.copy(source.center);
    this.height = source.height;
    this.hysteresis = source.hysteresis;
    this._currentLevel = source._currentLevel;
    return this;
  }
}
