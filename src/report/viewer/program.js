// Shader programs, from the sources in the page.

const HEAD = '#version 300 es\nprecision highp float;\nprecision highp int;\n';

/** The source of a shader, by the name of its file. */
function shaderSource(name) {
  const element = document.getElementById(`shader-${name}`);
  if (!element) throw new Error(`the page lacks its shader ${name}: it was cut or changed`);
  return element.textContent.trim();
}

class Program {
  constructor(gl, vertex, ...fragment) {
    this.gl = gl;
    this.handle = gl.createProgram();
    this.attach(gl.VERTEX_SHADER, shaderSource(vertex));
    this.attach(gl.FRAGMENT_SHADER, HEAD + fragment.map(shaderSource).join('\n'));
    gl.linkProgram(this.handle);
    if (!gl.getProgramParameter(this.handle, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`a shader does not link: ${gl.getProgramInfoLog(this.handle)}`);
    }
    this.places = {};
    const count = gl.getProgramParameter(this.handle, gl.ACTIVE_UNIFORMS);
    for (let i = 0; i < count; i += 1) {
      const { name } = gl.getActiveUniform(this.handle, i);
      this.places[name.replace('[0]', '')] = gl.getUniformLocation(this.handle, name);
    }
  }

  attach(kind, source) {
    const { gl } = this;
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(shader)}`);
    }
    gl.attachShader(this.handle, shader);
  }

  /** Sets uniforms by their names: whole numbers and flags by `int`, the rest by its length. */
  set(values) {
    const { gl } = this;
    for (const [name, value] of Object.entries(values)) {
      const at = this.places[name];
      if (typeof value === 'boolean') gl.uniform1i(at, Number(value));
      else if (typeof value === 'number') gl.uniform1f(at, value);
      else if (value.length === 16) gl.uniformMatrix4fv(at, false, value);
      else gl[`uniform${value.length}fv`](at, value);
    }
  }

  setInt(name, value) {
    this.gl.uniform1i(this.places[name], value);
  }
}
