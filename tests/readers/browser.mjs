// The browser that tests look with: a Chromium without a window, in SEAMWISE_CHROMIUM or on the path.
import { existsSync, readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { extname, join } from 'node:path';

// A browser that draws without a graphics processor hangs now and then, for no fault of a page.
const PATIENCE = 120_000; // milliseconds

// What drawing without a graphics processor says of itself.
const KNOWN = /GPU stall|swiftshader/i;

export function findBrowser() {
  if (process.env.SEAMWISE_CHROMIUM) return process.env.SEAMWISE_CHROMIUM;
  const folders = (process.env.PATH ?? '').split(':');
  return folders.map((folder) => join(folder, 'chromium')).find(existsSync);
}

// Starts it; `modules` is the folder with the packages.
export function launch(executablePath, modules) {
  const puppeteer = createRequire(join(modules, 'here.js'))('puppeteer-core');
  const args = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];
  return puppeteer.launch({ executablePath, args, protocolTimeout: PATIENCE });
}

// A new page, and all that it will complain about.
export async function openPage(browser) {
  const page = await browser.newPage();
  const complaints = [];
  page.on('console', (message) => {
    if (['error', 'warn'].includes(message.type()) && !KNOWN.test(message.text())) complaints.push(message.text());
  });
  page.on('pageerror', (error) => complaints.push(String(error)));
  page.on('requestfailed', (request) => complaints.push(`${request.url()} failed`));
  return { page, complaints };
}

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript',
  '.gltf': 'model/gltf+json', '.glb': 'model/gltf-binary', '.wasm': 'application/wasm',
  '.png': 'image/png', '.jpg': 'image/jpeg' };

// Serves folders under their names; a script is found without its ending.
export function serve(roots) {
  const server = createServer((request, response) => {
    const [, root, ...rest] = decodeURIComponent(new URL(request.url, 'http://x').pathname).split('/');
    let path = roots[root] && join(roots[root], ...rest);
    if (path && !extname(path)) path += '.js';
    if (!path || !existsSync(path)) return response.writeHead(404).end();
    response.writeHead(200, { 'content-type': TYPES[extname(path)] ?? 'application/octet-stream' });
    return response.end(readFileSync(path));
  });
  return new Promise((done) => server.listen(0, '127.0.0.1', () => done(server)));
}
