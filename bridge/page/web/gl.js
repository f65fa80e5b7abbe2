// SPDX-License-Identifier: Apache-2.0
// Thin names over WebGL 2: programs, textures, targets, meshes.
import {head, shaders} from './shaders.js';

/** A WebGL 2 context that can do what the pictures need; throws what is missing. */
export function contextOf(canvas) {
  const gl = canvas.getContext('webgl2', {alpha: false, antialias: false, depth: false,
    powerPreference: 'high-performance'});
  if (!gl) throw new Error('This browser has no WebGL 2, or it is switched off: use a newer one, or switch on graphics ' +
    'acceleration in its settings.');
  enableExtensions(gl);
  return gl;
}

/** Of a context, and again of one that was lost and came back. */
export function enableExtensions(gl) {
  if (!gl.getExtension('EXT_color_buffer_float')) {
    throw new Error('The WebGL 2 of this browser cannot draw into floating-point textures (EXT_color_buffer_float).');
  }
  gl.getExtension('KHR_parallel_shader_compile');  // where there is one, programs are linked beside this thread
  programs.delete(gl);
}

/** Throws where what was asked of `gl` since the last time could not be done. It waits for the GPU. A
 * lost context is told by its event. */
export function requireNoError(gl) {
  const error = gl.getError();
  if (error === gl.NO_ERROR || gl.isContextLost()) return;
  if (error === gl.OUT_OF_MEMORY) {
    throw new Error('The graphics memory is full: close other pages or make this window smaller, and load it again');
  }
  throw new Error(`This browser's WebGL 2 refuses the picture (error ${error}); load the page again`);
}

const programs = new WeakMap();  // of each context: by name and defines

/** A program of shaders.js, which the context keeps. The first call lets the driver begin with it and does not wait: called before the
 * volumes have come, it is linked when they have. */
export function programOf(gl, name, defines = '') {
  if (!programs.has(gl)) programs.set(gl, new Map());
  const known = programs.get(gl), key = `${name} ${defines}`;
  if (!known.has(key)) known.set(key, new Program(gl, name, defines));
  return known.get(key);
}

/** A program of `programOf`, or of one owner that keeps uniforms of its own in it. Uniforms are set by name; one that the linker removed is ignored. */
export class Program {
  constructor(gl, name, defines) {
    Object.assign(this, {gl, name, linked: false});
    this.program = gl.createProgram();
    this.locations = new Map();
    const stages = [[gl.VERTEX_SHADER, shaders[name].vertex], [gl.FRAGMENT_SHADER, shaders[name].fragment]];
    this.stages = stages.map(([kind, text]) => {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, head + defines + text);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
      return shader;
    });
    gl.linkProgram(this.program);
  }

  /** Waits until it is linked; throws why it cannot be. */
  use() {
    if (!this.linked) this.requireLinked();
    this.gl.useProgram(this.program);
  }
  requireLinked() {
    const {gl, program, stages} = this;
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const log = [...stages.map(one => gl.getShaderInfoLog(one)), gl.getProgramInfoLog(program)];
      throw new Error(`This browser's WebGL 2 refuses the shader ${this.name}: ${log.filter(Boolean)[0]}`);
    }
    for (const shader of stages) gl.deleteShader(shader);
    this.linked = true;
  }
  free() {
    this.gl.deleteProgram(this.program);
  }
  at(uniform) {
    if (!this.locations.has(uniform)) {
      this.locations.set(uniform, this.gl.getUniformLocation(this.program, uniform));
    }
    return this.locations.get(uniform);
  }
  /** Of the program in use. A number is a float; arrays of 2, 3, 4 are vectors, 9 and 16 matrices. */
  set(values) {
    const {gl} = this;
    for (const [name, value] of Object.entries(values)) {
      const at = this.at(name);
      switch (value.length) {
        case undefined: gl.uniform1f(at, value); break;
        case 2: gl.uniform2fv(at, value); break;
        case 3: gl.uniform3fv(at, value); break;
        case 4: gl.uniform4fv(at, value); break;
        case 9: gl.uniformMatrix3fv(at, false, value); break;
        case 16: gl.uniformMatrix4fv(at, false, value); break;
      }
    }
  }
  /** Samplers and other integers. */
  setInts(values) {
    for (const [name, value] of Object.entries(values)) this.gl.uniform1i(this.at(name), value);
  }
}

/** An immutable texture with one level; `size` of two or three numbers. */
export function texture(gl, target, format, filter, size) {
  const made = gl.createTexture();
  gl.bindTexture(target, made);
  for (const kind of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, kind, filter);
  for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) {
    gl.texParameteri(target, axis, gl.CLAMP_TO_EDGE);
  }
  if (size.length === 3) gl.texStorage3D(target, 1, format, ...size);
  else gl.texStorage2D(target, 1, format, ...size);
  return made;
}

export function bind(gl, unit, target, what) {
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(target, what);
}

/** Colour textures of these formats and, if asked for, a depth texture, as a place to draw. */
export class Target {
  constructor(gl, width, height, formats, depth = true) {
    Object.assign(this, {gl, width, height});
    this.framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    this.colours = formats.map((format, i) => {
      const linear = format === gl.RGBA8 ? gl.LINEAR : gl.NEAREST;
      const colour = texture(gl, gl.TEXTURE_2D, format, linear, [width, height]);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, colour, 0);
      return colour;
    });
    gl.drawBuffers(formats.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
    if (!depth) return;
    this.depth = texture(gl, gl.TEXTURE_2D, gl.DEPTH_COMPONENT32F, gl.NEAREST, [width, height]);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.depth, 0);
  }

  /** Makes `part` of it the place to draw. */
  bind(part) {
    const {gl} = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.viewport(0, 0, this.width, this.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(part.x0, part.y0, part.x1 - part.x0, part.y1 - part.y0);
  }
  /** Takes colour and depth of `part` over. */
  copy(from, part) {
    const {gl} = this;
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, from.framebuffer);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.framebuffer);
    const box = [part.x0, part.y0, part.x1, part.y1];
    gl.blitFramebuffer(...box, ...box, gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT, gl.NEAREST);
  }
  free() {
    for (const colour of this.colours) this.gl.deleteTexture(colour);
    if (this.depth) this.gl.deleteTexture(this.depth);
    this.gl.deleteFramebuffer(this.framebuffer);
  }
}

/** Triangles of mesh.js in the memory of the GPU. */
export class GpuMesh {
  constructor(gl, mesh) {
    this.gl = gl;
    this.indices = mesh.triangles.length;
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    this.buffers = [gl.createBuffer(), gl.createBuffer()];
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(mesh.vertices), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers[1]);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(mesh.triangles), gl.STATIC_DRAW);
    for (const attribute of [0, 1]) {
      gl.enableVertexAttribArray(attribute);
      gl.vertexAttribPointer(attribute, 3, gl.FLOAT, false, 24, 12 * attribute);
    }
    gl.bindVertexArray(null);
  }
  draw() {
    this.gl.bindVertexArray(this.array);
    this.gl.drawElements(this.gl.TRIANGLES, this.indices, this.gl.UNSIGNED_INT, 0);
  }
  free() {
    this.gl.deleteVertexArray(this.array);
    for (const buffer of this.buffers) this.gl.deleteBuffer(buffer);
  }
}

/** One triangle over the place to draw, with the program in use. */
export function cover(gl) {
  gl.bindVertexArray(null);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
}
