// Surfaces as apps/report/packed_surface.h packs them.

const placesPerAxis = 65535;
const noNumber = 255;
const codes = 254;

/** The bytes behind base64 text that holds a zlib stream. */
async function inflate(text) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** 0, 1, 2, 3, ... as 0, -1, 1, -2, ... */
const unfolded = (n) => (n >>> 1) ^ -(n & 1);

function readAxis(bytes, start, axis, output, positions) {
  const count = output.vertices;
  const scale = (output.upper[axis] - output.lower[axis]) / placesPerAxis;
  let place = 0;
  for (let v = 0; v < count; ++v) {
    const step = unfolded((bytes[start + v] << 8) | bytes[start + count + v]);
    place = (place + step) & 0xffff;
    positions[3 * v + axis] = output.lower[axis] + scale * place;
  }
}

/** Gives the numbers one after the other. */
class Varints {
  constructor(bytes, start) {
    this.bytes = bytes;
    this.next = start;
  }

  read() {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = this.bytes[this.next++];
      value |= (byte & 0x7f) << shift;
      if (byte < 0x80) return value >>> 0;
    }
  }
}

function readTriangles(varints, count) {
  const triangles = new Uint32Array(3 * count);
  let first = 0;
  for (let n = 0; n < triangles.length; n += 3) {
    first += unfolded(varints.read());
    triangles[n] = first;
    triangles[n + 1] = first + unfolded(varints.read());
    triangles[n + 2] = triangles[n + 1] + unfolded(varints.read());
  }
  return triangles;
}

function readField(bytes, start, count, { low, high }) {
  const values = new Float32Array(count);
  for (let f = 0; f < count; ++f) {
    const code = bytes[start + f];
    values[f] = code === noNumber ? NaN : low + (code * (high - low)) / codes;
  }
  return values;
}

/** Where the layers of an output are: four bytes for each node, one for each layer but the highest, 128 at its border. */
export async function unpackVolume(text, { nodes, materials }) {
  const planes = await inflate(text);
  const count = nodes[0] * nodes[1] * nodes[2];
  const bytes = new Uint8Array(4 * count);
  for (let layer = 0; layer < materials.length - 1; ++layer)
    for (let n = 0; n < count; ++n) bytes[4 * n + layer] = planes[layer * count + n];
  return bytes;
}

/**
 * The surface of an output: positions (x, y, z of each vertex), triangles (three vertices each), and fields by
 * name (a value per facet).
 */
export async function unpack(text, output) {
  const bytes = await inflate(text);
  const positions = new Float32Array(3 * output.vertices);
  for (let axis = 0; axis < 3; ++axis) readAxis(bytes, 2 * output.vertices * axis, axis, output, positions);
  const varints = new Varints(bytes, 6 * output.vertices);
  const triangles = readTriangles(varints, output.facets);
  const fields = new Map();
  output.fields.forEach((field, n) => {
    const start = varints.next + n * output.facets;
    fields.set(field.name, readField(bytes, start, output.facets, field));
  });
  return { positions, triangles, fields };
}
