// The camera that all models are seen by: it turns about a point, and looks at it.

/** Field of view of the shorter side of a picture: that of the tool's own renderer. */
const FIELD_OF_VIEW = (40 * Math.PI) / 180;
/** Share of the half frame that the model's sphere reaches, and the first of the renderer's views. */
const FILL = 0.98;
const FIRST_VIEW = normalize([1, 1, 1 + Math.SQRT2]);
const STEEPEST = Math.PI / 2 - 0.001;
/** Distances of the eye, in those at which the model fills the picture. */
const NEAREST = 0.25;
const FARTHEST = 60;

class Camera {
  constructor({ center, radius, diagonal }) {
    Object.assign(this, { center, radius, diagonal, half: Math.tan(FIELD_OF_VIEW / 2) });
    this.fitting = radius / Math.sin(Math.atan(FILL * this.half));
    this.nearest = NEAREST * this.fitting;
    this.reset();
  }

  reset() {
    this.target = [...this.center];
    this.distance = this.fitting;
    this.lookFrom(FIRST_VIEW);
  }

  /** Stands in a direction from the target. */
  lookFrom(direction) {
    this.yaw = Math.atan2(direction[0], direction[2]);
    this.pitch = Math.asin(Math.max(-1, Math.min(1, direction[1])));
  }

  orbit(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, this.pitch + pitch));
  }

  /** Goes so many times as far. */
  zoom(factor) {
    this.distance = Math.max(this.nearest, Math.min(FARTHEST * this.fitting, this.distance * factor));
  }

  /** Moves so that what is at the target moves by shares of the shorter side, to the right and down. */
  pan(right, down) {
    const { right: across, up } = this.axes();
    const reach = 2 * this.half * this.distance;
    this.target = add(this.target, add(scale(across, -right * reach), scale(up, down * reach)));
  }

  axes() {
    const [cosine, sine] = [Math.cos(this.pitch), Math.sin(this.pitch)];
    const back = [Math.sin(this.yaw) * cosine, sine, Math.cos(this.yaw) * cosine];
    const right = [Math.cos(this.yaw), 0, -Math.sin(this.yaw)];
    return { right, up: cross(back, right), back };
  }

  /** Pixels that the diagonal of the model's box spans, in a picture of so many pixels on its shorter side. */
  pixels(side) {
    return (this.diagonal * side) / (2 * this.half * this.distance);
  }

  /** The distance at which it spans so many. */
  distanceAt(pixels, side) {
    return (this.diagonal * side) / (2 * this.half * pixels);
  }

  /** What shaders need, for a picture so many times as wide as high. */
  view(aspect) {
    const { right, up, back } = this.axes();
    const eye = add(this.target, scale(back, this.distance));
    return viewOf({ eye, right, up, back, half: this.half, aspect, center: this.center, radius: this.radius });
  }

  /** The same for a camera of the tool's renderer, of square frame. */
  static viewFrom({ eye, target, halfWidth }, { center, radius }) {
    const back = normalize(subtract(eye, target));
    const right = normalize(cross(scale(back, -1), Math.abs(back[1]) < 0.999 ? [0, 1, 0] : [0, 0, 1]));
    return viewOf({ eye, right, up: cross(back, right), back, half: halfWidth, aspect: 1, center, radius });
  }
}

function viewOf({ eye, right, up, back, half, aspect, center, radius }) {
  const away = dot(subtract(eye, center), back);
  const [near, far] = [Math.max(away - 1.5 * radius, 0.01 * radius, 1e-4 * away), away + 1.5 * radius];
  const [x, y] = [1 / (half * Math.max(aspect, 1)), 1 / (half * Math.max(1 / aspect, 1))];
  const depth = Math.max(far, 2 * near) - near;
  const [a, b] = [-(2 * near + depth) / depth, (-2 * near * (near + depth)) / depth];
  const projection = [x, 0, 0, 0, 0, y, 0, 0, 0, 0, a, -1, 0, 0, b, 0];
  const turned = [right, up, back].map((axis) => [axis, -dot(axis, eye)]);
  const world = [0, 1, 2].flatMap((column) => [...turned.map(([axis]) => axis[column]), 0]);
  const matrix = multiply(projection, [...world, ...turned.map(([, move]) => move), 1]);
  // From above the camera's left shoulder.
  const toKey = normalize(add(add(scale(up, 0.6), scale(right, -0.4)), back));
  return { matrix, eye, toKey };
}
