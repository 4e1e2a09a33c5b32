// That apps/viewer/viewer.min.js is what its sources give. Leaves the packages that the other tests need in VIEWER_FOLDER.

import { spawnSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';

const viewer = join(process.env.SOURCE, 'apps', 'viewer');
const made = join(process.env.VIEWER_FOLDER, 'viewer.min.js');
const script = join(viewer, 'bundle.mjs');
const { status } = spawnSync(process.execPath, [script, process.env.VIEWER_FOLDER, made], { stdio: 'inherit' });
if (status === 2) {
  console.log('skipped: the packages of the viewer are out of reach');
} else if (status !== 0 || !readFileSync(made).equals(readFileSync(join(viewer, 'viewer.min.js')))) {
  console.error('apps/viewer/viewer.min.js is not what its sources give: run ./dev viewer and commit it');
  process.exitCode = 1;
}
