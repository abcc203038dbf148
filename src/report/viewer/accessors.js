// Accessors of a glTF document as flat arrays of numbers.

const COMPONENTS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16 };

/** By component type: bytes, reader of a DataView, the largest integer, and the array of such. */
const TYPES = {
  5120: { size: 1, get: 'getInt8', most: 127, List: Int8Array },
  5121: { size: 1, get: 'getUint8', most: 255, List: Uint8Array },
  5122: { size: 2, get: 'getInt16', most: 32767, List: Int16Array },
  5123: { size: 2, get: 'getUint16', most: 65535, List: Uint16Array },
  5125: { size: 4, get: 'getUint32', most: 4294967295, List: Uint32Array },
  5126: { size: 4, get: 'getFloat32', most: 1, List: Float32Array },
};

/** The values of an accessor, normalized if it is, with how many make an element. */
function readAccessor(file, index) {
  const accessor = file.json.accessors?.[index];
  if (!accessor) throw new Error(`/accessors/${index} is not there`);
  const components = COMPONENTS[accessor.type];
  const type = TYPES[accessor.componentType];
  if (!components || !type) throw new Error(`/accessors/${index} is of an unknown type`);
  const shape = { type, components, count: accessor.count };
  const values = accessor.bufferView === undefined
    ? new type.List(accessor.count * components)
    : readView(file, accessor.bufferView, accessor.byteOffset ?? 0, shape);
  if (accessor.sparse) applySparse(file, accessor, shape, values);
  if (!accessor.normalized) return { values, components };
  return { values: Float32Array.from(values, (x) => Math.max(x / type.most, -1)), components };
}

function readView(file, index, offset, { type, components, count }) {
  const view = file.json.bufferViews?.[index];
  if (!view || (view.buffer ?? 0) !== 0) throw new Error(`/bufferViews/${index} is not there`);
  const start = (view.byteOffset ?? 0) + offset;
  const stride = view.byteStride ?? type.size * components;
  const end = start + stride * (count - 1) + type.size * components;
  if (count > 0 && end > file.binary.byteLength) throw new Error(`/bufferViews/${index} runs past its buffer`);
  const values = new type.List(count * components);
  if (stride === type.size * components) {
    // Copied, as it may lie at any place in the file; numbers are little-endian here and there.
    new Uint8Array(values.buffer).set(file.binary.subarray(start, start + values.byteLength));
    return values;
  }
  const bytes = new DataView(file.binary.buffer, file.binary.byteOffset, file.binary.byteLength);
  for (let element = 0, at = 0; element < count; element += 1) {
    for (let component = 0; component < components; component += 1, at += 1) {
      values[at] = bytes[type.get](start + stride * element + type.size * component, true);
    }
  }
  return values;
}

function applySparse(file, accessor, { type, components }, values) {
  const { count, indices, values: changed } = accessor.sparse;
  const place = { type: TYPES[indices.componentType], components: 1, count };
  const places = readView(file, indices.bufferView, indices.byteOffset ?? 0, place);
  const rows = readView(file, changed.bufferView, changed.byteOffset ?? 0, { type, components, count });
  places.forEach((element, row) => {
    values.set(rows.subarray(row * components, (row + 1) * components), element * components);
  });
}
