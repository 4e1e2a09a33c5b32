// What is drawn of a mesh: normals, edges, its open rim. Positions are x, y, z of each vertex, triangles three
// vertices each.

/** Twice the area of each facet along its normal. */
function areaVectors(positions, triangles) {
  const vectors = new Float32Array(triangles.length);
  for (let n = 0; n < triangles.length; n += 3) {
    const [a, b, c] = [3 * triangles[n], 3 * triangles[n + 1], 3 * triangles[n + 2]];
    const ux = positions[b] - positions[a];
    const uy = positions[b + 1] - positions[a + 1];
    const uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a];
    const vy = positions[c + 1] - positions[a + 1];
    const vz = positions[c + 2] - positions[a + 2];
    vectors[n] = uy * vz - uz * vy;
    vectors[n + 1] = uz * vx - ux * vz;
    vectors[n + 2] = ux * vy - uy * vx;
  }
  return vectors;
}

/** The corners at each vertex, one vertex after the other, and where those of each begin. */
function cornersAtVertices(triangles, vertexCount) {
  const begins = new Uint32Array(vertexCount + 1);
  for (const v of triangles) ++begins[v + 1];
  for (let v = 0; v < vertexCount; ++v) begins[v + 1] += begins[v];
  const next = begins.slice();
  const corners = new Uint32Array(triangles.length);
  triangles.forEach((v, corner) => {
    corners[next[v]++] = corner;
  });
  return { begins, corners };
}

/**
 * A unit normal for each corner of each facet: that of the surface around the vertex, of facets that bend by less
 * than the angle of a crease.
 */
export function cornerNormals(positions, triangles, crease = Math.PI / 5) {
  const areas = areaVectors(positions, triangles);
  const lengths = new Float32Array(triangles.length / 3);
  lengths.forEach((_, f) => {
    lengths[f] = Math.hypot(areas[3 * f], areas[3 * f + 1], areas[3 * f + 2]);
  });
  const { begins, corners } = cornersAtVertices(triangles, positions.length / 3);
  const least = Math.cos(crease);
  const normals = new Float32Array(3 * triangles.length);
  for (let corner = 0; corner < triangles.length; ++corner) {
    const f = Math.floor(corner / 3);
    let [x, y, z] = [0, 0, 0];
    for (let n = begins[triangles[corner]]; n < begins[triangles[corner] + 1]; ++n) {
      const g = Math.floor(corners[n] / 3);
      const dot =
        areas[3 * f] * areas[3 * g] + areas[3 * f + 1] * areas[3 * g + 1] + areas[3 * f + 2] * areas[3 * g + 2];
      if (g !== f && dot < least * lengths[f] * lengths[g]) continue;
      x += areas[3 * g];
      y += areas[3 * g + 1];
      z += areas[3 * g + 2];
    }
    const length = Math.hypot(x, y, z) || 1;
    normals.set([x / length, y / length, z / length], 3 * corner);
  }
  return normals;
}

/** Every edge once, as pairs of vertices; and the edges of the open rim, as the facet there goes round. */
export function edges(triangles, vertexCount) {
  const seen = new Map(); // of an edge from a to b
  const key = (a, b) => a * vertexCount + b;
  for (let n = 0; n < triangles.length; ++n) {
    const a = triangles[n];
    const b = triangles[n % 3 === 2 ? n - 2 : n + 1];
    seen.set(key(a, b), [a, b]);
  }
  const all = [];
  const rim = [];
  for (const [a, b] of seen.values()) {
    const hasOther = seen.has(key(b, a));
    if (!hasOther) rim.push(a, b);
    if (!hasOther || a < b) all.push(a, b);
  }
  return { all, rim };
}
