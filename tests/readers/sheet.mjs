// Sheets of pictures that `seamwise evaluate` draws: what they show, from where, and where in them.
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';

const GAP = 4; // pixels between pictures
// Pixels above a picture, for its name: letters of 8 by 8 dots.
const head = (side) => 6 + 8 * Math.max(1, Math.floor(side / 256));

// Draws a file beside itself with more options: the sheet as a data URL, the views' cameras, and where the
// picture of each view begins in the first column. Below each view is a row of differences.
export function drawSheet(tool, folder, file, { views, side, options = [] }) {
  const [sheet, report] = ['sheet.png', 'report.json'].map((name) => join(folder, name));
  execFileSync(tool, ['--quiet', 'evaluate', file, file, ...options, '--samples', '1000', '--views', views,
    '--resolution', side, '--sheet', sheet, '--sheet-views', views, '--json', report],
  { stdio: ['ignore', 'ignore', 'inherit'] });
  const cameras = JSON.parse(readFileSync(report)).views;
  const places = cameras.map((_, view) => [GAP, GAP + head(side) + 2 * view * (side + GAP + head(side))]);
  return { url: `data:image/png;base64,${readFileSync(sheet).toString('base64')}`, cameras, places };
}
