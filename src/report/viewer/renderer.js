// Draws models, in any of the shadings, into parts of a canvas.

/** Shadings in the order of the shader's constants. The difference to the source is none: it is made of pictures. */
const SHADINGS = ['lit', 'base', 'normals', 'flat', 'smooth', 'triangles', 'charts', 'checker', 'distance'];
const ALPHA_MODES = ['OPAQUE', 'MASK', 'BLEND'];
/** Attributes by their place in the vertex shader, with what stands for one that is not there. */
const ATTRIBUTES = [
  { key: 'position', size: 3, otherwise: [0, 0, 0, 1] },
  { key: 'normal', size: 3, otherwise: [0, 0, 1, 0] },
  { key: 'tangent', size: 4, otherwise: [0, 0, 0, 1] },
  { key: 'uv', size: 2, otherwise: [0, 0, 0, 1] },
  { key: 'uv1', size: 2, otherwise: [0, 0, 0, 1] },
  { key: 'color', size: 4, otherwise: [1, 1, 1, 1] },
];
const VALUE = ATTRIBUTES.length;

/** Batches in the order that they are drawn in: the opaque ones first. */
function glassLast(batches) {
  const isGlass = ({ material }) => material.alphaMode === 'BLEND';
  return batches.sort((a, b) => isGlass(a) - isGlass(b));
}

class Renderer {
  constructor(canvas, images, complain) {
    const gl = canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false });
    if (!gl) throw new Error('this browser offers no WebGL 2, which the view needs; the rest of the page does not');
    this.gl = gl;
    this.textures = new TexturePool(gl, images, complain);
    this.surface = new Program(gl, 'surface.vert', 'color', 'light', 'surface.frag');
    this.composite = new Program(gl, 'composite.vert', 'color', 'composite.frag');
    this.targets = new Targets(gl);
    this.empty = gl.createVertexArray();
    this.background = [0.5, 0.5, 0.5];
  }

  /** Puts a model's batches on the graphics side. */
  async upload(scene, json, imageOf) {
    const batches = scene.batches.map(async (batch) => {
      const material = await this.textures.dress(readMaterial(json, batch.material), imageOf);
      return this.equip(batch, material);
    });
    return glassLast(await Promise.all(batches));
  }

  /** Gives a model other corners, in the materials that it has. */
  refill(model, scene) {
    const { gl } = this;
    for (const { vertices, buffers, values } of model.batches) {
      gl.deleteVertexArray(vertices);
      [...buffers, ...values.values()].forEach((buffer) => gl.deleteBuffer(buffer));
    }
    model.batches = glassLast(scene.batches.map((batch) => this.equip(batch, model.materials.get(batch.material))));
  }

  equip(batch, material) {
    const { gl } = this;
    const vertices = gl.createVertexArray();
    gl.bindVertexArray(vertices);
    const buffers = ATTRIBUTES.flatMap(({ key, size }, place) => {
      const values = batch.corners[key];
      return values ? [this.fill(place, size, values)] : [];
    });
    gl.bindVertexArray(null);
    return { ...batch, material, vertices, buffers, values: new Map() };
  }

  fill(place, size, values) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
    return buffer;
  }

  /** Draws a part of the width of a model's picture, which gets that number; its texture. */
  draw(model, view, look, number, part = [0, 1]) {
    const { gl, surface, targets } = this;
    targets.begin(this.background, part);
    gl.useProgram(surface.handle);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    surface.set({
      u_view_projection: view.matrix, u_eye: view.eye, u_to_key: view.toKey, u_wireframe: look.wireframe,
    });
    surface.setInt('u_shading', SHADINGS.indexOf(look.shading));
    for (const batch of model.batches) this.drawBatch(batch, look);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(null);
    return targets.finish(number);
  }

  drawBatch(batch, look) {
    const { gl } = this;
    this.wear(batch);
    gl.bindVertexArray(batch.vertices);
    ATTRIBUTES.forEach(({ key, otherwise }, place) => {
      if (!batch.corners[key]) gl.vertexAttrib4fv(place, otherwise);
    });
    this.takeValues(batch, look);
    if (batch.material.doubleSided) gl.disable(gl.CULL_FACE);
    else gl.enable(gl.CULL_FACE);
    const isGlass = batch.material.alphaMode === 'BLEND' && SHADINGS.indexOf(look.shading) < 2;
    if (isGlass) {
      // Only the nearest of blended surfaces is seen, whatever their order.
      gl.colorMask(false, false, false, false);
      gl.drawArrays(gl.TRIANGLES, 0, batch.triangles * 3);
      gl.colorMask(true, true, true, true);
      gl.enable(gl.BLEND);
    } else {
      gl.disable(gl.BLEND);
    }
    gl.drawArrays(gl.TRIANGLES, 0, batch.triangles * 3);
  }

  /** Gives the corners of a batch their numbers of charts, or their distances to a level. */
  takeValues(batch, { shading, distances }) {
    const { gl } = this;
    const key = shading === 'charts' ? 'charts' : shading === 'distance' ? distances?.attribute : null;
    const values = key && batch.corners[key];
    if (!values) {
      gl.disableVertexAttribArray(VALUE);
      gl.vertexAttrib4f(VALUE, 0, 0, 0, 1);
      return;
    }
    if (!batch.values.has(key)) batch.values.set(key, this.fill(VALUE, 1, values));
    gl.bindBuffer(gl.ARRAY_BUFFER, batch.values.get(key));
    gl.enableVertexAttribArray(VALUE);
    // The distances to four levels lie side by side.
    const [stride, offset] = key === 'charts' ? [0, 0] : [16, 4 * distances.component];
    gl.vertexAttribPointer(VALUE, 1, gl.FLOAT, false, stride, offset);
  }

  /** Sets the uniforms and textures of a material. */
  wear({ material, corners }) {
    const { gl, surface } = this;
    surface.set({
      u_base_color: material.baseColor, u_metallic: material.metallic, u_roughness: material.roughness,
      u_normal_scale: material.normalScale, u_occlusion_strength: material.occlusionStrength,
      u_emissive: material.emissive, u_alpha_cutoff: material.alphaCutoff, u_unlit: material.unlit,
      u_has_normal_map: Boolean(material.textures[2] && corners.tangent), u_has_uv: Boolean(corners.uv),
    });
    surface.setInt('u_alpha_mode', Math.max(0, ALPHA_MODES.indexOf(material.alphaMode)));
    const { u_uv_set: sets, u_uv_matrix: matrices, u_uv_offset: offsets } = surface.places;
    const of = (get, otherwise) => material.textures.flatMap((texture) => (texture ? get(texture) : otherwise));
    gl.uniform1iv(sets, of((texture) => texture.uvSet, 0));
    gl.uniformMatrix2fv(matrices, false, of((texture) => texture.matrix, [1, 0, 0, 1]));
    gl.uniform2fv(offsets, of((texture) => texture.offset, [0, 0]));
    material.textures.forEach((texture, slot) => {
      surface.setInt(`u_texture_${slot}`, slot);
      gl.activeTexture(gl.TEXTURE0 + slot);
      gl.bindTexture(gl.TEXTURE_2D, texture?.handle ?? this.textures.white);
      gl.bindSampler(slot, texture?.sampler ?? this.textures.sampler([10497, 10497]));
    });
  }

  /** Shows a picture, or how it differs from another, in a part of the canvas; all in pixels. */
  show(picture, reference, [x, y, width, height], clip) {
    const { gl, composite } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(x, y, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...clip);
    this.paint(composite, picture, reference);
    gl.disable(gl.SCISSOR_TEST);
  }

  paint(composite, picture, reference) {
    const { gl } = this;
    gl.useProgram(composite.handle);
    composite.set({ u_difference: Boolean(reference) });
    [picture, reference ?? picture].forEach((texture, unit) => {
      composite.setInt(['u_picture', 'u_reference'][unit], unit);
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.bindSampler(unit, null);
    });
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
  }

  /** Clears the whole canvas, to a color in sRGB. */
  clear(color) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.clearColor(...color, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
  }

  /** The pixels of a model's picture, rows from below, as a screen shows them. */
  pixels(model, view, look, side) {
    const { gl } = this;
    this.targets.resize(side, side);
    const picture = this.draw(model, view, look, 0);
    const [frame, shown] = [gl.createFramebuffer(), gl.createRenderbuffer()];
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.bindRenderbuffer(gl.RENDERBUFFER, shown);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, side, side);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, shown);
    gl.viewport(0, 0, side, side);
    this.paint(this.composite, picture, null);
    const pixels = new Uint8Array(4 * side * side);
    gl.readPixels(0, 0, side, side, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    gl.deleteFramebuffer(frame);
    gl.deleteRenderbuffer(shown);
    return pixels;
  }
}
