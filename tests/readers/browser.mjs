// The browser that tests look with: a Chromium without a window, in SEAMWISE_CHROMIUM or on the path.
import { existsSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';

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
