// Do other people's readers show what a bake writes? Bakes assets in every form, loads each file with
// three.js and Babylon.js in a browser without a window, and compares its silhouette with that which
// `seamwise evaluate` draws of it from the same cameras. Fails if a reader reports an error, or if the
// silhouettes overlap by no more than LEAST.
//
//     node readers.mjs SEAMWISE FOLDER_WITH_NODE_MODULES
//
// Needs a Chromium (SEAMWISE_CHROMIUM, or `chromium` on the path); says so and skips without one.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { Findings, openPage, serve, withBrowser } from './browser.mjs';
import { writePlain } from './plain.mjs';
import { drawSheet } from './sheet.mjs';

const HERE = dirname(fileURLToPath(import.meta.url));
const ASSETS = resolve(HERE, '../../../shared/assets');
const LEAST = 0.98; // intersection over union
const VIEWS = 3;
const SIDE = 512; // pixels
const COVERED = 200; // of 255: white over half of a pixel of a sheet, gray over the rest
const HALF = 120; // of 255: half of the samples of a picture

// Ours has 2 × 2 samples a pixel: readers draw twice as large.
const SAMPLES = 2;

const CASES = [
  { name: 'scan', input: 'scan/frypan.glb', options: ['--layout', 'msft_lod'] },
  { name: 'materials', input: 'pbr/TennisRacquet/TennisRacquet.gltf', options: ['--layout', 'msft_lod', '--textures', 'transfer'] },
  { name: 'rigged', input: 'rigged/Fox.glb', options: ['--layout', 'msft_lod'] },
  { name: 'compressed', input: 'compressed/pirate_meshopt_quant.glb', options: ['--layout', 'msft_lod', '--compress'] },
  { name: 'web', input: 'scan/popcorn.glb', options: ['--preset', 'web'] },
  { name: 'named', input: 'scan/frypan.glb', options: ['--compress', '--format', 'gltf', '--layout', 'names'] },
];
const READERS = ['three', 'babylon'];

const [tool, modules] = process.argv.slice(2).map((path) => resolve(path));
const scratch = mkdtempSync(join(tmpdir(), 'seamwise-readers-'));
process.on('exit', () => rmSync(scratch, { recursive: true, force: true }));
const findings = new Findings();

function run(...args) {
  execFileSync(tool, ['--quiet', ...args], { stdio: ['ignore', 'ignore', 'inherit'] });
}

// The files of a bake of one level, that of all levels last.
function bake({ name, input, options }) {
  const folder = join(scratch, name);
  run('bake', join(ASSETS, input), '-o', folder, '--ratios', '0.25', '--fast', '--no-evaluate', ...options);
  const files = readdirSync(folder).filter((file) => /\.gl(b|tf)$/.test(file));
  return files.sort((a, b) => b.length - a.length).map((file) => join(folder, file));
}

// What `seamwise evaluate` draws of a file all in white, and from where.
function reference(file) {
  const plain = join(scratch, 'plain.glb');
  writePlain(file, plain);
  const sheet = drawSheet(tool, scratch, plain, { views: VIEWS, side: SIDE, options: ['--unlit'] });
  const cameras = sheet.cameras.map(({ eye, target, field_of_view_degrees }) => {
    const distance = Math.hypot(...eye.map((x, axis) => x - target[axis]));
    return { eye, target, fieldOfView: field_of_view_degrees, near: distance / 100, far: distance * 4 };
  });
  return { sheet, cameras };
}

// Loads a file in a page of its own; what it shows, and all that the page complained about.
async function show(browser, address, reader, { file, cameras, levels }) {
  const { page, complaints } = await openPage(browser);
  await page.goto(`${address}/page/page.html`);
  const url = `/out/${basename(dirname(file))}/${encodeURIComponent(basename(file))}`;
  const job = { reader, url, cameras, levels, side: SAMPLES * SIDE, names: dirname(file).endsWith('named') };
  const shown = await page.evaluate(async ({ reader, url, cameras, levels, side, names }) => {
    const { show } = await import(`/page/show_${reader}.js`);
    const canvas = document.getElementById('view');
    [canvas.width, canvas.height] = [side, side];
    return show(canvas, url, cameras, names, levels);
  }, job);
  await page.close();
  return { ...shown, complaints };
}

// Intersection over union of what is white in pictures and in the first column of a sheet.
async function overlaps(browser, pictures, sheet) {
  const page = await browser.newPage();
  const found = await page.evaluate(async (pictures, { url, places }, { side, samples, covered, half }) => {
    const pixels = async (url, size, x, y) => {
      const image = await createImageBitmap(await (await fetch(url)).blob());
      const canvas = new OffscreenCanvas(side, side);
      const context = canvas.getContext('2d');
      context.drawImage(image, x, y, size, size, 0, 0, side, side);
      return context.getImageData(0, 0, side, side).data;
    };
    const overlap = async (picture, view) => {
      const own = await pixels(picture, samples * side, 0, 0);
      const other = await pixels(url, side, ...places[view]);
      let [both, either] = [0, 0];
      for (let i = 0; i < own.length; i += 4) {
        const [a, b] = [own[i] >= half, other[i] >= covered];
        both += a && b;
        either += a || b;
      }
      return both / either;
    };
    return Promise.all(pictures.map(overlap));
  }, pictures, sheet, { side: SIDE, samples: SAMPLES, covered: COVERED, half: HALF });
  await page.close();
  return found;
}

// Holds that Babylon shows the coarsest level first, and the source in its place then.
async function holdStages(browser, address, file, cameras) {
  const [coarse, all] = [
    await show(browser, address, 'babylon', { file, cameras, levels: 1 }),
    await show(browser, address, 'babylon', { file, cameras }),
  ];
  const share = coarse.triangles / all.triangles;
  console.log(`  babylon: stages ${all.stages.join(', ')}; ${coarse.triangles} triangles first, then ${all.triangles}`);
  findings.hold(all.stages.join() === '0,1' && share > 0.2 && share < 0.3, 'the stages are others');
}

// Holds that a reader shows a file as it is drawn here.
async function holdPictures(browser, address, reader, file, { sheet, cameras }) {
  const { pictures, triangles, complaints } = await show(browser, address, reader, { file, cameras });
  const found = await overlaps(browser, pictures, sheet);
  const told = found.map((overlap) => overlap.toFixed(4)).join(', ');
  console.log(`${basename(dirname(file))}/${basename(file)} in ${reader}: ${triangles} triangles, overlap ${told}`);
  findings.hold(found.every((overlap) => overlap > LEAST), `the silhouettes overlap by no more than ${LEAST}`);
  findings.hold(complaints.length === 0, complaints.join('\n'));
}

async function main(look) {
  const server = await serve({ modules: join(modules, 'node_modules'), out: scratch, page: HERE });
  for (const own of CASES) {
    for (const file of bake(own)) {
      const drawn = reference(file);
      for (const reader of READERS) {
        await look((browser) => holdPictures(browser, server.address, reader, file, drawn));
      }
      if (own.name === 'scan' && !file.includes('_lod')) {
        await look((browser) => holdStages(browser, server.address, file, drawn.cameras));
      }
    }
  }
  server.close();
  findings.tell();
}

if (existsSync(ASSETS)) await withBrowser(modules, main);
else console.log(`skipped: ${ASSETS} is absent`);
