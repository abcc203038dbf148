// Does the interactive view show what is in the files? Writes the pages of several models and their levels,
// opens each in a browser without a window, and holds that it complains of nothing; that keys and the
// slider of distances change the level, to the files' own counts of triangles; that the shadings differ;
// and that the lit one is what `seamwise evaluate` draws from the same cameras.
//
//     node viewer.mjs SEAMWISE FOLDER_WITH_NODE_MODULES FOLDER_OF_BAKES
//
// Needs a Chromium (SEAMWISE_CHROMIUM, or `chromium` on the path); says so and skips without one.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { Findings, openPage, withBrowser } from './browser.mjs';
import { differences, reference, settle } from './pictures.mjs';

const HERE = dirname(fileURLToPath(import.meta.url));
const ASSETS = resolve(HERE, '../../../shared/assets');
const LEVELS = [1, 2, 3, 4];
const MOST_OFF = 0.02; // mean absolute difference of sRGB over covered pixels
const LEAST_CHANGE = 0.01; // share of a screenshot's pixels that another shading changes
// Two seconds with a core to itself; a gate shares it.
const MOST_MILLISECONDS = 10_000;
const NARROW = 400; // pixels

const CASES = [
  { name: 'sample', source: resolve(HERE, '../../data/sample.glb'), mostBytes: 12e6 },
  { name: 'popcorn', source: join(ASSETS, 'scan/popcorn.glb'), mostBytes: 12e6 },
  { name: 'FlightHelmet', source: join(ASSETS, 'pbr/FlightHelmet/FlightHelmet.gltf'), mostBytes: 16e6 },
  // It has no normals, so that smooth is flat.
  { name: 'Fox', source: join(ASSETS, 'rigged/Fox.glb'), mostBytes: 4e6, same: 'smooth' },
];

const [tool, modules, bakes] = process.argv.slice(2).map((path) => resolve(path));
const scratch = mkdtempSync(join(tmpdir(), 'seamwise-viewer-'));
process.on('exit', () => rmSync(scratch, { recursive: true, force: true }));
const findings = new Findings();
const hold = (isTrue, what) => findings.hold(isTrue, what);

function run(...args) {
  return execFileSync(tool, args, { stdio: ['ignore', 'pipe', 'inherit'] }).toString();
}

// The triangles of a file's default scene, counted by its accessors.
function countTriangles(path) {
  const bytes = readFileSync(path);
  const isGlb = bytes.readUInt32LE(0) === 0x46546c67;
  const json = JSON.parse(isGlb ? bytes.subarray(20, 20 + bytes.readUInt32LE(12)) : bytes);
  const corners = ({ indices, attributes }) => json.accessors[indices ?? attributes.POSITION].count;
  const below = (index) => {
    const { mesh, children = [] } = json.nodes[index];
    const own = mesh === undefined ? [] : json.meshes[mesh].primitives.map(corners);
    return [...own, ...children.map(below)].reduce((sum, count) => sum + count, 0);
  };
  return json.scenes[json.scene ?? 0].nodes.reduce((sum, node) => sum + below(node), 0) / 3;
}

const shownTriangles = (page) => page.evaluate(() => Number(document.getElementById('viewer').dataset.triangles.split(' ').at(-1)));

// The keys 1 to 5, and all of them once more in place.
async function holdKeys(page, counts) {
  await page.focus('#viewer-canvas');
  for (const key of [1, 2, 3, 4, 5]) {
    await page.keyboard.press(String(key));
    await settle(page);
    const shown = await shownTriangles(page);
    hold(shown === counts[key - 1], `key ${key} shows ${shown} triangles, the file has ${counts[key - 1]}`);
  }
  await page.keyboard.press('f');
  const flipped = [];
  for (let time = 0; time < 2; time += 1) {
    await page.keyboard.press('f');
    await settle(page);
    flipped.push(await shownTriangles(page));
  }
  hold(flipped.join() === `${counts[0]},${counts[4]}`, `F flips between ${flipped.join(' and ')} triangles`);
}

// The slider of distances chooses what `seamwise select` does.
async function holdDistances(page, counts, report) {
  const chosen = new Set();
  for (const place of [0, 0.3, 0.5, 0.7, 0.85, 1]) {
    const pixels = await page.evaluate((value) => {
      const slider = document.getElementById('viewer-distance');
      slider.value = value;
      slider.dispatchEvent(new Event('input'));
      const { camera } = window.seamwise.stage;
      return camera.pixels(window.seamwise.panel.side);
    }, place);
    await settle(page);
    const level = Number(run('select', report, '--pixels', String(pixels)));
    const shown = await shownTriangles(page);
    hold(shown === counts[level], `at ${pixels.toFixed()} pixels ${shown} triangles are shown, not level ${level}`);
    chosen.add(level);
  }
  await page.click('#viewer-reset');
  return [...chosen];
}

// Screenshots of the canvas in each shading but one that is known to be the same as another, and with edges:
// how much of each pair differs at least.
async function holdShadings(page, same) {
  await page.keyboard.press('5');
  const offered = await page.$$eval('#viewer-shading option:not(:disabled)', (all) => all.map((option) => option.value));
  hold(offered.length === 10, `${offered.join(', ')} are offered`);
  const names = offered.filter((name) => name !== same);
  const canvas = await page.$('#viewer-canvas');
  const pictures = [];
  for (const name of names) {
    await page.select('#viewer-shading', name);
    await settle(page);
    pictures.push(await canvas.screenshot({ encoding: 'base64' }));
  }
  await page.select('#viewer-shading', 'lit');
  await page.click('#viewer-wireframe');
  await settle(page);
  pictures.push(await canvas.screenshot({ encoding: 'base64' }));
  await page.click('#viewer-wireframe');
  const shares = await page.evaluate(async (pictures) => {
    const pixels = await Promise.all(pictures.map(async (picture) => {
      const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${picture}`)).blob());
      const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
      context.drawImage(image, 0, 0);
      return new Uint32Array(context.getImageData(0, 0, image.width, image.height).data.buffer);
    }));
    return pixels.flatMap((a, i) => pixels.slice(0, i).map((b) => a.filter((pixel, at) => pixel !== b[at]).length / a.length));
  }, pictures);
  const least = Math.min(...shares);
  hold(least > LEAST_CHANGE, `two of the shadings ${names.join(', ')} and edges differ in ${least} of the pixels`);
  return least;
}

async function holdNarrow(page) {
  await page.setViewport({ width: NARROW, height: 800 });
  await settle(page);
  const width = await page.evaluate(() => document.documentElement.scrollWidth);
  hold(width <= NARROW, `the page is ${width} pixels wide on a screen of ${NARROW}`);
}

async function holdPage(browser, { name, source, mostBytes, same }) {
  const levels = LEVELS.map((level) => join(bakes, `${name}_lod${level}.glb`));
  const file = join(scratch, `${name}.html`);
  run('view', source, ...levels, '-o', file);
  const bytes = statSync(file).size;
  hold(bytes < mostBytes, `the page takes ${bytes} bytes`);
  const { page, complaints } = await openPage(browser);
  await page.setViewport({ width: 1280, height: 900 });
  await page.goto(`file://${file}`);
  await page.evaluate(() => window.seamwiseReady);
  const { first, errors } = await page.evaluate(() => ({
    first: window.seamwise.stage.firstPicture, errors: document.getElementById('viewer-errors').textContent }));
  hold(first < MOST_MILLISECONDS, `the first picture comes after ${first} ms`);
  hold(errors === '', errors);
  const counts = [source, ...levels].map(countTriangles);
  await holdKeys(page, counts);
  const chosen = await holdDistances(page, counts, join(bakes, `${name}.json`));
  await page.click('[value=single]');
  const least = await holdShadings(page, same);
  const off = [];
  for (const [index, own] of [[0, source], [4, levels[3]]]) off.push(...await differences(page, index, reference(tool, scratch, own)));
  hold(Math.max(...off) < MOST_OFF, `lit pictures are ${off.join(', ')} off`);
  await holdNarrow(page);
  hold(complaints.length === 0, complaints.join('\n'));
  console.log(`${name}: ${(bytes / 1e6).toFixed(1)} MB, first picture after ${first.toFixed()} ms, levels ${chosen.join(', ')} `
    + `by distance, shadings differ in ${(100 * least).toFixed(1)} %, lit off by ${off.map((each) => each.toFixed(4)).join(', ')}`);
  await page.close();
}

async function main(look) {
  for (const own of CASES) {
    if (existsSync(own.source)) await look((browser) => holdPage(browser, own));
    else console.log(`skipped: ${own.source} is absent`);
  }
  findings.tell();
}

await withBrowser(modules, main);
