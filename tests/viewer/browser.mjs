// Pages of scarp in a browser without a network, and what is seen on them.

import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const executablePath = '/usr/bin/chromium';
const args = [
  '--headless',
  '--no-sandbox',
  '--disable-gpu',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--use-gl=angle',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
];

/** What the tests need beside scarp: from the folder that bundle_test.mjs filled. */
export async function launch() {
  const { chromium } = createRequire(join(process.env.VIEWER_FOLDER, 'package.json'))('playwright-core');
  return chromium.launch({ executablePath, args });
}

/** A folder for results that goes when the process does. */
export const folder = mkdtempSync(join(tmpdir(), 'scarp-viewer-'));
process.on('exit', () => rmSync(folder, { recursive: true, force: true }));

/** Calls scarp; the exit code has to be 0. */
export function scarp(...words) {
  const result = spawnSync(process.env.SCARP, words, { encoding: 'utf8' });
  assert.equal(result.status, 0, result.stderr);
}

/** A page that fails the test when it asks for anything outside, or complains. */
export class OpenPage {
  static async open(browser, file, { init, hash = '', ...options } = {}) {
    const context = await browser.newContext({ viewport: { width: 800, height: 640 }, ...options });
    await context.setOffline(true);
    const page = new OpenPage();
    page.context = context;
    page.page = await context.newPage();
    page.complaints = [];
    page.page.on('console', (message) => {
      if (message.type() === 'error') page.complaints.push(message.text());
    });
    page.page.on('pageerror', (error) => page.complaints.push(error.stack));
    const url = String(pathToFileURL(file));
    page.page.on('request', (request) => {
      if (request.url().split('#')[0] !== url && !request.url().startsWith('data:')) page.complaints.push(request.url());
    });
    if (init) await page.page.addInitScript(init);
    await page.page.goto(url + hash);
    return page;
  }

  async close() {
    assert.deepEqual(this.complaints, []);
    await this.context.close();
  }

  get viewer() {
    return this.page.locator('.viewer').first();
  }

  control(name) {
    return this.viewer.locator(`[name=${name}]`);
  }

  /** Moves a slider. */
  async slide(name, value) {
    await this.control(name).evaluate((input, to) => {
      input.value = to;
      input.dispatchEvent(new Event('input'));
    }, value);
  }

  /** Drags over the surface, by pixels from a place that is a part of the canvas. */
  async drag(place, [dx, dy]) {
    const box = await this.viewer.locator('canvas').boundingBox();
    const x = box.x + place[0] * box.width;
    const y = box.y + place[1] * box.height;
    await this.page.mouse.move(x, y);
    await this.page.mouse.down();
    await this.page.mouse.move(x + dx, y + dy, { steps: 4 });
    await this.page.mouse.up();
  }

  /** What is on the canvas once nothing moves any more. */
  async picture() {
    const panel = await this.viewer.elementHandle();
    for (let before = -1, now = -2; before !== now; ) {
      before = now;
      await this.page.waitForTimeout(120);
      now = Number(await panel.getAttribute('data-pictures'));
    }
    const png = await this.viewer.locator('canvas').screenshot();
    const pixels = await this.page.evaluate(async (text) => {
      const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
      context.drawImage(image, 0, 0);
      const { data } = context.getImageData(0, 0, image.width, image.height);
      // As text: arrays of numbers take seconds to get here.
      let bytesAsText = '';
      for (let n = 0; n < data.length; n += 8192) bytesAsText += String.fromCharCode(...data.subarray(n, n + 8192));
      return { width: image.width, height: image.height, text: btoa(bytesAsText) };
    }, png.toString('base64'));
    return new Picture(pixels.width, pixels.height, Buffer.from(pixels.text, 'base64'));
  }
}

/** Pixels of a canvas on white paper; the names at its top are left out. */
export class Picture {
  constructor(width, height, data) {
    this.width = width;
    this.height = height;
    this.data = data;
  }

  /** Which pixels fulfil a condition on red, green and blue, as an array of 0 and 1. */
  mask(condition, from = 0, to = 1) {
    const found = [];
    for (let y = 30; y < this.height; ++y) {
      for (let x = Math.round(from * this.width); x < Math.round(to * this.width); ++x) {
        const n = 4 * (y * this.width + x);
        found.push(condition(this.data[n], this.data[n + 1], this.data[n + 2]) ? 1 : 0);
      }
    }
    return found;
  }

  /** The part of the pixels that fulfil a condition. */
  share(condition, from, to) {
    const found = this.mask(condition, from, to);
    return found.reduce((sum, each) => sum + each, 0) / found.length;
  }

  /** The part of the pixels, from one part of the width to another, that are much darker here. */
  darkerThan(other, from = 0, to = 1) {
    const brightness = (picture) => {
      const found = [];
      picture.mask((r, g, b) => found.push(r + g + b), from, to);
      return found;
    };
    const before = brightness(other);
    return brightness(this).filter((now, n) => now < before[n] - 90).length / before.length;
  }

  /** The part of the pixels that differ. */
  difference(other) {
    let count = 0;
    for (let n = 0; n < this.data.length; n += 4)
      if ([0, 1, 2].some((c) => Math.abs(this.data[n + c] - other.data[n + c]) > 8)) ++count;
    return count / (this.data.length / 4);
  }
}

export const isDrawn = (r, g, b) => Math.min(r, g, b) < 250;
export const isYellow = (r, g, b) => r > 150 && g > 150 && b < 0.55 * Math.min(r, g);
export const isReddish = (r, g, b) => r > 1.04 * g && g > 1.02 * b;
export const isPink = (r, g, b) => r > 1.3 * g && b > 1.1 * g;
export const isGrey = (r, g, b) => isDrawn(r, g, b) && Math.max(r, g, b) - Math.min(r, g, b) < 14;

/** The part in which two masks differ. */
export const maskDifference = (a, b) => a.reduce((sum, each, n) => sum + (each === b[n] ? 0 : 1), 0) / a.length;
