// All tests of the viewer in a browser; says so where what they need is missing.

import { spawnSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

function missing() {
  if (!existsSync(join(process.env.VIEWER_FOLDER, 'node_modules'))) return 'the packages of the viewer are out of reach';
  if (!existsSync('/usr/bin/chromium')) return 'there is no /usr/bin/chromium (Debian package chromium)';
  return null;
}

if (missing()) {
  console.log(`skipped: ${missing()}`);
} else {
  const files = ['mesh_test.mjs', 'page_test.mjs'].map((name) => fileURLToPath(new URL(name, import.meta.url)));
  process.exitCode = spawnSync(process.execPath, ['--test', ...files], { stdio: 'inherit' }).status;
}
