// The pages of a Bosch run and of a comparison, as a reader sees and uses them.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import {
  folder,
  isDrawn,
  isGrey,
  isPink,
  isReddish,
  isYellow,
  launch,
  maskDifference,
  OpenPage,
  scarp,
} from './browser.mjs';

const configs = join(process.env.SOURCE, 'configs');
const set = (...pairs) => pairs.flatMap((pair) => ['--set', pair]);
const run = join(folder, 'bosch');
const comparison = join(folder, 'comparison');

let browser;

before(async () => {
  scarp(
    ...['run', join(configs, 'bosch_sf6_c4f8.toml'), '-o', run, '--quiet'],
    ...set(
      'domain.mode="3d"',
      'domain.boundary=["reflective", "reflective"]',
      'domain.extent=["0.8 um", "0.2 um"]',
      'domain.spacing="40 nm"',
      'flux.target_error=0.2',
      'step[0].repeat=2',
    ),
  );
  scarp(
    ...['compare', join(configs, 'trench_deposition.toml'), '-o', comparison, '--quiet', '--seeds', '1', '--length-cells', '1'],
    ...set(
      'domain.spacing="0.4 um"',
      'domain.extent=["10 um", "4 um"]',
      'flux.target_error=0.1',
      'output.every="48 s"',
    ),
  );
  browser = await launch();
});

after(() => browser?.close());

const openRun = (options) => OpenPage.open(browser, join(run, 'report.html'), options);
const openComparison = () => OpenPage.open(browser, join(comparison, 'report.html'));

test('the surface is drawn, and the picture for print is not', async () => {
  const page = await openRun();
  const picture = await page.picture();
  const drawn = picture.share(isDrawn);
  assert.ok(drawn > 0.05 && drawn < 0.8, `${drawn} is drawn`);
  assert.equal(await page.page.locator('.still img').isVisible(), false);
  await page.close();
});

test('the slider goes through the outputs', async () => {
  const page = await openRun();
  const last = await page.picture();
  const output = page.viewer.locator('output').last();
  assert.match(await output.textContent(), /^t = 63 s, after strip$/);
  await page.slide('output', 0);
  const first = await page.picture();
  assert.match(await output.textContent(), /^t = 0 s, start$/);
  assert.ok(first.difference(last) > 0.01);
  await page.slide('output', 5);
  assert.equal((await page.picture()).difference(last), 0);
  await page.close();
});

test('colours are those of the field', async () => {
  const page = await openRun();
  // Ions reach mask and floor in full.
  await page.slide('output', 1);
  const material = await page.picture();
  assert.equal(material.share(isYellow), 0);
  const names = await page.control('colour').locator('option').allTextContents();
  assert.deepEqual(names.slice(0, 2), ['material', 'flux']);
  await page.control('colour').selectOption('flux_ion');
  const flux = await page.picture();
  assert.ok(flux.share(isYellow) > 0.01, `${flux.share(isYellow)} is yellow`);
  assert.match(await page.viewer.locator('.legend').first().textContent(), /flux ion/);
  // A polymer grows on all of it: above zero, and so on the red side of a scale that has both.
  await page.control('colour').selectOption('speed_nm_s');
  await page.slide('output', 0);
  assert.ok((await page.picture()).share(isReddish) > 0.01);
  await page.close();
});

test('a step without a field is grey', async () => {
  const page = await openRun();
  // The mask loses its colour, the sides of the block keep theirs.
  const before = (await page.picture()).share(isGrey);
  await page.control('colour').selectOption('flux');
  const strip = await page.picture(); // isotropic: no particles
  assert.ok(strip.share(isGrey) > 1.2 * before, `${strip.share(isGrey)} after ${before} is grey`);
  assert.match(await page.viewer.locator('.legends').textContent(), /without flux/);
  await page.close();
});

test('a plane cuts the wafer, and the cut is solid', async () => {
  const page = await openRun();
  const whole = (await page.picture()).share(isDrawn);
  const shares = [];
  await page.control('cut').selectOption('x');
  for (const place of [0.1, 0.5, 0.9]) {
    await page.slide('place', place);
    shares.push((await page.picture()).share(isDrawn));
  }
  assert.ok(whole > shares[0] && shares[0] > shares[1] && shares[1] > 2 * shares[2], `${whole}: ${shares}`);
  await page.control('flip').check();
  assert.ok((await page.picture()).share(isDrawn) > 2 * shares[2]);
  await page.control('cut').selectOption('none');
  assert.equal((await page.picture()).share(isDrawn), whole);
  await page.close();
});

test('the cut has the materials within', async () => {
  const page = await openRun();
  await page.slide('output', 0);
  await page.control('colour').selectOption('flux_ion'); // none at this output: the surface is grey
  await page.control('cut').selectOption('z');
  await page.slide('place', 0.999);
  // Seen from above: mask, with silicon in its opening.
  const mask = (await page.picture()).share(isPink);
  assert.ok(mask > 0.01, `${mask} is mask`);
  await page.slide('place', 0.1);
  const silicon = await page.picture();
  assert.equal(silicon.share(isPink), 0);
  assert.ok(silicon.share(isDrawn) > 0.02);
  assert.match(await page.viewer.locator('.materials').textContent(), /^Simask$/);
  await page.close();
});

test('the mesh is drawn over the surface', async () => {
  const page = await openRun();
  const plain = await page.picture();
  await page.control('wireframe').check();
  const lines = await page.picture();
  assert.ok(lines.darkerThan(plain) > 0.001, `${lines.darkerThan(plain)}`);
  assert.equal(plain.darkerThan(lines), 0);
  assert.ok(lines.share(isDrawn) < 1.02 * plain.share(isDrawn));
  await page.close();
});

test('the address says how the wafer is shown', async () => {
  const page = await openRun();
  await page.control('colour').selectOption('speed_nm_s');
  await page.control('cut').selectOption('y');
  await page.slide('place', 0.7);
  await page.control('wireframe').check();
  await page.slide('output', 2);
  const byHand = await page.picture();
  await page.close();
  const hash = '#colour=speed_nm_s&cut=y&place=0.7&wireframe=on&output=2&unknown=1';
  const again = await openRun({ hash });
  assert.equal((await again.picture()).difference(byHand), 0);
  await again.close();
  const wrong = await openRun({ hash: '#colour=<b>&cut=w&output=99' });
  assert.equal(await wrong.control('colour').inputValue(), 'material');
  assert.equal(await wrong.control('cut').inputValue(), 'none');
  assert.equal(await wrong.control('output').inputValue(), '5');
  await wrong.close();
});

test('dragging turns the wafer, and reset turns it back', async () => {
  const page = await openRun();
  const before = await page.picture();
  await page.drag([0.5, 0.5], [120, 40]);
  assert.ok((await page.picture()).difference(before) > 0.05);
  await page.viewer.locator('button').click();
  assert.equal((await page.picture()).difference(before), 0);
  await page.close();
});

test('both surfaces of a comparison are seen by one camera', async () => {
  const page = await openComparison();
  const masks = (picture) => [picture.mask(isDrawn, 0, 0.5), picture.mask(isDrawn, 0.5, 1)];
  const before = masks(await page.picture());
  assert.ok(maskDifference(...before) < 0.01);
  await page.drag([0.25, 0.5], [90, -60]);
  const left = masks(await page.picture());
  assert.ok(maskDifference(...left) < 0.01);
  assert.ok(maskDifference(before[1], left[1]) > 0.02);
  await page.drag([0.75, 0.5], [-60, 80]);
  const right = masks(await page.picture());
  assert.ok(maskDifference(...right) < 0.01);
  assert.ok(maskDifference(left[0], right[0]) > 0.02);
  await page.close();
});

test('a comparison starts with the distance, and shows both meshes', async () => {
  const page = await openComparison();
  assert.equal(await page.control('colour').inputValue(), 'distance_spacings');
  const names = await page.viewer.locator('.names span').allTextContents();
  assert.match(names[0], /^full: [0-9,]+ facets$/);
  assert.match(names[1], /^simplified: [0-9,]+ facets$/);
  const plain = await page.picture();
  await page.control('wireframe').check();
  const lines = await page.picture();
  // The full mesh has many times the edges.
  const [left, right] = [lines.darkerThan(plain, 0, 0.5), lines.darkerThan(plain, 0.5, 1)];
  assert.ok(left > 1.5 * right && right > 0.001, `${left} ${right}`);
  await page.close();
});

test('a browser without WebGL shows the picture and says why', async () => {
  const page = await openRun({ init: 'HTMLCanvasElement.prototype.getContext = () => null;' });
  assert.equal(await page.page.locator('.still img').isVisible(), true);
  assert.match(await page.page.locator('.scene').textContent(), /No view in space/);
  page.complaints = page.complaints.filter((text) => !text.includes('WebGL'));
  await page.close();
});

test('on paper there is the picture alone', async () => {
  const page = await openRun();
  await page.picture();
  await page.page.emulateMedia({ media: 'print' });
  assert.equal(await page.page.locator('.still img').isVisible(), true);
  assert.equal(await page.viewer.isVisible(), false);
  await page.close();
});

test('dark pages have light text', async () => {
  const page = await openRun({ colorScheme: 'dark' });
  const ink = await page.page.evaluate(() => getComputedStyle(document.body).color);
  assert.match(ink, /rgb\(2[0-9]{2}, 2[0-9]{2}, 2[0-9]{2}\)/);
  await page.close();
});
