// Vectors of three numbers, and 4 × 4 matrices of columns, as glTF and WebGL hold them.

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(a[0], a[1], a[2]);

/** The unit vector of a direction; `otherwise` where it has none. */
function normalize(a, otherwise = [0, 0, 1]) {
  const long = length(a);
  return long > 0 && Number.isFinite(long) ? scale(a, 1 / long) : otherwise;
}

function multiply(a, b) {
  const product = new Array(16).fill(0);
  for (let column = 0; column < 4; column += 1) {
    for (let row = 0; row < 4; row += 1) {
      for (let k = 0; k < 4; k += 1) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return product;
}

/** What is scaled, then turned, then moved. */
function compose([tx, ty, tz], turn, [sx, sy, sz]) {
  const long = Math.hypot(...turn) || 1;
  const [x, y, z, w] = turn.map((part) => part / long);
  return [
    (1 - 2 * (y * y + z * z)) * sx, 2 * (x * y + z * w) * sx, 2 * (x * z - y * w) * sx, 0,
    2 * (x * y - z * w) * sy, (1 - 2 * (x * x + z * z)) * sy, 2 * (y * z + x * w) * sy, 0,
    2 * (x * z + y * w) * sz, 2 * (y * z - x * w) * sz, (1 - 2 * (x * x + y * y)) * sz, 0,
    tx, ty, tz, 1,
  ];
}

/** The columns of the upper left 3 × 3, and of the matrix that normals go by (its cofactors). */
function linearParts(m) {
  const columns = [m.slice(0, 3), m.slice(4, 7), m.slice(8, 11)];
  const [a, b, c] = columns;
  const cofactors = [cross(b, c), cross(c, a), cross(a, b)];
  const determinant = dot(a, cofactors[0]);
  const sign = determinant < 0 ? -1 : 1;
  return { columns, normals: cofactors.map((column) => scale(column, sign)), mirrored: determinant < 0 };
}

/** A 3 × 3 matrix of columns times a vector. */
const turn = ([a, b, c], [x, y, z]) => [
  a[0] * x + b[0] * y + c[0] * z, a[1] * x + b[1] * y + c[1] * z, a[2] * x + b[2] * y + c[2] * z];
