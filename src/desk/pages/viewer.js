// A small viewer of surfaces with WebGL 2: turn, move, zoom; surfaces, lines and points that can be hidden.
import { Camera, normalsOf } from "./math.js";

const SURFACE_VERTEX = `#version 300 es
uniform mat4 clipFromWorld;
uniform mat3 viewFromWorld;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 color;
layout(location = 3) in vec4 overlay;
out vec3 viewNormal;
out vec4 paint;
void main() {
  viewNormal = viewFromWorld * normal;
  paint = vec4(mix(color, overlay.rgb, overlay.a), 1.0);
  gl_Position = clipFromWorld * vec4(position, 1.0);
}`;

const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
uniform float opacity;
uniform bool flat_;
in vec3 viewNormal;
in vec4 paint;
out vec4 pixel;
void main() {
  if (flat_) { pixel = vec4(paint.rgb, opacity); return; }
  vec3 n = normalize(viewNormal);
  float back = gl_FrontFacing ? 1.0 : 0.55;
  if (!gl_FrontFacing) n = -n;
  float key = max(dot(n, normalize(vec3(-0.45, 0.6, 0.7))), 0.0);
  float fill = 0.5 + 0.5 * n.y;
  float light = (0.34 + 0.18 * fill + 0.62 * key) * back;
  pixel = vec4(pow(pow(paint.rgb, vec3(2.2)) * light, vec3(1.0 / 2.2)), opacity);
}`;

const POINT_VERTEX = `#version 300 es
uniform mat4 clipFromWorld;
uniform float size;
layout(location = 0) in vec3 position;
void main() {
  gl_Position = clipFromWorld * vec4(position, 1.0);
  gl_PointSize = size;
}`;

const POINT_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 color;
uniform bool round_;
out vec4 pixel;
void main() {
  if (round_) {
    float r = length(gl_PointCoord - 0.5);
    if (r > 0.5 || r < 0.32) discard;
  }
  pixel = color;
}`;

/**
 * A surface on the graphics processor.
 * @typedef {{ positions: Float32Array, indices: Uint32Array, vao: WebGLVertexArrayObject, colors: WebGLBuffer,
 *   overlay: WebGLBuffer | null, edges: WebGLBuffer | null, color: number[], buffers: WebGLBuffer[],
 *   isVisible: boolean, opacity: number, hasColors: boolean }} Drawn
 * @typedef {{ vao: WebGLVertexArrayObject, buffer: WebGLBuffer, count: number, color: number[], mode: "loop" | "line" | "points",
 *   isVisible: boolean, isOnTop: boolean }} DrawnLine
 */

export class Viewer {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    /** @type {WebGL2RenderingContext} */
    this.gl = gl;
    this.camera = new Camera();
    /** @type {Drawn[]} */
    this.surfaces = [];
    /** @type {DrawnLine[]} */
    this.lines = [];
    this.isWireframe = false;
    this.isWaiting = false;
    /** The duration of the script of the last frame, in milliseconds. */
    this.scriptMs = 0;
    this.frames = 0;
    /** Takes a press of the pointer; true if it does not turn the view. @type {((e: PointerEvent) => boolean) | null} */
    this.onPress = null;
    /** @type {((e: PointerEvent) => void) | null} */
    this.onDrag = null;
    /** @type {((e: PointerEvent) => void) | null} */
    this.onRelease = null;
    this.programs = {
      surface: program(gl, SURFACE_VERTEX, SURFACE_FRAGMENT),
      point: program(gl, POINT_VERTEX, POINT_FRAGMENT),
    };
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
    canvas.addEventListener("webglcontextlost", (e) => e.preventDefault());
    // All buffers are gone; the page makes them again. Strokes that were not sent are kept.
    canvas.addEventListener("webglcontextrestored", () => location.reload());
  }

  aspect() {
    return this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
  }

  /**
   * @param {Float32Array} positions
   * @param {Uint32Array} indices
   * @param {number[]} color the colour of vertices without one, 0 to 255
   * @returns {Drawn}
   */
  addSurface(positions, indices, color) {
    const gl = this.gl;
    const vao = /** @type {WebGLVertexArrayObject} */ (gl.createVertexArray());
    gl.bindVertexArray(vao);
    const place = buffer(gl, gl.ARRAY_BUFFER, positions);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    const normals = buffer(gl, gl.ARRAY_BUFFER, normalsOf(positions, indices));
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 3, gl.BYTE, true, 4, 0);
    const colors = buffer(gl, gl.ARRAY_BUFFER, new Uint8Array(0));
    const faces = buffer(gl, gl.ELEMENT_ARRAY_BUFFER, indices);
    gl.bindVertexArray(null);
    const buffers = [place, normals, colors, faces];
    const drawn = {
      positions,
      indices,
      vao,
      colors,
      overlay: null,
      edges: null,
      color,
      buffers,
      isVisible: true,
      opacity: 1,
      hasColors: false,
    };
    this.surfaces.push(drawn);
    this.draw();
    return drawn;
  }

  /** @param {Drawn} drawn @param {Uint8Array | null} colors 3 bytes per vertex, or none for the surface's one colour */
  setColors(drawn, colors) {
    const gl = this.gl;
    gl.bindVertexArray(drawn.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, drawn.colors);
    drawn.hasColors = colors !== null;
    if (colors) {
      gl.bufferData(gl.ARRAY_BUFFER, colors, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(2);
      gl.vertexAttribPointer(2, 3, gl.UNSIGNED_BYTE, true, 0, 0);
    } else {
      gl.disableVertexAttribArray(2);
    }
    gl.bindVertexArray(null);
    this.draw();
  }

  /** @param {Drawn} drawn @param {Uint8Array} overlay 4 bytes per vertex: a colour and how much it covers */
  setOverlay(drawn, overlay) {
    const gl = this.gl;
    gl.bindVertexArray(drawn.vao);
    if (!drawn.overlay) {
      drawn.overlay = /** @type {WebGLBuffer} */ (gl.createBuffer());
      drawn.buffers.push(drawn.overlay);
      gl.bindBuffer(gl.ARRAY_BUFFER, drawn.overlay);
      gl.enableVertexAttribArray(3);
      gl.vertexAttribPointer(3, 4, gl.UNSIGNED_BYTE, true, 0, 0);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, drawn.overlay);
    gl.bufferData(gl.ARRAY_BUFFER, overlay, gl.DYNAMIC_DRAW);
    gl.bindVertexArray(null);
    this.draw();
  }

  /** @param {Drawn} drawn */
  removeSurface(drawn) {
    this.surfaces = this.surfaces.filter((other) => other !== drawn);
    for (const one of drawn.buffers) this.gl.deleteBuffer(one);
    this.gl.deleteVertexArray(drawn.vao);
    this.draw();
  }

  /**
   * @param {Float32Array} points
   * @param {number[]} color
   * @param {"loop" | "line" | "points"} mode
   * @param {boolean} isOnTop whether surfaces do not hide it
   * @returns {DrawnLine}
   */
  addLine(points, color, mode, isOnTop) {
    const gl = this.gl;
    const vao = /** @type {WebGLVertexArrayObject} */ (gl.createVertexArray());
    gl.bindVertexArray(vao);
    const place = buffer(gl, gl.ARRAY_BUFFER, points);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.bindVertexArray(null);
    const line = { vao, buffer: place, count: points.length / 3, color, mode, isVisible: true, isOnTop };
    this.lines.push(line);
    this.draw();
    return line;
  }

  /** @param {DrawnLine} line */
  removeLine(line) {
    this.lines = this.lines.filter((other) => other !== line);
    this.gl.deleteBuffer(line.buffer);
    this.gl.deleteVertexArray(line.vao);
    this.draw();
  }

  clear() {
    for (const surface of [...this.surfaces]) this.removeSurface(surface);
    for (const line of [...this.lines]) this.removeLine(line);
  }

  /** Draws soon, once. */
  draw() {
    if (this.isWaiting) return;
    this.isWaiting = true;
    requestAnimationFrame(() => {
      this.isWaiting = false;
      const began = performance.now();
      this.drawNow();
      this.scriptMs = performance.now() - began;
      this.frames++;
    });
  }

  drawNow() {
    const { gl, canvas, camera } = this;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (width === 0 || height === 0) return;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const clip = camera.matrix(width / height);
    const [x, y, z] = camera.axes();
    const view = new Float32Array([x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]]);
    const { surface, point } = this.programs;
    gl.useProgram(surface.program);
    gl.uniformMatrix4fv(surface.at("clipFromWorld"), false, clip);
    gl.uniformMatrix3fv(surface.at("viewFromWorld"), false, view);
    const visible = this.surfaces.filter((s) => s.isVisible && s.opacity > 0);
    visible.sort((a, b) => b.opacity - a.opacity);
    for (const drawn of visible) {
      if (drawn.opacity < 1) {
        gl.enable(gl.BLEND);
        // First the depth alone, so that only the nearest surface shines through.
        gl.colorMask(false, false, false, false);
        this.drawFaces(drawn, false);
        gl.colorMask(true, true, true, true);
        gl.depthFunc(gl.LEQUAL);
      }
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.polygonOffset(this.isWireframe ? 1 : 0, this.isWireframe ? 1 : 0);
      this.drawFaces(drawn, false);
      gl.disable(gl.POLYGON_OFFSET_FILL);
      if (this.isWireframe) this.drawFaces(drawn, true);
      gl.disable(gl.BLEND);
      gl.depthFunc(gl.LESS);
    }
    gl.useProgram(point.program);
    gl.uniformMatrix4fv(point.at("clipFromWorld"), false, clip);
    for (const line of this.lines.filter((line) => line.isVisible)) {
      if (line.isOnTop) gl.disable(gl.DEPTH_TEST);
      else gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LEQUAL);
      const [r, g, b] = line.color;
      gl.uniform4f(point.at("color"), r / 255, g / 255, b / 255, 1);
      gl.uniform1i(point.at("round_"), line.mode === "points" ? 1 : 0);
      gl.uniform1f(point.at("size"), 26 * ratio);
      gl.bindVertexArray(line.vao);
      const mode = { loop: gl.LINE_LOOP, line: gl.LINE_STRIP, points: gl.POINTS }[line.mode];
      gl.drawArrays(mode, 0, line.count);
    }
    gl.depthFunc(gl.LESS);
    gl.bindVertexArray(null);
  }

  /** @param {Drawn} drawn @param {boolean} edges */
  drawFaces(drawn, edges) {
    const { gl } = this;
    const { surface } = this.programs;
    gl.bindVertexArray(drawn.vao);
    const [r, g, b] = drawn.color.map((c) => c / 255);
    if (!drawn.hasColors) gl.vertexAttrib3f(2, r, g, b);
    if (!drawn.overlay) gl.vertexAttrib4f(3, 0, 0, 0, edges ? 0.6 : 0);
    gl.uniform1f(surface.at("opacity"), drawn.opacity);
    gl.uniform1i(surface.at("flat_"), edges ? 1 : 0);
    if (!edges) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, drawn.buffers[3]);
      gl.drawElements(gl.TRIANGLES, drawn.indices.length, gl.UNSIGNED_INT, 0);
      return;
    }
    if (!drawn.edges) {
      drawn.edges = buffer(gl, gl.ELEMENT_ARRAY_BUFFER, edgesOf(drawn.indices));
      drawn.buffers.push(drawn.edges);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, drawn.edges);
    gl.drawElements(gl.LINES, drawn.indices.length * 2, gl.UNSIGNED_INT, 0);
  }

  /** Where a pointer is in the picture, -1 to 1. @param {{ clientX: number, clientY: number }} e */
  place(e) {
    const box = this.canvas.getBoundingClientRect();
    return [(2 * (e.clientX - box.left)) / box.width - 1, 1 - (2 * (e.clientY - box.top)) / box.height];
  }

  /** @param {{ clientX: number, clientY: number }} e */
  ray(e) {
    const [x, y] = this.place(e);
    return this.camera.ray(x, y, this.aspect());
  }

  listen() {
    const { canvas, camera } = this;
    /** @type {Map<number, PointerEvent>} */
    const pressed = new Map();
    let isTaken = false;
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      pressed.set(e.pointerId, e);
      isTaken = pressed.size === 1 && e.button === 0 && !e.shiftKey && !!this.onPress && this.onPress(e);
    });
    canvas.addEventListener("pointermove", (e) => {
      const before = pressed.get(e.pointerId);
      if (!before) return;
      if (isTaken) {
        this.onDrag?.(e);
        return;
      }
      const others = [...pressed.values()].filter((other) => other.pointerId !== e.pointerId);
      const height = canvas.clientHeight;
      const [dx, dy] = [e.clientX - before.clientX, e.clientY - before.clientY];
      if (others.length > 0) {
        const gap = (/** @type {PointerEvent} */ a) => Math.hypot(a.clientX - others[0].clientX, a.clientY - others[0].clientY);
        camera.zoom(gap(before) / Math.max(1, gap(e)));
        camera.pan(dx / height / 2, dy / height / 2);
      } else if (e.shiftKey || e.buttons & 6) {
        camera.pan(dx / height, dy / height);
      } else {
        camera.turn((dx / height) * 4, (dy / height) * 4);
      }
      pressed.set(e.pointerId, e);
      this.draw();
    });
    const release = (/** @type {PointerEvent} */ e) => {
      if (!pressed.delete(e.pointerId)) return;
      if (isTaken) this.onRelease?.(e);
      isTaken = false;
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener(
      "wheel",
      (e) => {
        e.preventDefault();
        camera.zoom(Math.exp(e.deltaY * 0.0012));
        this.draw();
      },
      { passive: false },
    );
    canvas.addEventListener("keydown", (e) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
      if (step && e.shiftKey) camera.pan(-0.05 * step[0], -0.05 * step[1]);
      else if (step) camera.turn(0.12 * step[0], 0.12 * step[1]);
      else if (e.key === "+" || e.key === "=") camera.zoom(0.9);
      else if (e.key === "-") camera.zoom(1.1);
      else return;
      e.preventDefault();
      this.draw();
    });
  }
}

/** @param {WebGL2RenderingContext} gl @param {string} vertex @param {string} fragment */
function program(gl, vertex, fragment) {
  const made = /** @type {WebGLProgram} */ (gl.createProgram());
  for (const [kind, source] of /** @type {[number, string][]} */ ([
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ])) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(`shader: ${gl.getProgramInfoLog(made)}`);
  /** @type {Map<string, WebGLUniformLocation | null>} */
  const known = new Map();
  const at = (/** @type {string} */ name) => {
    if (!known.has(name)) known.set(name, gl.getUniformLocation(made, name));
    return known.get(name) ?? null;
  };
  return { program: made, at };
}

/** @param {WebGL2RenderingContext} gl @param {number} target @param {ArrayBufferView} data */
function buffer(gl, target, data) {
  const made = /** @type {WebGLBuffer} */ (gl.createBuffer());
  gl.bindBuffer(target, made);
  gl.bufferData(target, /** @type {BufferSource} */ (data), gl.STATIC_DRAW);
  return made;
}

/** @param {Uint32Array} indices */
function edgesOf(indices) {
  const edges = new Uint32Array(indices.length * 2);
  for (let k = 0, e = 0; k < indices.length; k += 3) {
    for (let corner = 0; corner < 3; corner++) {
      edges[e++] = indices[k + corner];
      edges[e++] = indices[k + ((corner + 1) % 3)];
    }
  }
  return edges;
}
