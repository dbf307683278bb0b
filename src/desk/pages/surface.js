// Rays against a surface, and places on it.
import { add, cross, dot, length, normalized, scale, sub } from "./math.js";

/** @param {Float32Array} positions @param {number} v */
export const pointOf = (positions, v) => [positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]];

/**
 * Where a ray first meets a surface, and the normal there; `null` if it misses.
 * @param {{ positions: Float32Array, indices: Uint32Array }} surface
 * @param {{ origin: number[], direction: number[] }} ray
 */
export function hit(surface, { origin, direction }) {
  const { positions: p, indices } = surface;
  const [ox, oy, oz] = origin;
  const [dx, dy, dz] = direction;
  let nearest = Infinity;
  let face = -1;
  // Möller & Trumbore 1997, written out: this runs over all faces at each move of the pointer.
  for (let k = 0; k < indices.length; k += 3) {
    const [a, b, c] = [3 * indices[k], 3 * indices[k + 1], 3 * indices[k + 2]];
    const ux = p[b] - p[a];
    const uy = p[b + 1] - p[a + 1];
    const uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a];
    const vy = p[c + 1] - p[a + 1];
    const vz = p[c + 2] - p[a + 2];
    const qx = dy * vz - dz * vy;
    const qy = dz * vx - dx * vz;
    const qz = dx * vy - dy * vx;
    const det = ux * qx + uy * qy + uz * qz;
    if (Math.abs(det) < 1e-14) continue;
    const tx = ox - p[a];
    const ty = oy - p[a + 1];
    const tz = oz - p[a + 2];
    const s = (tx * qx + ty * qy + tz * qz) / det;
    if (s < 0 || s > 1) continue;
    const rx = ty * uz - tz * uy;
    const ry = tz * ux - tx * uz;
    const rz = tx * uy - ty * ux;
    const t = (dx * rx + dy * ry + dz * rz) / det;
    if (t < 0 || s + t > 1) continue;
    const far = (vx * rx + vy * ry + vz * rz) / det;
    if (far > 1e-6 && far < nearest) [nearest, face] = [far, k];
  }
  if (face < 0) return null;
  const [a, b, c] = [0, 1, 2].map((corner) => pointOf(p, indices[face + corner]));
  return { point: add(origin, scale(direction, nearest)), normal: normalized(cross(sub(b, a), sub(c, a))) };
}

/**
 * The vertex nearest to a point, and how far it is.
 * @param {Float32Array} positions
 * @param {number[]} at
 */
export function nearestVertex(positions, at) {
  let [least, vertex] = [Infinity, -1];
  for (let k = 0; k < positions.length; k += 3) {
    const [x, y, z] = [positions[k] - at[0], positions[k + 1] - at[1], positions[k + 2] - at[2]];
    const d = x * x + y * y + z * z;
    if (d < least) [least, vertex] = [d, k / 3];
  }
  return { vertex, distance: Math.sqrt(least) };
}

/**
 * The vertices within a radius of a point.
 * @param {Float32Array} positions
 * @param {number[]} at
 * @param {number} radius
 */
export function verticesNear(positions, at, radius) {
  const near = [];
  for (let k = 0; k < positions.length; k += 3) {
    const [x, y, z] = [positions[k] - at[0], positions[k + 1] - at[1], positions[k + 2] - at[2]];
    if (x * x + y * y + z * z < radius * radius) near.push(k / 3);
  }
  return near;
}

/**
 * A circle around a point.
 * @param {number[]} at
 * @param {number[]} normal
 * @param {number} radius
 */
export function circle(at, normal, radius) {
  const across = normalized(cross(normal, Math.abs(normal[1]) < 0.9 ? [0, 1, 0] : [1, 0, 0]));
  const other = cross(normal, across);
  const points = new Float32Array(3 * 48);
  // Slightly above the surface, so that it does not hide the circle.
  const middle = add(at, scale(normal, 0.002));
  for (let k = 0; k < 48; k++) {
    const turn = (2 * Math.PI * k) / 48;
    points.set(add(middle, add(scale(across, radius * Math.cos(turn)), scale(other, radius * Math.sin(turn)))), 3 * k);
  }
  return points;
}

/**
 * A point mirrored at the upright plane through `middle` in the direction `facing`.
 * @param {number[]} at
 * @param {number[]} middle
 * @param {number[]} facing
 */
export function mirrored(at, middle, facing) {
  const across = normalized(cross([0, 1, 0], facing));
  return sub(at, scale(across, 2 * dot(sub(at, middle), across)));
}

/**
 * The points of a path that are at least `step` apart; the last one stays.
 * @param {number[][]} path
 * @param {number} step
 */
export function thinned(path, step) {
  const kept = path.slice(0, 1);
  for (const at of path) if (length(sub(at, kept[kept.length - 1])) >= step) kept.push(at);
  const last = path[path.length - 1];
  if (last && length(sub(last, kept[kept.length - 1])) > 1e-6) kept.push(last);
  return kept;
}
