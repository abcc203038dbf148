// Materials of a document as the shader takes them, and their images as textures.

/** The textures of a material: uniform unit, where the document names it, and whether it is a color. */
const SLOTS = [
  { name: 'baseColor', color: true },
  { name: 'metallicRoughness', color: false },
  { name: 'normal', color: false },
  { name: 'occlusion', color: false },
  { name: 'emissive', color: true },
];

/** The material of an index; that of glTF for primitives that name none. */
function readMaterial(json, index) {
  const own = json.materials?.[index] ?? {};
  const pbr = own.pbrMetallicRoughness ?? {};
  const older = own.extensions?.KHR_materials_pbrSpecularGlossiness;
  const infos = [
    older ? older.diffuseTexture : pbr.baseColorTexture,
    pbr.metallicRoughnessTexture, own.normalTexture, own.occlusionTexture, own.emissiveTexture,
  ];
  const strength = own.extensions?.KHR_materials_emissive_strength?.emissiveStrength ?? 1;
  return {
    index,
    baseColor: (older ? older.diffuseFactor : pbr.baseColorFactor) ?? [1, 1, 1, 1],
    metallic: older ? 0 : pbr.metallicFactor ?? 1,
    roughness: pbr.roughnessFactor ?? 1,
    normalScale: own.normalTexture?.scale ?? 1,
    occlusionStrength: own.occlusionTexture?.strength ?? 1,
    emissive: scale(own.emissiveFactor ?? [0, 0, 0], strength),
    alphaMode: own.alphaMode ?? 'OPAQUE',
    alphaCutoff: own.alphaCutoff ?? 0.5,
    doubleSided: own.doubleSided ?? false,
    unlit: Boolean(own.extensions?.KHR_materials_unlit),
    textures: infos.map((info) => (info ? readTexture(json, info) : null)),
  };
}

function readTexture(json, info) {
  const texture = json.textures?.[info.index];
  if (!texture) throw new Error(`/textures/${info.index} is not there`);
  const sampler = json.samplers?.[texture.sampler] ?? {};
  const moved = info.extensions?.KHR_texture_transform ?? {};
  const image = texture.extensions?.EXT_texture_webp?.source
    ?? texture.extensions?.KHR_texture_basisu?.source ?? texture.source;
  return image === undefined ? null : {
    image,
    wrap: [sampler.wrapS ?? 10497, sampler.wrapT ?? 10497],
    uvSet: moved.texCoord ?? info.texCoord ?? 0,
    ...textureTransform(moved),
  };
}

/** `KHR_texture_transform`: what is scaled, then turned, then moved; columns, then the offset. */
function textureTransform({ offset = [0, 0], rotation = 0, scale: [sx, sy] = [1, 1] }) {
  const [cosine, sine] = [Math.cos(rotation), Math.sin(rotation)];
  return { matrix: [cosine * sx, -sine * sx, sine * sy, cosine * sy], offset };
}

/** The textures on the graphics side, each image once per way of reading it. */
class TexturePool {
  constructor(gl, images, complain) {
    Object.assign(this, { gl, images, complain, known: new Map(), samplers: new Map() });
    this.white = this.texel([255, 255, 255, 255]);
  }

  texel(rgba) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, Uint8Array.from(rgba));
    return texture;
  }

  /** Loads an image of the page; white, with a complaint, where that fails. */
  load(image, isColor) {
    const key = `${image} ${isColor}`;
    if (!this.known.has(key)) {
      this.known.set(key, this.upload(this.images[image], isColor).catch((error) => {
        this.complain(`Texture ${image} could not be read, and is shown white: ${error.message}`);
        return this.white;
      }));
    }
    return this.known.get(key);
  }

  async upload(image, isColor) {
    const { gl } = this;
    image.bytes ??= embeddedBytes(image.id);
    const options = { premultiplyAlpha: 'none', colorSpaceConversion: 'none' };
    const bitmap = await createImageBitmap(new Blob([image.bytes], { type: image.mime }), options);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    // Filtering and mip maps of a color are of light, which this format sees to.
    gl.texImage2D(gl.TEXTURE_2D, 0, isColor ? gl.SRGB8_ALPHA8 : gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
    gl.generateMipmap(gl.TEXTURE_2D);
    bitmap.close();
    return texture;
  }

  sampler(wrap) {
    const { gl } = this;
    const key = wrap.join();
    if (!this.samplers.has(key)) {
      const sampler = gl.createSampler();
      gl.samplerParameteri(sampler, gl.TEXTURE_WRAP_S, wrap[0]);
      gl.samplerParameteri(sampler, gl.TEXTURE_WRAP_T, wrap[1]);
      gl.samplerParameteri(sampler, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
      gl.samplerParameteri(sampler, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
      this.samplers.set(key, sampler);
    }
    return this.samplers.get(key);
  }

  /** A material with its textures on the graphics side. */
  async dress(material, imageOf) {
    const dressed = async (texture, slot) => {
      const image = texture ? imageOf(texture.image) : null;
      // An image whose file is missing changes nothing.
      if (image === null || image === undefined) return null;
      return { ...texture, sampler: this.sampler(texture.wrap), handle: await this.load(image, SLOTS[slot].color) };
    };
    return { ...material, textures: await Promise.all(material.textures.map(dressed)) };
  }
}
