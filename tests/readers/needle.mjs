// Do files of `--layout needle` show what they should? Bakes assets, opens each in a browser without a window with three.js
// and a small reader of NEEDLE_progressive (show_needle.js), and comes nearer step by step. Fails if the browser
// complains, if anything but the coarsest level is there at first, if a mesh is ever shown in a coarser level than the
// certificates allow, if nothing finer is fetched near by, or if pictures differ from the source's by more than MOST.
//
//     node needle.mjs SEAMWISE FOLDER_WITH_NODE_MODULES FILE…
//
// The reader is our own: the package that npm has for three.js (@needle-tools/gltf-progressive) names no licence, and asks
// servers elsewhere for decoders as it starts. Needs a Chromium (SEAMWISE_CHROMIUM, or `chromium` on the path); says so
// and skips without one.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, dirname, join, parse, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { Findings, openPage, serve, withBrowser } from './browser.mjs';
import { read } from './plain.mjs';

const HERE = dirname(fileURLToPath(import.meta.url));
const HEIGHT = 1080; // pixels
const FIELD_OF_VIEW = 30; // degrees
const MOST = 0.03; // of 1: the source's own edges and bleeding differ by as much

const [tool, modules, ...inputs] = process.argv.slice(2).map((path) => resolve(path));
const scratch = mkdtempSync(join(tmpdir(), 'seamwise-needle-'));
process.on('exit', () => rmSync(scratch, { recursive: true, force: true }));
const findings = new Findings();
const hold = (isTrue, what) => findings.hold(isTrue, what);

function bake(input) {
  execFileSync(tool, ['--quiet', 'bake', input, '-o', scratch, '--layout', 'needle', '--fast'], { stdio: ['ignore', 'ignore', 'inherit'] });
  const { name } = parse(input);
  const { levels } = JSON.parse(readFileSync(join(scratch, `${name}.json`)));
  const compared = ['--quiet', 'evaluate', input, input, '--samples', '1000', '--views', '1', '--resolution', '64', '--json', '-'];
  const { reference } = JSON.parse(execFileSync(tool, compared, { stdio: ['ignore', 'pipe', 'inherit'] }));
  const sizes = levels.map((level) => level.largest_size_pixels ?? Infinity);
  return { name, sizes, diagonal: reference.diagonal };
}

// Triangles of the file as it is opened, from its nodes.
function trianglesOf(file) {
  const { json } = read(file);
  const ofMesh = ({ primitives }) => primitives.reduce((sum, { indices }) => sum + json.accessors[indices].count / 3, 0);
  return json.nodes.reduce((sum, { mesh }) => sum + (mesh === undefined ? 0 : ofMesh(json.meshes[mesh])), 0);
}

async function holdLevels(browser, input) {
  const { name, sizes, diagonal } = bake(input);
  const roots = { modules: join(modules, 'node_modules'), out: scratch, page: HERE, source: dirname(input) };
  const server = await serve(roots);
  const { page, complaints } = await openPage(browser);
  await page.goto(`${server.address}/page/page.html`);
  const pixelsAt = (distance) => (diagonal * HEIGHT) / (2 * Math.tan((FIELD_OF_VIEW * Math.PI) / 360) * distance);
  // First from so far that the coarsest level will do, whichever way boxes are turned.
  const far = pixelsAt(Math.min(sizes.at(-1) / 4, 5));
  const distances = [far, ...[40, 20, 10, 5, 2.5, 1.4].map((times) => times * diagonal)];
  const job = { url: `/out/${encodeURIComponent(`${name}.glb`)}`, source: `/source/${encodeURIComponent(basename(input))}`,
    distances, height: HEIGHT, fieldOfView: FIELD_OF_VIEW };
  const steps = await page.evaluate(async (job) => (await import('/page/show_needle.js')).watch(document.getElementById('view'), job), job);
  hold(steps[0].fresh === trianglesOf(join(scratch, `${name}.glb`)), `${steps[0].fresh} triangles at first`);
  for (const { distance, levels, off } of steps) {
    const allowed = sizes.filter((size) => pixelsAt(distance) <= size).length;
    // A level of a mesh that is the same as the next coarser one is left out.
    const isAllowed = ({ level, numbers }) => {
      const all = [...numbers, sizes.length];
      return all[level] <= all.find((number) => number >= allowed);
    };
    hold(levels.every(isAllowed), `at ${distance} levels ${JSON.stringify(levels)} are shown, ${allowed} of ${sizes.length} allowed`);
    hold(off <= MOST, `at ${distance} the picture is off by ${off}`);
  }
  const [first, near] = [steps[0], steps.at(-1)];
  hold(first.levels.every(({ level, numbers }) => level === numbers.length), `far away there are ${JSON.stringify(first.levels)}`);
  hold(near.levels.every(({ level, numbers }) => level < numbers.length), `near by there are ${JSON.stringify(near.levels)}`);
  hold(near.triangles > first.triangles && near.files > first.files, 'nothing finer is fetched');
  hold(complaints.length === 0, complaints.join('\n'));
  const told = steps.map(({ levels, triangles, files, off }) => `${levels[0].level} (${triangles} triangles, ${files} files, off by ${off.toFixed(4)})`);
  console.log(`${name}: ${told.join(', ')}`);
  await page.close();
  server.close();
}

async function main(look) {
  for (const input of inputs) await look((browser) => holdLevels(browser, input));
  findings.tell();
}

await withBrowser(modules, main);
