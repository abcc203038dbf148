// What a surface is coloured and bent by: flat normals, tangents, charts.

/** The normal of each triangle's plane at its three corners. */
function flatNormals(positions) {
  const normals = new Float32Array(positions.length);
  for (let at = 0; at < positions.length; at += 9) {
    const [a, b, c] = [0, 3, 6].map((k) => positions.subarray(at + k, at + k + 3));
    const normal = normalize(cross(subtract(b, a), subtract(c, a)));
    for (const k of [0, 3, 6]) normals.set(normal, at + k);
  }
  return normals;
}

/**
 * Tangents where a file has none: of each vertex the mean of its triangles' directions of u, by their
 * angles, apart for those that are mirrored; as MikkTSpace does, but for vertices that only look alike.
 */
function makeTangents({ position, normal }, uvs, order, vertices) {
  const sums = [new Float64Array(vertices * 3), new Float64Array(vertices * 3)];
  const sides = new Uint8Array(order.length / 3);
  for (let first = 0; first < order.length; first += 3) {
    const { direction, side } = directionOfU(position, uvs, first);
    sides[first / 3] = side;
    for (let k = 0; k < 3; k += 1) {
      const corner = first + k;
      const angle = angleAt(position, corner, first + ((k + 1) % 3), first + ((k + 2) % 3));
      const n = normal.subarray(3 * corner, 3 * corner + 3);
      const lean = dot(n, direction);
      const [x, y, z] = [direction[0] - n[0] * lean, direction[1] - n[1] * lean, direction[2] - n[2] * lean];
      const share = angle / (Math.hypot(x, y, z) || Infinity);
      const at = 3 * order[corner];
      sums[side][at] += x * share;
      sums[side][at + 1] += y * share;
      sums[side][at + 2] += z * share;
    }
  }
  const tangents = new Float32Array(order.length * 4);
  for (let corner = 0; corner < order.length; corner += 1) {
    const side = sides[Math.floor(corner / 3)];
    const at = 3 * order[corner];
    for (let k = 0; k < 3; k += 1) tangents[4 * corner + k] = sums[side][at + k];
    // glTF has v downward in the image, and the bitangent upward.
    tangents[4 * corner + 3] = side === 1 ? 1 : -1;
  }
  return unitRows(tangents, 4);
}

/** Where u grows on a triangle; side 1 if its area in the image is negative, 0 otherwise. */
function directionOfU(position, uvs, first) {
  const [p, q] = [3 * first, 2 * first];
  const [du1, dv1] = [uvs[q + 2] - uvs[q], uvs[q + 3] - uvs[q + 1]];
  const [du2, dv2] = [uvs[q + 4] - uvs[q], uvs[q + 5] - uvs[q + 1]];
  const side = du1 * dv2 - du2 * dv1 < 0 ? 1 : 0;
  const sign = side === 1 ? -1 : 1;
  const along = (k) => sign * ((position[p + 3 + k] - position[p + k]) * dv2 - (position[p + 6 + k] - position[p + k]) * dv1);
  return { direction: [along(0), along(1), along(2)], side };
}

/** The angle of a triangle at a corner. */
function angleAt(position, at, next, last) {
  const to = (corner, k) => position[3 * corner + k] - position[3 * at + k];
  const [a, b] = [[to(next, 0), to(next, 1), to(next, 2)], [to(last, 0), to(last, 1), to(last, 2)]];
  const both = Math.sqrt(dot(a, a) * dot(b, b));
  return both > 0 ? Math.acos(Math.max(-1, Math.min(1, dot(a, b) / both))) : 0;
}

/** The box around the corners of batches, and a sphere in its middle that holds them. */
function boundsOf(batches) {
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  const each = (of) => batches.forEach(({ corners: { position } }) => {
    for (let at = 0; at < position.length; at += 3) of(position[at], position[at + 1], position[at + 2]);
  });
  each((x, y, z) => [x, y, z].forEach((value, axis) => {
    low[axis] = Math.min(low[axis], value);
    high[axis] = Math.max(high[axis], value);
  }));
  if (!low.every(Number.isFinite)) return { center: [0, 0, 0], radius: 1, diagonal: 2 };
  const center = scale(add(low, high), 0.5);
  let farthest = 0;
  each((x, y, z) => { farthest = Math.max(farthest, Math.hypot(x - center[0], y - center[1], z - center[2])); });
  return { center, radius: farthest || 1, diagonal: length(subtract(high, low)) || 1 };
}
