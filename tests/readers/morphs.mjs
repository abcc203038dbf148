// Do the materials of web/ lead a level to the next? Draws pairs of levels, baked with `--geomorph`, in a browser
// without a window: at both ends the picture is that of the level, and no step between is a jump.
//
//     node morphs.mjs FOLDER_WITH_NODE_MODULES FINE.glb COARSE.glb …
//
// Needs a Chromium (SEAMWISE_CHROMIUM, or `chromium` on the path); says so and skips without one.
import { basename, dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { Findings, openPage, serve, withBrowser } from './browser.mjs';

const HERE = dirname(fileURLToPath(import.meta.url));
const SAME = 0.1; // share of the hard switch: tangents are the level's own until the end
const MOST = 0.25; // share of the hard switch that a sixteenth of the way may be

const [modules, ...files] = process.argv.slice(2).map((path) => resolve(path));
const findings = new Findings();
const hold = (isTrue, what) => findings.hold(isTrue, what);

async function holdMorph(browser, pair) {
  const roots = { modules: join(modules, 'node_modules'), out: dirname(pair[0]), page: HERE, web: resolve(HERE, '../../web') };
  const server = await serve(roots);
  const { page, complaints } = await openPage(browser);
  await page.goto(`${server.address}/page/page.html`);
  const urls = pair.map((file) => `/out/${encodeURIComponent(basename(file))}`);
  const found = await page.evaluate(async (urls) => (await import('/page/show_morphs.js')).morph(document.getElementById('view'), urls), urls);
  const { hard, start, end, jump, lit } = found;
  hold(lit > 0.01 && hard > 0, `nothing is drawn: ${lit}, ${hard}`);
  hold(start === 0, `at 0 the picture is off by ${start}`);
  hold(end <= SAME * hard, `at 1 the picture is off by ${end} of ${hard}`);
  hold(jump <= MOST * hard, `a step jumps by ${jump} of ${hard}`);
  hold(complaints.length === 0, complaints.join('\n'));
  console.log(`${pair.map((file) => basename(file)).join(' to ')}: ${JSON.stringify(found)}`);
  await page.close();
  server.close();
}

async function main(look) {
  for (let at = 0; at + 1 < files.length; at += 2) {
    await look((browser) => holdMorph(browser, files.slice(at, at + 2)));
  }
  findings.tell();
}

await withBrowser(modules, main);
