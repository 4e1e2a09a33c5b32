// Bundles src/main.js with all it imports into one script: node bundle.mjs FOLDER OUTPUT.
// FOLDER holds the packages that package-lock.json names; they are fetched where they are missing or others.

import { spawnSync } from 'node:child_process';
import { copyFileSync, existsSync, mkdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const folder = resolve(process.argv[2]);
const lock = 'package-lock.json';
const fetched = join(folder, 'node_modules', 'fetched-by-this-lock.json');

if (!existsSync(fetched) || !readFileSync(fetched).equals(readFileSync(join(here, lock)))) {
  mkdirSync(folder, { recursive: true });
  for (const file of ['package.json', lock]) copyFileSync(join(here, file), join(folder, file));
  // Nothing of what is fetched is run while it is installed.
  const options = ['ci', '--ignore-scripts', '--no-audit', '--no-fund', '--prefer-offline', '--fetch-retries=0'];
  const npm = spawnSync('npm', options, { cwd: folder, stdio: ['ignore', 'ignore', 'inherit'] });
  if (npm.status !== 0) {
    console.error('bundle: npm cannot fetch the packages of apps/viewer/package-lock.json');
    process.exit(2);
  }
  copyFileSync(join(here, lock), fetched);
}

const { build } = createRequire(join(folder, 'package.json'))('esbuild');
await build({
  entryPoints: [join(here, 'src', 'main.js')],
  outfile: process.argv[3],
  nodePaths: [join(folder, 'node_modules')],
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2022',
  charset: 'ascii',
  legalComments: 'inline',
  loader: { '.css': 'text' },
});
