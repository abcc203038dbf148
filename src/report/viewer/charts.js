// Charts: connected parts of a surface in its image, numbered alike in a source and its levels.

/** How far the middle of a chart may move from level to level and count as the same, of the image. */
const SAME_CHART = 0.02;

/**
 * Gives each corner of a model the number of its chart, once. A chart that lies where one of the
 * reference's does, and has its material, gets the number of that, so that colors can be compared.
 */
function numberCharts(model, reference) {
  if (!model.batches || model.charts) return;
  if (model !== reference) numberCharts(reference, reference);
  const free = model === reference ? [] : [...reference.charts];
  let next = reference.charts?.length ?? 0;
  model.charts = [];
  for (const batch of model.batches) {
    const roots = findCharts(batch.corners, batch.triangles);
    const numbers = new Map();
    for (const [root, middle] of middlesOf(batch.corners.uv, roots)) {
      const own = { material: batch.material.index, middle };
      const at = nearest(free, own);
      own.number = at < 0 ? next : free.splice(at, 1)[0].number;
      if (at < 0) next += 1;
      numbers.set(root, own.number);
      model.charts.push(own);
    }
    const number = (_, corner) => numbers.get(roots[Math.floor(corner / 3)]);
    batch.corners.charts = Float32Array.from({ length: 3 * batch.triangles }, number);
  }
}

/** The place in a list of the chart that is nearest to one, if it may be the same. */
function nearest(charts, { material, middle }) {
  let [best, least] = [-1, SAME_CHART];
  charts.forEach((chart, at) => {
    const away = Math.hypot(chart.middle[0] - middle[0], chart.middle[1] - middle[1]);
    if (chart.material === material && away < least) [best, least] = [at, away];
  });
  return best;
}

/** The middles of the boxes around charts, by their roots. */
function middlesOf(uv, roots) {
  const boxes = new Map();
  roots.forEach((root, triangle) => {
    if (!boxes.has(root)) boxes.set(root, [Infinity, Infinity, -Infinity, -Infinity]);
    const box = boxes.get(root);
    for (let corner = 3 * triangle; uv && corner < 3 * triangle + 3; corner += 1) {
      for (let k = 0; k < 2; k += 1) {
        box[k] = Math.min(box[k], uv[2 * corner + k]);
        box[2 + k] = Math.max(box[2 + k], uv[2 * corner + k]);
      }
    }
  });
  return new Map([...boxes].map(([root, [left, top, right, bottom]]) => [
    root, uv ? [(left + right) / 2, (top + bottom) / 2] : [0, 0]]));
}

/** The chart of each triangle: those that meet in an edge, in space and in the image, are in one. */
function findCharts({ position, uv }, triangles) {
  const chart = Uint32Array.from({ length: triangles }, (_, triangle) => triangle);
  if (!uv) return chart.fill(0);
  const rootOf = (triangle) => {
    let root = triangle;
    while (chart[root] !== root) {
      chart[root] = chart[chart[root]];
      root = chart[root];
    }
    return root;
  };
  const corners = sameCorners(position, uv);
  const edges = new Map();
  for (let corner = 0; corner < corners.length; corner += 1) {
    const next = corner % 3 === 2 ? corner - 2 : corner + 1;
    const [a, b] = [corners[corner], corners[next]];
    const key = Math.min(a, b) * corners.length + Math.max(a, b);
    const triangle = Math.floor(corner / 3);
    if (edges.has(key)) chart[rootOf(triangle)] = rootOf(edges.get(key));
    else edges.set(key, triangle);
  }
  return chart.map((_, triangle) => rootOf(triangle));
}

/** One number per corner, equal for those at one place with one UV. */
function sameCorners(position, uv) {
  const known = new Map();
  const bits = [position, uv].map((values) => new Uint32Array(values.buffer, values.byteOffset, values.length));
  return Uint32Array.from({ length: position.length / 3 }, (_, corner) => {
    const key = `${bits[0].subarray(3 * corner, 3 * corner + 3)},${bits[1].subarray(2 * corner, 2 * corner + 2)}`;
    if (!known.has(key)) known.set(key, corner);
    return known.get(key);
  });
}
