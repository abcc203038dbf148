// Pictures that are drawn before they are shown: linear light, several samples a pixel.

class Targets {
  constructor(gl) {
    this.gl = gl;
    this.size = [0, 0];
    // A color format of light, so that samples and glass are mixed as light is.
    this.samples = Math.min(4, gl.getParameter(gl.MAX_SAMPLES));
    this.sampled = gl.createFramebuffer();
    this.colors = gl.createRenderbuffer();
    this.depths = gl.createRenderbuffer();
    this.pictures = [0, 1].map(() => ({ frame: gl.createFramebuffer(), texture: gl.createTexture() }));
  }

  /** Makes all pictures of a size in pixels. */
  resize(width, height) {
    const { gl } = this;
    if (this.size[0] === width && this.size[1] === height) return;
    this.size = [width, height];
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sampled);
    const parts = [
      [this.colors, gl.SRGB8_ALPHA8, gl.COLOR_ATTACHMENT0],
      [this.depths, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT],
    ];
    for (const [buffer, format, place] of parts) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, this.samples, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
    }
    this.pictures.forEach(({ frame, texture }) => {
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
      for (const edge of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, edge, gl.CLAMP_TO_EDGE);
      for (const way of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, way, gl.NEAREST);
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    });
  }

  /** Starts a picture of a background, given as sRGB: that part of its width. */
  begin(background, [from, to]) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.sampled);
    gl.viewport(0, 0, ...this.size);
    const [left, right] = [Math.floor(from * this.size[0]), Math.ceil(to * this.size[0])];
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, 0, right - left, this.size[1]);
    gl.depthMask(true);
    gl.colorMask(true, true, true, true);
    gl.clearColor(...background.map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4)), 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  /** Ends it: the picture of that number is done. */
  finish(number) {
    const { gl } = this;
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.sampled);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.pictures[number].frame);
    gl.blitFramebuffer(0, 0, ...this.size, 0, 0, ...this.size, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    return this.pictures[number].texture;
  }
}
