// Does the three.js plugin of web/ switch where the certificates say? Loads files of all levels, baked with
// `--layout msft_lod`, in a browser without a window, moves the camera out and in around each switch, and
// holds the level that is drawn, by its triangles, to the size law with the certificate's sizes and the
// diagonal that `seamwise evaluate` tells. Then scales, clones, zooms and hits what was loaded.
//
//     node lods.mjs SEAMWISE FOLDER_WITH_NODE_MODULES FILE.glb…
//
// Needs a Chromium (SEAMWISE_CHROMIUM, or `chromium` on the path); says so and skips without one.
import { execFileSync } from 'node:child_process';
import { basename, dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { Findings, openPage, serve, withBrowser } from './browser.mjs';
import { read } from './plain.mjs';

const HERE = dirname(fileURLToPath(import.meta.url));
const HEIGHT = 1080; // pixels
const FIELD_OF_VIEW = 30; // degrees
const HYSTERESIS = 0.1;
const CLOSE = 0.002; // relative: a switch is looked for as near as this

const [tool, modules, ...files] = process.argv.slice(2).map((path) => resolve(path));
const findings = new Findings();
const hold = (isTrue, what) => findings.hold(isTrue, what);

function diagonalOf(file) {
  const arguments_ = ['--quiet', 'evaluate', file, file, '--samples', '1000', '--views', '1', '--resolution', '64', '--json', '-'];
  return JSON.parse(execFileSync(tool, arguments_, { stdio: ['ignore', 'pipe', 'inherit'] })).reference.diagonal;
}

// Triangles of a node and of each of its levels, and what the certificates say of the asset.
function readLevels(file) {
  const { json } = read(file);
  const corners = ({ indices, attributes }) => json.accessors[indices ?? attributes.POSITION].count;
  const triangles = (index) => {
    const { mesh, children = [] } = json.nodes[index];
    const own = mesh === undefined ? [] : json.meshes[mesh].primitives.map((each) => corners(each) / 3);
    return [...own, ...children.map(triangles)].reduce((sum, count) => sum + count, 0);
  };
  const nodes = json.nodes.flatMap(({ extensions }, index) => (
    extensions?.MSFT_lod ? [[index, ...extensions.MSFT_lod.ids].map(triangles)] : []));
  const { levels } = json.asset.extras.seamwise;
  return { nodes, sizes: levels.map((level) => level.largest_size_pixels ?? Infinity) };
}

// The level after a move to a distance, by the law: never one that is shown larger than its size, and a
// coarser one only a tenth later.
function nextLevel(level, distance, switches) {
  const allowed = switches.filter((own) => distance >= own).length;
  const taken = switches.filter((own) => distance >= own / (1 - HYSTERESIS)).length;
  return allowed < level ? allowed : Math.max(level, taken);
}

// Distances to go to: out and in over each switch.
function walk(switches) {
  const around = [0.9, 1 - CLOSE, 1 + CLOSE, (1 - CLOSE) / (1 - HYSTERESIS), (1 + CLOSE) / (1 - HYSTERESIS),
    1 + CLOSE, 1 - CLOSE, 1.3];
  return switches.flatMap((distance) => around.map((share) => share * distance));
}

async function holdSwitches(browser, file) {
  const { nodes, sizes } = readLevels(file);
  const diagonal = diagonalOf(file);
  // A level without end is there from the start.
  const switches = sizes.map((size) => (diagonal * HEIGHT) / (2 * Math.tan((FIELD_OF_VIEW * Math.PI) / 360) * size));
  const distances = walk(switches.filter((own) => own > 0));
  const roots = { modules: join(modules, 'node_modules'), out: dirname(file), page: HERE, web: resolve(HERE, '../../web') };
  const server = await serve(roots);
  const { page, complaints } = await openPage(browser);
  await page.goto(`${server.address}/page/page.html`);
  const job = { url: `/out/${encodeURIComponent(basename(file))}`, distances, height: HEIGHT, fieldOfView: FIELD_OF_VIEW };
  const found = await page.evaluate(async (job) => (await import('/page/show_lods.js')).watch(document.getElementById('view'), job), job);
  hold(found.lods.length === nodes.length, `${found.lods.length} nodes switch, ${nodes.length} have levels`);
  const all = nodes.map((own) => own.join()).sort().join(' ');
  const loaded = found.lods.map(({ triangles }) => triangles.join()).sort().join(' ');
  hold(all === loaded, `the levels have ${loaded} triangles, those of the file ${all}`);
  for (const { triangles, steps } of found.lods) {
    let level = 0;
    steps.forEach((step, at) => {
      level = nextLevel(level, distances[at], switches);
      hold(step.level === level, `at ${distances[at]} level ${step.level} is shown, not ${level}`);
      hold(step.drawn === triangles[level], `at ${distances[at]} ${step.drawn} triangles are drawn, not those of level ${level}`);
    });
  }
  for (const { what, pixels, expected } of found.sizes) {
    hold(Math.abs(pixels / expected - 1) < 1e-4, `${what}: ${pixels} pixels, projected ${expected}`);
  }
  found.wrong.forEach((what) => hold(false, what));
  hold(complaints.length === 0, complaints.join('\n'));
  const told = switches.map((own) => own.toPrecision(4)).join(', ');
  console.log(`${basename(file)}: ${nodes.length} nodes, ${distances.length} moves, levels switch at ${told}`);
  await page.close();
  server.close();
}

async function main(look) {
  for (const file of files) await look((browser) => holdSwitches(browser, file));
  findings.tell();
}

await withBrowser(modules, main);
