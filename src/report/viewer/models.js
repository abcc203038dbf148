// The models of the page: read from its parts, and made ready to be drawn.

/** How far from the world's origin, in their own sizes, models stand before they are counted from nearer. */
const FAR = 16;

/** One entry per model: those the page names, or for one file of several levels each of them. */
async function readModels(config) {
  const models = [];
  for (const named of config.models) {
    const glb = parseGlb(await unpack(embeddedBytes(named.id)));
    models.push(...modelsOf(named, { ...glb, images: named.images, name: named.file }, config.models.length === 1));
  }
  return models;
}

function modelsOf(named, file, isAlone) {
  const said = file.json.asset?.extras?.seamwise;
  const counts = file.json.extensions?.[TIMELINE]?.triangles;
  const progress = counts === undefined ? null : new Progress(readAccessor(file, counts).values);
  const levels = isAlone ? levelsBeside(file.json) : 0;
  return Array.from({ length: levels + 1 }, (_, level) => {
    const isLevel = named.is_level || level > 0;
    const certificate = named.certificate ?? (level > 0 ? said?.levels?.[level - 1] : said);
    return {
      name: level > 0 ? `Level ${level}` : named.name,
      file,
      level,
      progress,
      // Each level of a progressive file has a size of its own, which it does not tell.
      largest: isLevel ? (progress ? null : sizeOf(certificate)) : Infinity,
      distances: named.distances,
    };
  });
}

/** The largest size a certificate allows; without bound where none is written, nothing without a certificate. */
function sizeOf(certificate) {
  if (certificate?.largest_size_pixels === undefined) return null;
  return certificate.largest_size_pixels ?? Infinity;
}

/** Where the positions of all models are counted from: the world's origin, if that is near enough. */
function originOf(file) {
  const [first] = worldNodes(file.json, 0);
  if (!first) return [0, 0, 0];
  const primitive = file.json.meshes[file.json.nodes[first.node].mesh].primitives[0];
  const bounds = file.json.accessors?.[primitive.attributes.POSITION];
  if (!bounds?.min || !bounds.max) return [0, 0, 0];
  const { columns } = linearParts(first.world);
  const place = add(turn(columns, scale(add(bounds.min, bounds.max), 0.5)), first.world.slice(12, 15));
  const size = length(turn(columns, subtract(bounds.max, bounds.min)));
  return Math.max(...place.map(Math.abs)) > FAR * size ? place.map(Math.round) : [0, 0, 0];
}

/** Flattens a model and gives it to the graphics side. */
async function loadModel(model, renderer, origin) {
  // All materials are there at the last moment.
  const time = (model.progress?.triangles.length ?? 1) - 1;
  const moment = { time, coarse: time, share: 0 };
  const scene = flattenScene(model.file, model.level, origin, moment);
  if (scene.triangles === 0) throw new Error('it has no triangles to be seen');
  Object.assign(model, { origin, moment, triangles: scene.triangles, bounds: boundsOf(scene.batches) });
  const { json, images } = model.file;
  model.batches = await renderer.upload(scene, json, (image) => images[image]);
  model.materials = new Map(model.batches.map(({ material }) => [material.index, material]));
  return model;
}

/** The level that may be shown where the diagonal spans so many pixels: the coarsest that is good for them. */
function selectLevel(models, pixels) {
  let chosen = 0;
  let size = Infinity;
  for (let at = 1; at < models.length; at += 1) {
    size = Math.min(size, models[at].largest ?? 0);
    if (pixels > size) break;
    chosen = at;
  }
  return chosen;
}
