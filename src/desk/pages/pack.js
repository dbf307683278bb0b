// Reads the surfaces that `pack.rs` writes.

/**
 * @typedef {{ vertices: number, faces: number, indices: number[], positions: number[], min: number[], size: number[],
 *   colors: [string, number[]][] }} PackedSurface
 * @typedef {{ positions: Float32Array, indices: Uint32Array, colors: Map<string, Uint8Array> }} Surface
 */

/**
 * The stream from its base64.
 * @param {string} text
 * @returns {Promise<Uint8Array>}
 */
export async function unpacked(text) {
  const packed = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  return inflated(packed);
}

/**
 * @param {Uint8Array} packed
 * @returns {Promise<Uint8Array>}
 */
export async function inflated(packed) {
  const stream = new Blob([/** @type {BlobPart} */ (packed)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * One surface of the stream: positions in metres, colours as 3 bytes per vertex.
 * @param {PackedSurface} packed
 * @param {Uint8Array} stream
 * @returns {Surface}
 */
export function surfaceOf(packed, stream) {
  const count = packed.vertices;
  const indices = new Uint32Array(3 * packed.faces);
  let at = packed.indices[0];
  let next = 0;
  for (let k = 0; k < indices.length; k++) {
    let back = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = stream[at++];
      back |= (byte & 127) << shift;
      if (byte < 128) break;
    }
    indices[k] = next - back;
    if (back === 0) next++;
  }
  const positions = new Float32Array(3 * count);
  for (let axis = 0; axis < 3; axis++) {
    const low = packed.positions[0] + 2 * axis * count;
    const step = packed.size[axis] / 65535;
    let value = 0;
    for (let v = 0; v < count; v++) {
      const code = stream[low + v] | (stream[low + count + v] << 8);
      value = (value + ((code >> 1) ^ -(code & 1))) & 0xffff;
      positions[3 * v + axis] = packed.min[axis] + value * step;
    }
  }
  const colors = new Map();
  for (const [name, span] of packed.colors) colors.set(name, colorsOf(stream, span[0], count));
  return { positions, indices, colors };
}

/**
 * @param {Uint8Array} stream
 * @param {number} begin
 * @param {number} count
 */
function colorsOf(stream, begin, count) {
  const colors = new Uint8Array(3 * count);
  for (let channel = 0; channel < 3; channel++) {
    let value = 0;
    for (let v = 0; v < count; v++) {
      value = (value + stream[begin + channel * count + v]) & 255;
      colors[3 * v + channel] = value;
    }
  }
  return colors;
}

/** Bits as the server packs them. @param {string} text @param {number} count */
export function bitsOf(text, count) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return Uint8Array.from({ length: count }, (_, k) => (bytes[k >> 3] >> (k & 7)) & 1);
}
