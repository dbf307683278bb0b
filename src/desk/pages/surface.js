// Rays against a surface, and places on it.
import { add, cross, dot, length, normalized, scale, sub } from "./math.js";

/** @param {Float32Array} positions @param {number} v */
export const pointOf = (positions, v) => [positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]];

/** Faces or vertices per box. */
const RUN = 64;

/**
 * A surface with the boxes of its runs of faces and of vertices. The server sends what is near one after another, so the boxes are small.
 * @typedef {{ positions: Float32Array, indices: Uint32Array, faceBoxes: Float64Array, vertexBoxes: Float64Array }} BoxedSurface
 * @param {{ positions: Float32Array, indices: Uint32Array }} surface
 * @returns {BoxedSurface}
 */
export function boxed({ positions, indices }) {
  const faceBoxes = boxesOf(positions, indices.length, 3 * RUN, (k) => indices[k]);
  return { positions, indices, faceBoxes, vertexBoxes: boxesOf(positions, positions.length / 3, RUN, (v) => v) };
}

/**
 * The boxes of runs of vertices: three times the lower and the upper limit each.
 * @param {Float32Array} positions
 * @param {number} count
 * @param {number} run
 * @param {(k: number) => number} vertexAt
 */
function boxesOf(positions, count, run, vertexAt) {
  const boxes = new Float64Array(6 * Math.ceil(count / run));
  for (let at = 0; at < boxes.length; at += 6) {
    const first = (at / 6) * run;
    boxes.set([Infinity, -Infinity, Infinity, -Infinity, Infinity, -Infinity], at);
    for (let k = first; k < Math.min(count, first + run); k++) {
      const v = 3 * vertexAt(k);
      for (let axis = 0; axis < 3; axis++) {
        boxes[at + 2 * axis] = Math.min(boxes[at + 2 * axis], positions[v + axis]);
        boxes[at + 2 * axis + 1] = Math.max(boxes[at + 2 * axis + 1], positions[v + axis]);
      }
    }
  }
  return boxes;
}

/**
 * Whether a ray misses a box, or meets it only beyond a distance.
 * @param {Float64Array} boxes @param {number} at @param {number[]} origin @param {number[]} direction @param {number} most
 */
function misses(boxes, at, origin, direction, most) {
  let [from, to] = [0, most];
  for (let axis = 0; axis < 3; axis++) {
    const [low, high, slope] = [boxes[at + 2 * axis] - origin[axis], boxes[at + 2 * axis + 1] - origin[axis], direction[axis]];
    if (slope === 0) {
      if (low > 0 || high < 0) return true;
      continue;
    }
    from = Math.max(from, Math.min(low / slope, high / slope));
    to = Math.min(to, Math.max(low / slope, high / slope));
  }
  // A face that lies in a side of its box is not missed by rounding.
  return from > to + 1e-9;
}

/** The squared distance of a point from a box. @param {Float64Array} boxes @param {number} at @param {number[]} point */
function squaredDistance(boxes, at, point) {
  let sum = 0;
  for (let axis = 0; axis < 3; axis++) {
    const beside = Math.max(boxes[at + 2 * axis] - point[axis], point[axis] - boxes[at + 2 * axis + 1], 0);
    sum += beside * beside;
  }
  return sum;
}

/**
 * Where a ray first meets a surface, and the normal there; `null` if it misses.
 * @param {BoxedSurface} surface
 * @param {{ origin: number[], direction: number[] }} ray
 */
export function hit(surface, { origin, direction }) {
  const { positions: p, indices, faceBoxes } = surface;
  let nearest = Infinity;
  let face = -1;
  for (let at = 0; at < faceBoxes.length; at += 6) {
    if (misses(faceBoxes, at, origin, direction, nearest)) continue;
    const first = (at / 2) * RUN;
    for (let k = first; k < Math.min(indices.length, first + 3 * RUN); k += 3) {
      const far = distanceTo(p, indices, k, origin, direction);
      if (far > 1e-6 && far < nearest) [nearest, face] = [far, k];
    }
  }
  if (face < 0) return null;
  const [a, b, c] = [0, 1, 2].map((corner) => pointOf(p, indices[face + corner]));
  return { point: add(origin, scale(direction, nearest)), normal: normalized(cross(sub(b, a), sub(c, a))) };
}

/**
 * How far along a ray the face at `k` is, or -1: Möller & Trumbore 1997, written out, because it runs at each move of the pointer.
 * @param {Float32Array} p @param {Uint32Array} indices @param {number} k @param {number[]} origin @param {number[]} direction
 */
function distanceTo(p, indices, k, [ox, oy, oz], [dx, dy, dz]) {
  const a = 3 * indices[k];
  const b = 3 * indices[k + 1];
  const c = 3 * indices[k + 2];
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
  if (Math.abs(det) < 1e-14) return -1;
  const tx = ox - p[a];
  const ty = oy - p[a + 1];
  const tz = oz - p[a + 2];
  const s = (tx * qx + ty * qy + tz * qz) / det;
  if (s < 0 || s > 1) return -1;
  const rx = ty * uz - tz * uy;
  const ry = tz * ux - tx * uz;
  const rz = tx * uy - ty * ux;
  const t = (dx * rx + dy * ry + dz * rz) / det;
  return t < 0 || s + t > 1 ? -1 : (vx * rx + vy * ry + vz * rz) / det;
}

/**
 * The vertex nearest to a point, and how far it is.
 * @param {BoxedSurface} surface
 * @param {number[]} at
 */
export function nearestVertex(surface, at) {
  let [least, vertex] = [Infinity, -1];
  forVertices(surface, at, () => least, (v, d) => ([least, vertex] = [d, v]));
  return { vertex, distance: Math.sqrt(least) };
}

/**
 * The vertices within a radius of a point.
 * @param {BoxedSurface} surface
 * @param {number[]} at
 * @param {number} radius
 */
export function verticesNear(surface, at, radius) {
  /** @type {number[]} */
  const near = [];
  forVertices(surface, at, () => radius * radius, (v) => near.push(v));
  return near;
}

/**
 * Calls `each` with the vertices whose squared distance from a point is below a limit, which may sink meanwhile.
 * @param {BoxedSurface} surface
 * @param {number[]} at
 * @param {() => number} limit
 * @param {(vertex: number, squared: number) => void} each
 */
function forVertices({ positions, vertexBoxes }, at, limit, each) {
  const count = positions.length / 3;
  for (let box = 0; box < vertexBoxes.length; box += 6) {
    if (squaredDistance(vertexBoxes, box, at) >= limit()) continue;
    const first = (box / 6) * RUN;
    for (let v = first; v < Math.min(count, first + RUN); v++) {
      const x = positions[3 * v] - at[0];
      const y = positions[3 * v + 1] - at[1];
      const z = positions[3 * v + 2] - at[2];
      const squared = x * x + y * y + z * z;
      if (squared < limit()) each(v, squared);
    }
  }
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

/** @param {Uint8Array} overlay @param {number} v @param {number[]} color @param {number} share how much it covers, 0 to 255 */
export function setColor(overlay, v, [red, green, blue], share) {
  [overlay[4 * v], overlay[4 * v + 1], overlay[4 * v + 2], overlay[4 * v + 3]] = [red, green, blue, share];
}
