// What the viewer makes of numbers, without a browser.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { folder, scarp } from './browser.mjs';
import { facetColours, scaleOf } from '../../apps/viewer/src/colours.js';
import { cornerNormals, edges } from '../../apps/viewer/src/mesh.js';
import { unpack } from '../../apps/viewer/src/unpack.js';

/** The arrays of a .vtp file as scarp writes it: each its size, and then its values. */
function readVtp(file) {
  const bytes = readFileSync(file);
  const begin = bytes.indexOf('<AppendedData encoding="raw">\n_') + '<AppendedData encoding="raw">\n_'.length;
  const arrays = new Map();
  const types = { Float32: Float32Array, Int32: Int32Array, UInt16: Uint16Array };
  const pattern = /<DataArray type="(\w+)" Name="([^"]+)" NumberOfComponents="\d" format="appended" offset="(\d+)"/g;
  for (const [, type, name, offset] of bytes.subarray(0, begin).toString('latin1').matchAll(pattern)) {
    const at = begin + Number(offset);
    const size = Number(bytes.readBigUInt64LE(at));
    arrays.set(name, new types[type](bytes.buffer.slice(bytes.byteOffset + at + 8, bytes.byteOffset + at + 8 + size)));
  }
  return arrays;
}

test('surfaces come back from a page as they are in the files', async () => {
  const where = join(folder, 'run');
  scarp(
    ...['run', join(process.env.SOURCE, 'configs', 'trench_deposition.toml'), '-o', where, '--quiet'],
    ...['domain.spacing="0.4 um"', 'domain.extent=["10 um", "2 um"]', 'flux.target_error=0.1'].flatMap((s) => ['--set', s]),
  );
  const page = readFileSync(join(where, 'report.html'), 'utf8');
  const description = JSON.parse(page.match(/<script type="application\/json">(.*?)<\/script>/)[1]);
  const { outputs } = description.panes[0];
  for (const [n, output] of outputs.entries()) {
    const text = page.match(new RegExp(`id="${output.data}">([^<]*)<`))[1];
    const found = await unpack(text, output);
    const file = readVtp(join(where, `surface_${String(n).padStart(4, '0')}.vtp`));
    assert.deepEqual([...found.triangles], [...file.get('connectivity')]);
    const error = Math.max(...found.positions.map((x, k) => Math.abs(x - file.get('points')[k])));
    assert.ok(error <= 1.01 * description.place_error_nm, `${error} nm`);
    assert.deepEqual([...found.fields.get('material')], [...file.get('material')]);
    const { low, high } = output.fields.find(({ name }) => name === 'flux');
    found.fields.get('flux').forEach((flux, f) => {
      const wanted = Math.min(Math.max(file.get('flux')[f], low), high);
      assert.ok(Math.abs(flux - wanted) <= 0.51 * ((high - low) / 254));
    });
  }
});

/** A square of two triangles, and one more on its edge that stands up. */
const square = { positions: [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 1, 0, 1], triangles: [0, 1, 2, 0, 2, 3, 2, 1, 4] };

test('every edge is drawn once, and the rim is found', () => {
  const { all, rim } = edges(Uint32Array.from(square.triangles), 5);
  assert.equal(all.length, 2 * 7);
  assert.deepEqual(rim, [0, 1, 2, 3, 3, 0, 1, 4, 4, 2]);
});

test('normals are smooth on a plane and sharp at an edge', () => {
  const normals = cornerNormals(Float32Array.from(square.positions), Uint32Array.from(square.triangles));
  for (let corner = 0; corner < 6; ++corner) assert.deepEqual([...normals.subarray(3 * corner, 3 * corner + 3)], [0, 0, 1]);
  for (let corner = 6; corner < 9; ++corner) assert.equal(normals[3 * corner], -1);
});

test('zero is in the middle of what has both signs', () => {
  const scale = scaleOf({ low: -2, high: 10 });
  assert.equal(scale.number(0), -10);
  assert.equal(scale.number(0.5), 0);
  assert.deepEqual(scale.colour(0), [225, 225, 222]);
  assert.deepEqual(scale.colour(99), scale.colour(10));
});

test('a root scale shows what is small', () => {
  const scale = scaleOf({ low: -4, high: 100, has_root_scale: true });
  assert.equal(scale.number(0.75), 25);
  assert.equal(scale.number(0.25), -25);
});

test('what has no number is grey', () => {
  const { colour } = scaleOf({ low: 0, high: 1 });
  assert.deepEqual([...facetColours(Float32Array.of(NaN), 1, colour, 1)], [150, 150, 150]);
  assert.deepEqual([...facetColours(undefined, 2, colour, 1)], [150, 150, 150, 150, 150, 150]);
});
