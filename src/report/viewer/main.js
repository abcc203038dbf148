// Starts the view, and says on the page what goes wrong.

const byId = (id) => document.getElementById(`viewer-${id}`);

/** Shows an error on the page. */
function complain(text) {
  const box = byId('errors');
  box.hidden = false;
  const line = document.createElement('p');
  line.textContent = text;
  box.append(line);
}

function findElements() {
  const names = ['models', 'layouts', 'flip', 'stage', 'canvas', 'labels', 'divider', 'loading', 'shading', 'wireframe',
    'distance', 'ticks', 'continuous', 'triangles', 'counts', 'geomorph', 'auto', 'enlarge', 'reset', 'full', 'status', 'legend', 'ramp', 'least', 'middle', 'most', 'notes'];
  const elements = Object.fromEntries(names.map((name) => [name, byId(name)]));
  return { ...elements, viewer: document.getElementById('viewer'), legendTitle: byId('legend-title') };
}

/** Loads the models one after another; what can't be loaded is said and left out. */
async function loadAll(stage, panel, models) {
  const origin = originOf(models[0].file);
  // The two that are seen first, then the rest.
  const first = Math.min(2, models.length - 1);
  const order = [...new Set([0, first, ...models.keys()])];
  for (const at of order) {
    try {
      await loadModel(models[at], stage.renderer, origin);
    } catch (error) {
      complain(`${models[at].name} (${models[at].file.name}) can’t be shown: ${error.message}`);
      if (at === 0) throw new Error('without it there is nothing to compare with', { cause: error });
      continue;
    }
    panel.enable(at);
    if (at === 0) {
      stage.camera = new Camera(models[0].bounds);
      stage.elements.loading.hidden = true;
    }
    if (at === order[1]) panel.select(at);
    stage.draw();
    stage.firstPicture ??= performance.now();
    await new Promise((done) => { setTimeout(done); }); // so that what is there is seen
  }
}

/** Lets the pictures of the page be seen in the view, from where they were drawn. */
function offerViews(stage, panel) {
  document.querySelectorAll('[data-direction]').forEach((button) => {
    button.hidden = false;
    button.addEventListener('click', () => {
      stage.camera.reset();
      stage.camera.lookFrom(normalize(button.dataset.direction.split(' ').map(Number)));
      panel.arrange('all');
      stage.elements.viewer.scrollIntoView();
      stage.elements.canvas.focus({ preventScroll: true });
    });
  });
}

/** Says that the browser took the graphics away, as it does under pressure. */
function watchContext(canvas) {
  canvas.addEventListener('webglcontextlost', () => {
    complain('The browser took the graphics memory away; load the page again.');
  });
}

async function start() {
  const elements = findElements();
  const config = JSON.parse(document.getElementById('viewer-config').textContent);
  config.notes.forEach((text) => elements.notes.append(Object.assign(document.createElement('li'), { textContent: text })));
  watchContext(elements.canvas);
  const stage = new Stage(elements, new Renderer(elements.canvas, config.images, complain));
  stage.models = await readModels(config);
  const panel = new Panel(stage);
  panel.offer(stage.models);
  if (stage.models.length === 1) panel.beAlone();
  // For tests, and for whoever looks with the browser's own tools.
  window.seamwise = { stage, panel };
  await loadAll(stage, panel, stage.models);
  offerViews(stage, panel);
}

addEventListener('error', (event) => complain(`The view failed: ${event.message}`));
window.seamwiseReady = start().catch((error) => {
  byId('loading').hidden = true;
  complain(`The view can’t be shown: ${error.message}.`);
});
