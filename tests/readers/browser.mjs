// The browser that tests look with: a Chromium without a window, in SEAMWISE_CHROMIUM or on the path.
import { existsSync, readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { extname, join } from 'node:path';

// A browser that draws without a graphics processor hangs now and then, for no fault of a page.
const PATIENCE = 120_000; // milliseconds

// What drawing without a graphics processor says of itself.
const KNOWN = /GPU stall|swiftshader/i;

function findBrowser() {
  if (process.env.SEAMWISE_CHROMIUM) return process.env.SEAMWISE_CHROMIUM;
  const folders = (process.env.PATH ?? '').split(':');
  return folders.map((folder) => join(folder, 'chromium')).find(existsSync);
}

// Starts it; `modules` is the folder with the packages.
function launch(executablePath, modules) {
  const puppeteer = createRequire(join(modules, 'here.js'))('puppeteer-core');
  const args = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];
  return puppeteer.launch({ executablePath, args, protocolTimeout: PATIENCE });
}

// What a test holds, and how much of it failed.
export class Findings {
  failures = 0;

  hold(isTrue, what) {
    if (isTrue) return;
    this.failures += 1;
    console.log(`  FAILED: ${what}`);
  }

  tell() {
    console.log(`${this.failures} failures`);
    process.exitCode = this.failures === 0 ? 0 : 1;
  }
}

// Lets a test look at one thing after the other: `test(look)`, where `look(work)` gives `work` a browser,
// and once more another if that hung. Says so and skips without a browser.
export async function withBrowser(modules, test) {
  const executablePath = findBrowser();
  if (!executablePath) return console.log('skipped: no chromium, so nobody looks at it in a browser');
  let browser = await launch(executablePath, modules);
  const look = async (work) => {
    try {
      return await work(browser);
    } catch (error) {
      if (error.name !== 'ProtocolError') throw error;
      console.log(`  ${error.message}; once more in a new browser`);
      browser.process()?.kill('SIGKILL');
      browser = await launch(executablePath, modules);
      return work(browser);
    }
  };
  await test(look);
  return browser.close();
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

// Serves folders under their names; a script is found without its ending. Its address, and its end.
export async function serve(roots) {
  const server = createServer((request, response) => {
    const [, root, ...rest] = decodeURIComponent(new URL(request.url, 'http://x').pathname).split('/');
    let path = roots[root] && join(roots[root], ...rest);
    if (path && !extname(path)) path += '.js';
    if (!path || !existsSync(path)) return response.writeHead(404).end();
    response.writeHead(200, { 'content-type': TYPES[extname(path)] ?? 'application/octet-stream' });
    return response.end(readFileSync(path));
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  return { address: `http://127.0.0.1:${server.address().port}`, close: () => server.close() };
}
