// Checks .glb files with the Khronos glTF validator: prints its errors, counts its warnings by
// code, and exits with 1 if there was any error.
//
//     node validate.mjs FOLDER_WITH_NODE_MODULES FILE.glb…
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { basename, join, resolve } from 'node:path';

const SEVERITIES = ['error', 'warning', 'information', 'hint'];

const [modules, ...files] = process.argv.slice(2);
if (files.length === 0) {
  console.error('no files to check');
  process.exit(2);
}
const validator = createRequire(join(resolve(modules), 'here.js'))('gltf-validator');
console.log(`glTF validator ${validator.version()}`);

let errors = 0;
for (const file of files) {
  const bytes = new Uint8Array(readFileSync(file));
  const { issues } = await validator.validateBytes(bytes, { format: 'glb', maxIssues: 0 });
  errors += issues.numErrors;
  const counts = new Map();
  for (const { code, severity } of issues.messages) {
    const key = `${SEVERITIES[severity]} ${code}`;
    counts.set(key, (counts.get(key) ?? 0) + 1);
  }
  const summary = [...counts].sort().map(([key, count]) => `${count} × ${key}`);
  console.log(`${basename(file)}: ${summary.join(', ') || 'nothing to say'}`);
  for (const { severity, code, pointer, message } of issues.messages) {
    if (severity === 0) {
      console.log(`  ${code} at ${pointer ?? 'the file'}: ${message}`);
    }
  }
}
console.log(`${files.length} files, ${errors} errors`);
process.exit(errors === 0 ? 0 : 1);
