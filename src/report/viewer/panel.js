// Buttons, sliders, labels and words around the canvas.

// The gradients are those of the shaders.
const HEAT = 'linear-gradient(90deg, #000, #f00 33.3%, #ff0 66.7%, #fff)';
const RAMP = 'linear-gradient(90deg, #2b5c8a, #6eb4a4, #f5eab8, #e8853d, #a50f26)';
/** The number of pixels at the far end of the slider of distances. */
const FEWEST_PIXELS = 16;
/** Marks on the slider nearer to each other than this share of it are one. */
const CLOSE = 0.06;

const grouped = (number) => number.toLocaleString('en-US');
const percent = (share) => `${Number((100 * share).toPrecision(3))} %`;

/** A mark under a slider, whose handle stays within it by half of its own width. */
function tick(share, text) {
  const mark = Object.assign(document.createElement('span'), { textContent: text });
  mark.style.left = `calc(${100 * share}% + ${8 - 16 * share}px)`;
  return mark;
}

class Panel {
  constructor(stage) {
    this.stage = stage;
    this.elements = stage.elements;
    this.before = 1;
    stage.onDraw = (drawn) => this.tell(drawn);
    this.listen();
  }

  /** One button per model; those that are not loaded yet can't be pressed. */
  offer(models) {
    this.radios = models.map((model, at) => {
      const label = document.createElement('label');
      const input = Object.assign(document.createElement('input'), { type: 'radio', name: 'viewer-model', value: at, disabled: true });
      const text = document.createElement('span');
      text.append(`${model.name} `, Object.assign(document.createElement('kbd'), { textContent: at + 1 }));
      input.addEventListener('change', () => this.select(at));
      label.append(input, text);
      this.elements.models.append(label);
      return input;
    });
    const option = (value) => this.elements.shading.querySelector(`[value=${value}]`);
    this.reference = models[0].name === 'Source' ? 'the source' : models[0].name;
    option('difference').textContent = `Difference to ${this.reference}`;
    option('difference').disabled = models.length < 2;
    option('distance').disabled = !models.some((model) => model.distances);
    this.elements.continuous.hidden = !this.continuous();
  }

  /** The model that the slider of triangles is for: the chosen one, or the first of a progressive file. */
  continuous() {
    const { models, state: { shown } } = this.stage;
    return models[shown]?.progress ? models[shown] : models.find((model) => model.progress);
  }

  /** A single model needs nothing that compares. */
  beAlone() {
    this.arrange('single');
    for (const element of [this.elements.layouts, this.elements.flip, this.elements.auto.parentElement]) element.hidden = true;
  }

  enable(at) {
    this.radios[at].disabled = false;
  }

  listen() {
    const { stage, elements } = this;
    const on = (element, event, run) => element.addEventListener(event, run);
    on(elements.shading, 'change', () => stage.change({ shading: elements.shading.value }));
    on(elements.wireframe, 'change', () => stage.change({ wireframe: elements.wireframe.checked }));
    on(elements.auto, 'change', () => stage.change({ auto: elements.auto.checked }));
    on(elements.enlarge, 'change', () => stage.change({ enlarge: elements.enlarge.checked }));
    on(elements.flip, 'click', () => this.flip());
    on(elements.reset, 'click', () => this.reset());
    on(elements.full, 'click', () => this.goFull());
    on(elements.layouts, 'change', (event) => this.arrange(event.target.value));
    on(elements.distance, 'input', () => this.goAway(Number(elements.distance.value)));
    on(elements.triangles, 'input', () => this.refine(Number(elements.triangles.value)));
    on(elements.geomorph, 'change', () => this.morph(elements.geomorph.checked));
    listenToPointers(stage);
    listenToDivider(stage);
    listenToKeys(stage, { select: (at) => this.select(at), key: (key) => this.key(key) });
  }

  select(at) {
    if (!this.stage.models[at]?.batches) return;
    if (at > 0) this.before = at;
    this.elements.auto.checked = false;
    this.stage.change({ shown: at, auto: false });
  }

  /** Between the source and the level, in place. */
  flip() {
    if (this.stage.state.layout !== 'single') this.arrange('single');
    else this.select(this.stage.state.shown === 0 ? this.before : 0);
  }

  arrange(layout) {
    this.elements.layouts.querySelector(`[value=${layout}]`).checked = true;
    this.stage.change({ layout });
  }

  reset() {
    this.stage.camera.reset();
    this.stage.change({ split: 0.5 });
  }

  goFull() {
    if (document.fullscreenElement) document.exitFullscreen();
    else this.elements.stage.requestFullscreen?.().catch((error) => complain(`No full screen: ${error.message}`));
  }

  /** What keys of letters do; whether there is one. */
  key(key) {
    const { elements } = this;
    const press = { w: elements.wireframe, l: elements.auto, e: elements.enlarge, f: elements.flip, r: elements.reset };
    if (this.continuous()) press.g = elements.geomorph;
    if (press[key]) press[key].click();
    else if (key === 's') this.nextShading();
    else return false;
    return true;
  }

  nextShading() {
    const options = [...this.elements.shading.options].filter((option) => !option.disabled);
    const at = options.findIndex((option) => option.selected);
    options[(at + 1) % options.length].selected = true;
    this.stage.change({ shading: this.elements.shading.value });
  }

  /** Goes to a place of the slider: 0 is nearest, 1 leaves a few pixels; the level follows. */
  goAway(place) {
    const { camera, models } = this.stage;
    const most = camera.pixels(this.side) * (camera.distance / camera.nearest);
    camera.distance = camera.distanceAt(most * (FEWEST_PIXELS / most) ** place, this.side);
    const isCertified = models.slice(1).some((model) => model.largest !== null);
    this.elements.auto.checked = isCertified || this.elements.auto.checked;
    this.stage.change({ auto: this.elements.auto.checked });
  }

  /** Shows as many triangles of a progressive file as a place of its slider stands for. */
  refine(place) {
    const model = this.continuous();
    model.progress.count = model.progress.countAt(place);
    this.select(this.stage.models.indexOf(model));
  }

  /** Whether triangles of progressive files come and go by a geomorph. */
  morph(isMorphing) {
    this.stage.models.forEach(({ progress }) => { if (progress) progress.isMorphing = isMorphing; });
    this.select(this.stage.models.indexOf(this.continuous()));
  }

  /** Brings all around the canvas to what it shows. */
  tell({ panes, size, pixels, side }) {
    this.side = side;
    const { elements, stage: { state, camera, models } } = this;
    this.radios.forEach((radio, at) => { radio.checked = at === state.shown; });
    if (state.auto && state.shown > 0) this.before = state.shown;
    this.label(panes, size);
    elements.divider.hidden = state.layout !== 'split';
    elements.divider.style.left = `${100 * state.split}%`;
    elements.divider.setAttribute('aria-valuenow', Math.round(100 * state.split));
    const most = pixels * (camera.distance / camera.nearest);
    const place = (count) => Math.log(count / most) / Math.log(FEWEST_PIXELS / most);
    elements.distance.value = Math.max(0, Math.min(1, place(pixels)));
    elements.distance.setAttribute('aria-valuetext', `${Math.round(pixels)} pixels across`);
    this.mark(models, place);
    this.tellProgress();
    elements.status.textContent = this.words(models[state.shown], pixels);
    this.explain();
  }

  tellProgress() {
    const { elements } = this;
    const { progress } = this.continuous() ?? {};
    if (!progress) return;
    elements.triangles.value = progress.placeOf(progress.count);
    elements.triangles.setAttribute('aria-valuetext', `${grouped(progress.count)} triangles`);
    elements.counts.replaceChildren(...[0, 0.25, 0.5, 0.75, 1].map((share) => tick(share, grouped(progress.countAt(share)))));
  }

  label(panes, { width, height }) {
    const { labels, viewer } = this.elements;
    const chosen = panes.length > 2 && this.stage.models[this.stage.state.shown];
    labels.replaceChildren(...panes.map(({ model, rect, clip }) => {
      const label = Object.assign(document.createElement('div'), { className: 'viewer-label' });
      label.textContent = `${model.name}: ${grouped(model.triangles)}`;
      label.style.left = `calc(${(100 * clip[0]) / width}% + 8px)`;
      label.style.top = `calc(${100 - (100 * (rect[1] + rect[3])) / height}% + 8px)`;
      label.style.maxWidth = `calc(${(100 * clip[2]) / width}% - 16px)`;
      label.hidden = clip[2] < 40;
      label.classList.toggle('viewer-chosen', model === chosen);
      return label;
    }));
    viewer.dataset.triangles = panes.map(({ model }) => model.triangles).join(' ');
  }

  /** Marks on the slider where a level takes over; those that would lie on each other as one. */
  mark(models, place) {
    const marks = [];
    models.forEach((model, at) => {
      const share = at > 0 && model.largest > 0 ? place(model.largest) : -1;
      if (!(share >= 0 && share <= 1)) return;
      const last = marks.at(-1);
      if (last && share - last.share < CLOSE) last.text = `${last.text}, ${at}`;
      else marks.push({ share, text: `L${at}` });
    });
    this.elements.ticks.replaceChildren(...marks.map(({ share, text }) => tick(share, text)));
  }

  words(model, pixels) {
    const parts = [`${model.name}: ${grouped(model.triangles)} triangles`];
    if (this.stage.state.shading === 'charts') parts.push(`${grouped(model.charts?.length ?? 0)} charts`);
    if (model.progress) parts.push(this.progressWords(model));
    else if (Number.isFinite(model.largest) && model.largest !== null) {
      parts.push(`may be shown up to ${grouped(Math.floor(model.largest))} pixels across`);
    } else if (model.largest === null) parts.push('without a certificate of the size it may be shown at');
    parts.push(`its diagonal spans ${grouped(Math.round(pixels))} pixels here`);
    return `${parts.join('; ')}.`;
  }

  progressWords({ progress, moment: { share } }) {
    const [from, to] = progress.stops().map((count) => grouped(progress.triangles[progress.timeOf(count)]));
    if (progress.isMorphing) return `${percent(share)} of the way from ${to} to ${from}`;
    return `of ${grouped(progress.coarsest)} to ${grouped(progress.finest)}`;
  }

  /** The legend of colors that stand for numbers. */
  explain() {
    const { elements, stage: { state, models } } = this;
    const distances = models[state.shown].distances ?? models.find((model) => model.distances)?.distances;
    const isDifference = state.shading === 'difference';
    const isDistance = state.shading === 'distance' && distances;
    elements.legend.hidden = !isDifference && !isDistance;
    if (elements.legend.hidden) return;
    elements.legendTitle.textContent = isDifference
      ? 'Difference in sRGB luminance, of black to white'
      : 'From the source’s surface to the level’s, of the diagonal';
    elements.ramp.style.background = isDifference ? HEAT : RAMP;
    const most = isDifference ? 0.125 : distances.most;
    elements.least.textContent = '0';
    // Distances go by their roots, so that small ones are told apart as well.
    elements.middle.textContent = percent(isDifference ? most / 2 : most / 4);
    elements.most.textContent = `≥ ${percent(most)}`;
  }
}
