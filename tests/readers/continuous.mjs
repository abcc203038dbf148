// Does the slider of triangles show what is in a progressive file? Writes the page of one, opens it in a browser
// without a window, and holds that at each place of the slider the page shows as many triangles as
// `seamwise extract` gives, and the picture of that level; that a geomorph is the levels at its ends and changes
// less from step to step than a switch between them.
//
//     node continuous.mjs SEAMWISE FOLDER_WITH_NODE_MODULES
//
// Needs a Chromium (SEAMWISE_CHROMIUM, or `chromium` on the path); says so and skips without one.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { Findings, openPage, withBrowser } from './browser.mjs';
import { differences, reference, settle } from './pictures.mjs';

const HERE = dirname(fileURLToPath(import.meta.url));
const PLACES = [0, 0.21, 0.5, 0.83, 1];
const MOST_OFF = 0.02; // mean absolute difference of sRGB over covered pixels
const STEPS = 8; // of a geomorph
const SIDE = 256; // pixels

const [tool, modules] = process.argv.slice(2).map((path) => resolve(path));
const scratch = mkdtempSync(join(tmpdir(), 'seamwise-continuous-'));
process.on('exit', () => rmSync(scratch, { recursive: true, force: true }));
const findings = new Findings();
const hold = (isTrue, what) => findings.hold(isTrue, what);
const run = (...args) => execFileSync(tool, args, { stdio: ['ignore', 'pipe', 'inherit'] }).toString();

// Drags the slider, and tells what the page says then.
async function drag(page, place) {
  await page.evaluate((value) => {
    const slider = document.getElementById('viewer-triangles');
    slider.value = value;
    slider.dispatchEvent(new Event('input'));
  }, place);
  await settle(page);
  return page.evaluate(() => ({
    shown: Number(document.getElementById('viewer').dataset.triangles.split(' ').at(-1)),
    wanted: window.seamwise.stage.models.at(-1).progress.count,
    words: document.getElementById('viewer-status').textContent,
  }));
}

async function holdCounts(page, file) {
  const off = [];
  for (const place of PLACES) {
    const { shown, wanted, words } = await drag(page, place);
    const level = join(scratch, 'level.glb');
    const told = Number(run('extract', file, '--triangles', String(wanted), '-o', level).split(' ')[0]);
    hold(shown === told, `${shown} triangles are shown, and ${told} extracted`);
    hold(words.includes(shown.toLocaleString('en-US')), `the page says: ${words}`);
    off.push(...await differences(page, 1, reference(tool, scratch, level)));
  }
  hold(Math.max(...off) < MOST_OFF, `levels are ${off.join(', ')} off`);
  return Math.max(...off);
}

// The root mean square of the change between pictures at the ends of a geomorph and at the steps on its way.
const changes = (page, steps, side) => page.evaluate(async (steps, side) => {
  const { stage } = window.seamwise;
  const { progress } = stage.models[1];
  progress.count = progress.coarsest * 2;
  const [from, to] = progress.stops();
  const view = { eye: [1.6, 1.1, 1.9], target: [0, 0, 0], halfWidth: 0.5 };
  const { center, radius } = stage.models[0].bounds;
  view.eye = view.eye.map((x, k) => center[k] + radius * x);
  view.target = center;
  const draw = (count, isMorphing) => {
    Object.assign(progress, { count, isMorphing });
    stage.draw();
    return stage.pixels(1, view, side);
  };
  const off = (a, b) => Math.sqrt(a.reduce((sum, x, at) => sum + (x - b[at]) ** 2, 0) / a.length) / 255;
  const ends = [from, to].map((count) => draw(count, false));
  const way = Array.from({ length: steps + 1 }, (_, step) => draw(from * (to / from) ** (step / steps), step < steps));
  const jumps = way.slice(1).map((own, at) => off(own, way[at]));
  return { hard: off(...ends), first: off(way[0], ends[0]), last: off(way[steps], ends[1]), jump: Math.max(...jumps) };
}, steps, side);

async function main(look) {
  const sample = resolve(HERE, '../../data/sample.glb');
  run('bake', sample, '-o', scratch, '--progressive', '--fast', '--no-evaluate', '--textures', 'keep');
  const file = join(scratch, 'sample_progressive.glb');
  const html = join(scratch, 'page.html');
  run('view', file, '-o', html);
  await look(async (browser) => {
    const { page, complaints } = await openPage(browser);
    await page.setViewport({ width: 1280, height: 900 });
    await page.goto(`file://${html}`);
    await page.evaluate(() => window.seamwiseReady);
    const errors = await page.$eval('#viewer-errors', (own) => own.textContent);
    hold(errors === '', errors);
    const off = await holdCounts(page, file);
    const { hard, first, last, jump } = await changes(page, STEPS, SIDE);
    hold(first < 1e-3 && last < 1e-3, `the ends of a geomorph are ${first} and ${last} off the levels`);
    hold(hard > 0 && jump < 0.5 * hard, `a geomorph jumps by ${jump}, a switch by ${hard}`);
    await page.focus('#viewer-canvas');
    await page.keyboard.press('g');
    hold(await page.$eval('#viewer-geomorph', (own) => own.checked), 'G is not heard');
    hold(complaints.length === 0, complaints.join('\n'));
    console.log(`levels off by at most ${off.toFixed(4)}; a geomorph's largest step is ${(jump / hard).toFixed(2)} of a switch`);
    await page.close();
  });
  findings.tell();
}

await withBrowser(modules, main);
