// The search by boxes finds what the search through everything finds: node surface.mjs PAGES
import assert from "node:assert/strict";
import path from "node:path";
import { pathToFileURL } from "node:url";

const { boxed, hit, nearestVertex, verticesNear } = await import(pathToFileURL(path.resolve(process.argv[2], "surface.js")).href);

const size = 200;
const positions = new Float32Array(3 * size * size);
for (let v = 0; v < size * size; v++) {
  const [polar, turn] = [(Math.PI * Math.floor(v / size)) / size, (2 * Math.PI * (v % size)) / size];
  positions.set([Math.sin(polar) * Math.cos(turn), Math.cos(polar), Math.sin(polar) * Math.sin(turn)], 3 * v);
}
const faces = [];
for (let v = 0; v + size + 1 < size * size; v++) if ((v + 1) % size) faces.push(v, v + 1, v + size, v + 1, v + size + 1, v + size);
const surface = boxed({ positions, indices: new Uint32Array(faces) });
const everywhere = (boxes) => boxes.map((_, k) => (k % 2 ? Infinity : -Infinity));
const all = { ...surface, faceBoxes: everywhere(surface.faceBoxes), vertexBoxes: everywhere(surface.vertexBoxes) };

let seed = 1;
const random = () => ((seed = (seed * 16807) % 2147483647) / 2147483647) * 2 - 1;
let hits = 0;
for (let k = 0; k < 300; k++) {
  const [origin, at] = [[3 * random(), 3 * random(), 3 * random()], [random(), random(), random()]];
  const length = Math.hypot(...at.map((x, axis) => x - origin[axis]));
  // Every tenth one is parallel to two axes, where slopes are 0.
  const direction = k % 10 ? at.map((x, axis) => (x - origin[axis]) / length) : [0, 0, -Math.sign(origin[2])];
  const found = hit(surface, { origin, direction });
  if (found) hits++;
  assert.deepEqual(found, hit(all, { origin, direction }));
  assert.deepEqual(verticesNear(surface, at, 0.1), verticesNear(all, at, 0.1));
  assert.deepEqual(nearestVertex(surface, at), nearestVertex(all, at));
}
assert.ok(hits > 100 && hits < 300, `${hits} of 300 rays hit`);
console.log("boxes lose nothing");
