// A copy of a .glb or .gltf in which all is white, so that its silhouette can be drawn by anything.
import { readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';

const JSON_CHUNK = 0x4e4f534a;

// The document and its binary chunk, or the .bin beside it.
export function read(path) {
  const bytes = readFileSync(path);
  if (bytes.toString('latin1', 0, 4) !== 'glTF') {
    const json = JSON.parse(bytes.toString());
    const uri = json.buffers[0].uri;
    delete json.buffers[0].uri;
    return { json, bin: readFileSync(join(dirname(path), decodeURIComponent(uri))) };
  }
  const length = bytes.readUInt32LE(12);
  const json = JSON.parse(bytes.toString('utf8', 20, 20 + length));
  return { json, bin: bytes.subarray(20 + length + 8) };
}

// Writes the white copy; without what is a level by its name, as an engine shows one at a time.
export function writePlain(from, to) {
  const { json, bin } = read(from);
  const pbrMetallicRoughness = { baseColorFactor: [1, 1, 1, 1], metallicFactor: 0 };
  json.materials = [{ pbrMetallicRoughness, doubleSided: true }];
  for (const list of ['images', 'textures', 'samplers']) delete json[list];
  for (const { primitives } of json.meshes) {
    for (const primitive of primitives) {
      primitive.material = 0;
      delete primitive.attributes.COLOR_0;
      delete primitive.extensions;
    }
  }
  const hide = (node) => {
    delete node.mesh;
    for (const child of node.children ?? []) hide(json.nodes[child]);
  };
  json.nodes.filter(({ name }) => /_LOD[1-9]\d*$/.test(name ?? '')).forEach(hide);
  writeFileSync(to, container(json, bin));
}

function container(json, bin) {
  const text = Buffer.from(JSON.stringify(json));
  const padded = (bytes, filler) =>
    Buffer.concat([bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4, filler)]);
  const [a, b] = [padded(text, ' '), padded(bin, 0)];
  const header = Buffer.alloc(20);
  header.write('glTF', 0, 'latin1');
  [2, 28 + a.length + b.length, a.length, JSON_CHUNK].forEach((word, i) => {
    header.writeUInt32LE(word, 4 + 4 * i);
  });
  const chunk = Buffer.alloc(8);
  chunk.writeUInt32LE(b.length, 0);
  chunk.write('BIN\0', 4, 'latin1');
  return Buffer.concat([header, a, chunk, b]);
}
