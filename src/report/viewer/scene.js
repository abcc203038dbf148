// A glTF document's default scene, flattened to world space: one batch of triangles a material.
//
// Each triangle has corners of its own, so that a shader can tell triangles and their edges apart.
// A skinned mesh stands in its bind pose, where the tool's own renderer sees it too.

/** Attributes of a corner: name in the file, components, and what stands for one that is not there. */
const CORNER = {
  position: { name: 'POSITION', size: 3 },
  normal: { name: 'NORMAL', size: 3 },
  tangent: { name: 'TANGENT', size: 4 },
  uv: { name: 'TEXCOORD_0', size: 2 },
  uv1: { name: 'TEXCOORD_1', size: 2 },
  color: { name: 'COLOR_0', size: 4 },
};

/**
 * The scene of a level of a file: 0, or a number above it in a file that holds several (`MSFT_lod`); at a
 * moment, if it is a progressive one.
 */
function flattenScene(file, level, origin, moment) {
  const parts = new Map();
  for (const { node, world } of worldNodes(file.json, level)) {
    const placed = file.json.nodes[node];
    const own = placed.skin === undefined ? world : IDENTITY;
    for (const primitive of file.json.meshes[placed.mesh].primitives) {
      const soup = readPrimitive(file, primitive, moment);
      if (!soup) continue;
      const key = primitive.material ?? -1;
      if (!parts.has(key)) parts.set(key, []);
      for (const instance of instances(file, placed)) {
        parts.get(key).push(place(soup, multiply(own, instance), origin));
      }
    }
  }
  const batches = [...parts].map(([material, placed]) => ({ material, ...joinCorners(placed) }));
  return { batches, triangles: batches.reduce((sum, batch) => sum + batch.triangles, 0) };
}

/** How many coarser levels a file holds beside its first (`MSFT_lod`). */
function levelsBeside(json) {
  const ids = (json.nodes ?? []).map((node) => node.extensions?.MSFT_lod?.ids?.length ?? 0);
  return Math.max(0, ...ids);
}

/** The nodes with a mesh, and their transforms to the world. */
function worldNodes(json, level) {
  const found = [];
  const seen = new Set();
  const visit = (index, parent) => {
    const first = json.nodes?.[index];
    if (!first || seen.has(index)) return;
    seen.add(index);
    const ids = level > 0 ? first.extensions?.MSFT_lod?.ids : undefined;
    if (ids?.length) return visit(ids[Math.min(level, ids.length) - 1], parent);
    const world = multiply(parent, first.matrix ?? compose(
      first.translation ?? [0, 0, 0], first.rotation ?? [0, 0, 0, 1], first.scale ?? [1, 1, 1]));
    if (first.mesh !== undefined) found.push({ node: index, world });
    (first.children ?? []).forEach((child) => visit(child, world));
  };
  const center = json.extensions?.CESIUM_RTC?.center ?? [0, 0, 0];
  const root = compose(center, [0, 0, 0, 1], [1, 1, 1]);
  rootsOf(json).forEach((node) => visit(node, root));
  return found;
}

/** The roots of the default scene; of a document without scenes, all nodes that no other has. */
function rootsOf(json) {
  if (json.scenes?.length) return json.scenes[json.scene ?? 0]?.nodes ?? [];
  const nodes = json.nodes ?? [];
  const children = new Set(nodes.flatMap((node) => node.children ?? []));
  return [...nodes.keys()].filter((node) => !children.has(node));
}

/** The transforms of the instances of a node's mesh (`EXT_mesh_gpu_instancing`). */
function instances(file, node) {
  const attributes = node.extensions?.EXT_mesh_gpu_instancing?.attributes;
  if (!attributes) return [IDENTITY];
  const read = (name) => (attributes[name] === undefined ? null : readAccessor(file, attributes[name]));
  const [moves, turns, scales] = ['TRANSLATION', 'ROTATION', 'SCALE'].map(read);
  const some = moves ?? turns ?? scales;
  const row = (rows, index, otherwise) => {
    const { values, components } = rows ?? {};
    return rows ? [...values.subarray(index * components, (index + 1) * components)] : otherwise;
  };
  return Array.from({ length: some ? some.values.length / some.components : 0 }, (_, index) => compose(
    row(moves, index, [0, 0, 0]), row(turns, index, [0, 0, 0, 1]), row(scales, index, [1, 1, 1])));
}

/** A primitive in its own space, corner by corner; nothing for points and lines, and where nothing is there yet. */
function readPrimitive(file, primitive, moment) {
  if ((primitive.mode ?? 4) < 4 || primitive.attributes?.POSITION === undefined) return null;
  const timeline = timelineOf(file, primitive);
  const { corners, order, vertices } = timeline ? timeline.corners(moment) : plainCorners(file, primitive);
  if (order.length === 0) return null;
  corners.normal ??= flatNormals(corners.position);
  if (corners.uv && !corners.tangent && hasNormalMap(file.json, primitive)) {
    const set = file.json.materials[primitive.material].normalTexture.texCoord === 1 ? 'uv1' : 'uv';
    if (corners[set]) corners.tangent = makeTangents(corners, corners[set], order, vertices);
  }
  return corners;
}

/** The corners of a primitive by its indices, these, and how many vertices they name. */
function plainCorners(file, primitive) {
  const { attributes } = primitive;
  const vertices = readAccessor(file, attributes.POSITION).values.length / 3;
  const order = triangleOrder(file, primitive, vertices);
  const corners = {};
  for (const [key, { name, size }] of Object.entries(CORNER)) {
    if (attributes[name] !== undefined) corners[key] = pick(readAccessor(file, attributes[name]), order, size);
  }
  Object.keys(attributes).filter((name) => name.startsWith('_DISTANCE_')).forEach((name) => {
    corners[name] = pick(readAccessor(file, attributes[name]), order, 4);
  });
  return { corners, order, vertices };
}

const hasNormalMap = (json, primitive) => Boolean(json.materials?.[primitive.material]?.normalTexture);

/** The vertices of the triangles, three each. */
function triangleOrder(file, primitive, vertices) {
  const indices = primitive.indices === undefined
    ? Uint32Array.from({ length: vertices }, (_, vertex) => vertex)
    : Uint32Array.from(readAccessor(file, primitive.indices).values);
  if (indices.some((vertex) => vertex >= vertices)) throw new Error('a triangle names a vertex that is not there');
  if ((primitive.mode ?? 4) === 4) return indices.subarray(0, indices.length - (indices.length % 3));
  const order = [];
  for (let i = 0; i + 2 < indices.length; i += 1) {
    const [a, b, c] = primitive.mode === 6 ? [i + 1, i + 2, 0] : [i, i + 1 + (i % 2), i + 2 - (i % 2)];
    order.push(indices[a], indices[b], indices[c]);
  }
  return Uint32Array.from(order);
}

function pick({ values, components }, order, size) {
  const picked = new Float32Array(order.length * size);
  if (components < size) picked.fill(1); // the alpha of a color of three parts
  const most = Math.min(size, components);
  for (let corner = 0; corner < order.length; corner += 1) {
    for (let k = 0; k < most; k += 1) picked[corner * size + k] = values[order[corner] * components + k];
  }
  return picked;
}

/** Puts corners into the world, as far from an origin as floats can tell. */
function place(soup, world, origin) {
  const { columns, normals, mirrored } = linearParts(world);
  const placed = { ...soup };
  placed.position = turnRows(soup.position, 3, columns, subtract(world.slice(12, 15), origin));
  placed.normal = unitRows(turnRows(soup.normal, 3, normals, [0, 0, 0]), 3);
  if (soup.tangent) {
    placed.tangent = unitRows(turnRows(soup.tangent, 4, columns, [0, 0, 0]), 4);
    for (let at = 3; mirrored && at < placed.tangent.length; at += 4) placed.tangent[at] *= -1;
  }
  return mirrored ? turnedOver(placed) : placed;
}

/** Turns the first three numbers of each row and moves them. Without lists in between: there are many. */
function turnRows(values, size, [a, b, c], move) {
  const turned = values.slice();
  for (let at = 0; at < values.length; at += size) {
    const [x, y, z] = [values[at], values[at + 1], values[at + 2]];
    for (let k = 0; k < 3; k += 1) turned[at + k] = a[k] * x + b[k] * y + c[k] * z + move[k];
  }
  return turned;
}

/** Makes the first three numbers of each row a unit vector, in place; what has no direction stays. */
function unitRows(values, size) {
  for (let at = 0; at < values.length; at += size) {
    const long = Math.hypot(values[at], values[at + 1], values[at + 2]) || 1;
    for (let k = 0; k < 3; k += 1) values[at + k] /= long;
  }
  return values;
}

/** The triangles of a mirrored surface, wound so that their fronts stay fronts. */
function turnedOver(corners) {
  const triangles = corners.position.length / 9;
  return Object.fromEntries(Object.entries(corners).map(([key, values]) => {
    const size = values.length / (3 * triangles);
    const turned = values.slice();
    for (let at = 0; at < values.length; at += 3 * size) {
      turned.set(values.subarray(at + 2 * size, at + 3 * size), at + size);
      turned.set(values.subarray(at + size, at + 2 * size), at + 2 * size);
    }
    return [key, turned];
  }));
}

/** Corners of several primitives one after another; what only some have is zero, or white, in the rest. */
function joinCorners(parts) {
  const count = parts.reduce((sum, part) => sum + part.position.length / 3, 0);
  const corners = {};
  for (const key of new Set(parts.flatMap(Object.keys))) {
    const size = CORNER[key]?.size ?? 4;
    corners[key] = new Float32Array(count * size).fill(key === 'color' ? 1 : 0);
    let at = 0;
    for (const part of parts) {
      if (part[key]) corners[key].set(part[key], at);
      at += (part.position.length / 3) * size;
    }
  }
  return { corners, triangles: count / 3 };
}
