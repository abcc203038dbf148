// Pictures of the interactive view beside those that `seamwise evaluate` draws.
import { drawSheet } from './sheet.mjs';

const VIEWS = 3;
const SIDE = 512; // pixels

// What `seamwise evaluate` draws of a file, and from where.
export function reference(tool, scratch, file) {
  const sheet = drawSheet(tool, scratch, file, { views: VIEWS, side: SIDE });
  const cameras = sheet.cameras.map(({ eye, target, field_of_view_degrees: degrees }) => (
    { eye, target, halfWidth: Math.tan((degrees * Math.PI) / 360) }));
  return { sheet, cameras };
}

// Mean absolute differences of the view's pictures of a model to those in the first column of a sheet.
export function differences(page, index, { cameras, sheet }) {
  return page.evaluate(async (index, cameras, { url, places }, side) => {
    const image = await createImageBitmap(await (await fetch(url)).blob());
    return cameras.map((camera, view) => {
      const context = new OffscreenCanvas(side, side).getContext('2d');
      context.drawImage(image, ...places[view], side, side, 0, 0, side, side);
      const other = context.getImageData(0, 0, side, side).data;
      const own = window.seamwise.stage.pixels(index, camera, side);
      let [sum, covered] = [0, 0];
      for (let y = 0; y < side; y += 1) {
        for (let x = 0; x < side; x += 1) {
          const [a, b] = [4 * ((side - 1 - y) * side + x), 4 * (y * side + x)];
          // Both draw on the same gray.
          const parts = [0, 1, 2].map((k) => [own[a + k], other[b + k]]);
          if (parts.every(([mine, theirs]) => Math.abs(mine - 128) < 2 && theirs === 128)) continue;
          covered += 1;
          sum += parts.reduce((all, [mine, theirs]) => all + Math.abs(mine - theirs), 0) / 3 / 255;
        }
      }
      return sum / covered;
    });
  }, index, cameras, sheet, SIDE);
}

// Waits until the page has drawn what it was told to.
export const settle = (page) => page.evaluate(() => new Promise((done) => {
  requestAnimationFrame(() => requestAnimationFrame(done));
}));
