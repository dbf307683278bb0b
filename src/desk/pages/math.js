// Vectors as arrays of three numbers, and the matrices of a camera.

/** @typedef {number[]} Vec */

/** @param {Vec} a @param {Vec} b @returns {Vec} */
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @param {Vec} a @param {Vec} b @returns {Vec} */
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @param {Vec} a @param {number} s @returns {Vec} */
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
/** @param {Vec} a @param {Vec} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {Vec} a @param {Vec} b @returns {Vec} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Vec} a */
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
/** @param {Vec} a @returns {Vec} */
export const normalized = (a) => scale(a, 1 / (length(a) || 1));

/** Angle of view from the lower to the upper edge, in radians. */
const FIELD = 0.5;

/** A camera that turns around a target. */
export class Camera {
  constructor() {
    /** @type {Vec} */
    this.target = [0, 0.85, 0];
    this.yaw = 0;
    this.pitch = 0.05;
    this.distance = 4;
  }

  /** The axes of the view in the world: right, up, toward the viewer. @returns {Vec[]} */
  axes() {
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    const back = [sy * cp, sp, cy * cp];
    const right = [cy, 0, -sy];
    return [right, cross(back, right), back];
  }

  /** @returns {Vec} */
  eye() {
    return add(this.target, scale(this.axes()[2], this.distance));
  }

  /** @param {number} dx @param {number} dy in radians */
  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.max(-1.55, Math.min(1.55, this.pitch + dy));
  }

  /** @param {number} dx @param {number} dy in heights of the picture */
  pan(dx, dy) {
    const [right, up] = this.axes();
    const size = 2 * this.distance * Math.tan(FIELD / 2);
    this.target = add(this.target, add(scale(right, -dx * size), scale(up, dy * size)));
  }

  /** @param {number} factor */
  zoom(factor) {
    this.distance = Math.max(0.08, Math.min(40, this.distance * factor));
  }

  /** Shows a box as a whole. @param {Vec} min @param {Vec} max @param {number} aspect */
  frame(min, max, aspect) {
    this.target = scale(add(min, max), 0.5);
    const size = sub(max, min);
    const needed = Math.max(size[1], Math.hypot(size[0], size[2]) / Math.max(aspect, 0.2));
    this.distance = (0.56 * needed) / Math.tan(FIELD / 2);
  }

  /** Clip space from the world, column by column. @param {number} aspect */
  matrix(aspect) {
    const [x, y, z] = this.axes();
    const eye = this.eye();
    const f = 1 / Math.tan(FIELD / 2);
    const [near, far] = [this.distance / 50, this.distance + 8];
    const [a, b] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
    const [sx, sy] = [f / aspect, f];
    const [tx, ty, tz] = [-dot(x, eye), -dot(y, eye), -dot(z, eye)];
    // prettier-ignore
    return new Float32Array([
      sx * x[0], sy * y[0], a * z[0], -z[0],
      sx * x[1], sy * y[1], a * z[1], -z[1],
      sx * x[2], sy * y[2], a * z[2], -z[2],
      sx * tx, sy * ty, a * tz + b, -tz,
    ]);
  }

  /** The ray through a place of the picture, -1 to 1. @param {number} x @param {number} y @param {number} aspect */
  ray(x, y, aspect) {
    const [right, up, back] = this.axes();
    const t = Math.tan(FIELD / 2);
    const through = sub(add(scale(right, x * t * aspect), scale(up, y * t)), back);
    return { origin: this.eye(), direction: normalized(through) };
  }
}

/**
 * The mean normal at each vertex, weighted by area, as signed bytes with one of padding.
 * @param {Float32Array} positions
 * @param {Uint32Array} indices
 */
export function normalsOf(positions, indices) {
  const sums = new Float32Array(positions.length);
  for (let k = 0; k < indices.length; k += 3) {
    const [a, b, c] = [3 * indices[k], 3 * indices[k + 1], 3 * indices[k + 2]];
    const ux = positions[b] - positions[a];
    const uy = positions[b + 1] - positions[a + 1];
    const uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a];
    const vy = positions[c + 1] - positions[a + 1];
    const vz = positions[c + 2] - positions[a + 2];
    const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const v of [a, b, c]) {
      sums[v] += nx;
      sums[v + 1] += ny;
      sums[v + 2] += nz;
    }
  }
  const normals = new Int8Array((positions.length / 3) * 4);
  for (let v = 0, n = 0; v < sums.length; v += 3, n += 4) {
    const size = Math.hypot(sums[v], sums[v + 1], sums[v + 2]) || 1;
    for (let axis = 0; axis < 3; axis++) normals[n + axis] = Math.round((127 * sums[v + axis]) / size);
  }
  return normals;
}

/** The box around points. @param {Float32Array} positions @returns {{ min: Vec, max: Vec }} */
export function boundsOf(positions) {
  const min = [Infinity, Infinity, Infinity];
  const max = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < positions.length; k++) {
    const axis = k % 3;
    if (positions[k] < min[axis]) min[axis] = positions[k];
    if (positions[k] > max[axis]) max[axis] = positions[k];
  }
  return { min, max };
}
