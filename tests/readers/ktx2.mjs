// Does three.js show a bake's textures in KTX2 as it shows the same in PNG? Bakes assets in both, loads each level in a
// browser without a window and compares the pictures. Fails if the reader reports an error, if a texture is not compressed
// there with all of its mip maps and in the color space of its place, or if the pictures are alike by less than LEAST.
//
//     node ktx2.mjs SEAMWISE FOLDER_WITH_NODE_MODULES
//
// Needs a Chromium (SEAMWISE_CHROMIUM, or `chromium` on the path); says so and skips without one.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { Findings, openPage, serve, withBrowser } from './browser.mjs';

const HERE = dirname(fileURLToPath(import.meta.url));
const DATA = resolve(HERE, '../../data');
const ASSETS = resolve(HERE, '../../../shared/assets');
const SIDE = 512; // pixels
const LEAST = 36; // dB: the transcoding to the browser's own blocks costs some of what UASTC has
const SEEN = 5000; // pixels at least

const CASES = [
  { name: 'sample', input: join(DATA, 'sample.glb'), options: ['--textures', 'repair'] },
  { name: 'popcorn', input: join(ASSETS, 'scan/popcorn.glb'), options: ['--textures', 'transfer'] },
  { name: 'helmet', input: join(ASSETS, 'pbr/FlightHelmet/FlightHelmet.gltf'), options: ['--textures', 'repair'] },
];

const [tool, modules] = process.argv.slice(2).map((path) => resolve(path));
const scratch = mkdtempSync(join(tmpdir(), 'seamwise-ktx2-'));
process.on('exit', () => rmSync(scratch, { recursive: true, force: true }));
const findings = new Findings();

function bake({ name, input, options }, format) {
  const more = format === 'ktx2' || options.includes('transfer') ? ['--texture-format', format] : [];
  const file = `${name}_${format}.glb`;
  execFileSync(tool, ['--quiet', 'bake', input, '-o', join(scratch, file), '--ratios', '0.25', '--fast', '--no-evaluate',
    ...options, ...more], { stdio: ['ignore', 'ignore', 'inherit'] });
  return `/out/${file}`;
}

async function holdAlike(browser, address, own) {
  const urls = ['png', 'ktx2'].map((format) => bake(own, format));
  const { page, complaints } = await openPage(browser);
  await page.goto(`${address}/page/page.html`);
  const { psnr, count, textures } = await page.evaluate(async (urls, side) => {
    const { show, compare } = await import('/page/show_ktx2.js');
    const pictures = [];
    for (const url of urls) {
      const canvas = document.createElement('canvas');
      [canvas.width, canvas.height] = [side, side];
      pictures.push(await show(canvas, url));
    }
    return { ...compare(pictures[0].data, pictures[1].data), textures: pictures[1].textures };
  }, urls, SIDE);
  await page.close();
  console.log(`${own.name} in three: ${textures.length} textures in KTX2, ${psnr.toFixed(1)} dB over ${count} pixels`);
  findings.hold(textures.length > 0 && count > SEEN, 'nothing is to be seen');
  findings.hold(psnr > LEAST, `the pictures are alike by less than ${LEAST} dB`);
  for (const { slot, isCompressed, colorSpace, width, height, levels } of textures) {
    const isColor = ['map', 'emissiveMap'].includes(slot);
    findings.hold(isCompressed, `${slot} is not compressed`);
    findings.hold((colorSpace === 'srgb') === isColor, `${slot} is in ${colorSpace || 'no color space'}`);
    findings.hold(levels === Math.floor(Math.log2(Math.max(width, height))) + 1, `${slot} has ${levels} levels`);
  }
  findings.hold(complaints.length === 0, complaints.join('\n'));
}

async function main(look) {
  const server = await serve({ modules: join(modules, 'node_modules'), out: scratch, page: HERE });
  for (const own of CASES) {
    if (existsSync(own.input)) await look((browser) => holdAlike(browser, server.address, own));
    else console.log(`skipped: ${own.input} is absent`);
  }
  server.close();
  findings.tell();
}

await withBrowser(modules, main);
