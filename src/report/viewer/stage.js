// What is in the canvas: which models, in which parts of it, from where.

class Stage {
  constructor(elements, renderer) {
    Object.assign(this, { elements, renderer, models: [], camera: null, onDraw: () => {} });
    this.state = { shown: 0, layout: 'split', shading: 'lit', wireframe: false, split: 0.5, auto: false, enlarge: false };
    this.isDue = false;
    new ResizeObserver(() => this.redraw()).observe(elements.stage);
    // A canvas keeps its picture only until it was shown.
    addEventListener('beforeprint', () => { if (this.camera) this.draw(); });
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.redraw());
  }

  /** Changes some of the state, and draws it. */
  change(values) {
    Object.assign(this.state, values);
    this.redraw();
  }

  redraw() {
    if (this.isDue || !this.camera) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      this.draw();
    });
  }

  /** The canvas in pixels of the screen. */
  measure() {
    const { canvas } = this.elements;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side * ratio)));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    return { width, height, ratio };
  }

  draw() {
    this.models.filter((model) => model.progress && model.batches).forEach((model) => updateModel(model, this.renderer));
    const size = this.measure();
    const panes = this.panes(size);
    const [{ rect: [, , width, height] }] = panes;
    const side = Math.min(width, height);
    if (this.state.auto) this.state.shown = this.levelAt(this.camera.pixels(side));
    this.renderer.background = this.background();
    this.renderer.clear(this.renderer.background);
    const shares = this.enlargement();
    this.renderer.targets.resize(...[width, height].map((pixels) => Math.max(1, Math.round(pixels * shares))));
    for (const pane of this.panes(size)) this.drawPane(pane, width / height);
    this.onDraw({ panes: this.panes(size), size, pixels: this.camera.pixels(side), side });
  }

  /** The level for a size, or the finest loaded one before it. */
  levelAt(pixels) {
    let level = selectLevel(this.models, pixels);
    while (level > 0 && !this.models[level].batches) level -= 1;
    return level;
  }

  drawPane({ model, rect, clip, isReference }, aspect) {
    const { shading, wireframe } = this.state;
    const view = this.view(aspect);
    const reference = this.models[0];
    if (shading === 'charts') numberCharts(model, reference);
    // Of a picture of which only a part is shown, only that is drawn.
    const [from, share] = [(clip[0] - rect[0]) / rect[2], clip[2] / rect[2]];
    const part = [from, Math.min(1, from + share)];
    if (shading === 'difference') {
      const look = { shading: 'lit', wireframe: false };
      const own = this.renderer.draw(model, view, look, 0, part);
      const other = isReference ? null : this.renderer.draw(reference, view, look, 1, part);
      return this.renderer.show(own, other, rect, clip);
    }
    const distances = shading === 'distance' && !isReference ? model.distances : null;
    const look = { shading: shading === 'distance' && !distances ? 'smooth' : shading, wireframe, distances };
    // The source is the finer surface of the two: it shows best where the level is away from it.
    return this.renderer.show(this.renderer.draw(distances ? reference : model, view, look, 0, part), null, rect, clip);
  }

  /** The camera's view; of what is enlarged, from where it fills the frame. */
  view(aspect) {
    const { camera } = this;
    const distance = camera.distance;
    camera.distance *= this.enlargement();
    const view = camera.view(aspect);
    camera.distance = distance;
    return view;
  }

  /** The share of the pixels that a picture is drawn with, if what is far is enlarged. */
  enlargement() {
    if (!this.state.enlarge || this.camera.distance <= this.camera.fitting) return 1;
    return this.camera.fitting / this.camera.distance;
  }

  background() {
    const match = getComputedStyle(this.elements.stage).backgroundColor.match(/[\d.]+/g) ?? [128, 128, 128];
    // On paper it has none.
    if (Number(match[3]) === 0) return [1, 1, 1];
    return match.slice(0, 3).map((part) => Number(part) / 255);
  }

  /** The parts of the canvas with their models; rows from below, as WebGL counts them. */
  panes({ width, height }) {
    const { layout, shown, split } = this.state;
    const whole = [0, 0, width, height];
    const chosen = this.models[shown];
    // Before the first level is there, the source is all that can be seen.
    if (layout === 'single' || !chosen.batches || this.models.length === 1) {
      return [this.pane(chosen.batches ? chosen : this.models[0], whole, whole)];
    }
    if (layout === 'split') {
      const left = Math.round(width * split);
      return [
        this.pane(this.models[0], whole, [0, 0, left, height]),
        this.pane(chosen, whole, [left, 0, width - left, height]),
      ];
    }
    const loaded = this.models.filter((model) => model.batches);
    const { columns, rows } = grid(loaded.length, width / height);
    const [w, h] = [Math.floor(width / columns), Math.floor(height / rows)];
    return loaded.map((model, at) => {
      const rect = [w * (at % columns), height - h * (1 + Math.floor(at / columns)), w, h];
      return this.pane(model, rect, rect);
    });
  }

  pane(model, rect, clip) {
    return { model, rect, clip, isReference: model === this.models[0] };
  }

  /** The pixels of a model from a camera of the tool's renderer: for tests. */
  pixels(index, from, side, shading = 'lit') {
    const model = this.models[index];
    this.renderer.background = [0.5, 0.5, 0.5];
    const view = Camera.viewFrom(from, this.models[0].bounds);
    const pixels = this.renderer.pixels(model, view, { shading, wireframe: false }, side);
    this.redraw();
    return pixels;
  }
}

/** Columns and rows for so many pictures, such that their shorter sides are longest. */
function grid(count, aspect) {
  let best = { columns: 1, rows: 1, side: 0 };
  for (let columns = 1; columns <= count; columns += 1) {
    const rows = Math.ceil(count / columns);
    const side = Math.min(aspect / columns, 1 / rows);
    if (side > best.side) best = { columns, rows, side };
  }
  return best;
}
