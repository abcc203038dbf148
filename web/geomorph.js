// Lets a mesh change to its next coarser level without a jump: vertices that say where they come to lie there
// (`bake --geomorph`) are blended by one number, 0 for the level and 1 for the next. At both ends the picture is
// that of the level, so a switch between them is not seen.
//
// Tangents and colors are not blended.

const BLENDS = [
  ['_geomorph_position', 'vec3', 'begin_vertex', (own) => `${own}\ntransformed = mix( transformed, _geomorph_position, geomorph );`],
  ['_geomorph_normal', 'vec3', 'beginnormal_vertex', (own) => `${own}\nobjectNormal = mix( objectNormal, _geomorph_normal, geomorph );`],
  // The chunk reads an attribute, which can't be set.
  ['_geomorph_texcoord_0', 'vec2', 'uv_vertex', (own) => [
    '#ifdef USE_UV', '#define GEOMORPH_UV', '#endif',
    '#if defined( GEOMORPH_UV ) || defined( USE_MAP ) || defined( USE_NORMALMAP ) || defined( USE_ROUGHNESSMAP ) || defined( USE_METALNESSMAP ) || defined( USE_AOMAP ) || defined( USE_EMISSIVEMAP )',
    'vec2 geomorphUv = mix( uv, _geomorph_texcoord_0, geomorph );', '#define uv geomorphUv', '#endif', own, '#undef uv',
  ].join('\n')],
];

const blended = (material, blends, time) => {
  const own = material.clone();
  const key = blends.map(([name]) => name).join();
  own.onBeforeCompile = (shader, renderer) => {
    material.onBeforeCompile(shader, renderer);
    shader.uniforms.geomorph = time;
    const declared = blends.map(([name, type]) => `attribute ${type} ${name};`);
    shader.vertexShader = ['uniform float geomorph;', ...declared, shader.vertexShader].join('\n');
    blends.forEach(([, , chunk, blend]) => {
      const include = `#include <${chunk}>`;
      shader.vertexShader = shader.vertexShader.replace(include, blend(include));
    });
  };
  own.customProgramCacheKey = () => `geomorph ${key} ${material.customProgramCacheKey()}`;
  return own;
};

// Gives the meshes below an object that have such attributes materials that blend. Returns what they blend by:
// set its `value`. Meshes without them stay as they are.
export function blendGeomorphs(object, time = { value: 0 }) {
  object.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const blends = BLENDS.filter(([name]) => mesh.geometry.attributes[name]);
    if (blends.length === 0) return;
    const { material } = mesh;
    mesh.material = Array.isArray(material) ? material.map((own) => blended(own, blends, time)) : blended(material, blends, time);
  });
  return time;
}
