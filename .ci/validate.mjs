// Checks .glb and .gltf files with the Khronos glTF validator: prints its errors, counts its warnings by
// code, and exits with 1 if there was any error but those that a source brought along.
//
//     node validate.mjs FOLDER_WITH_NODE_MODULES FILE…
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { basename, dirname, join, resolve } from 'node:path';

// What sources bring along and nothing here changes: by the start of a file's name, the codes.
const BROUGHT = {
  // Inverse bind matrices a rounding off, and morph targets without bounds.
  bitmoji: ['ACCESSOR_INVALID_IBM', 'MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS'],
  // A texture that is not there.
  living_room: ['IO_ERROR'],
};
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
  const beside = (uri) => new Uint8Array(readFileSync(join(dirname(file), decodeURIComponent(uri))));
  const { issues } = await validator.validateBytes(bytes, {
    format: file.endsWith('.gltf') ? 'gltf' : 'glb',
    maxIssues: 0,
    externalResourceFunction: async (uri) => beside(uri),
  });
  const owner = Object.keys(BROUGHT).find((name) => basename(file).startsWith(name));
  const own = ({ code, severity }) => severity === 0 && !BROUGHT[owner]?.includes(code);
  errors += issues.messages.filter(own).length;
  const counts = new Map();
  for (const { code, severity } of issues.messages) {
    const key = `${SEVERITIES[severity]} ${code}`;
    counts.set(key, (counts.get(key) ?? 0) + 1);
  }
  const summary = [...counts].sort().map(([key, count]) => `${count} × ${key}`);
  console.log(`${basename(file)}: ${summary.join(', ') || 'nothing to say'}`);
  for (const { code, pointer, message } of issues.messages.filter(own)) {
    console.log(`  ${code} at ${pointer ?? 'the file'}: ${message}`);
  }
}
console.log(`${files.length} files, ${errors} errors`);
process.exit(errors === 0 ? 0 : 1);
