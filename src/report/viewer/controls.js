// Mouse, touch and keys.

const TURN = 0.008; // radians a pixel
const STEP = 0.12; // radians a key
const WHEEL = 0.0015; // of the logarithm of the distance, a pixel of the wheel

/** Lets pointers on the canvas turn, move and zoom. */
function listenToPointers(stage) {
  const { canvas } = stage.elements;
  const pointers = new Map();
  const middle = () => {
    const all = [...pointers.values()];
    return { x: all.reduce((sum, p) => sum + p.x, 0) / all.length, y: all.reduce((sum, p) => sum + p.y, 0) / all.length };
  };
  const spread = () => {
    const [a, b] = pointers.values();
    return b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  };
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.focus({ preventScroll: true });
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!pointers.has(event.pointerId) || !stage.camera) return;
    const [from, wide] = [middle(), spread()];
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const [right, down] = [middle().x - from.x, middle().y - from.y];
    const isMove = pointers.size > 1 || event.shiftKey || (event.buttons & 6) !== 0;
    const side = Math.min(canvas.clientWidth, canvas.clientHeight);
    if (isMove) stage.camera.pan(right / side, down / side);
    else stage.camera.orbit(-right * TURN, down * TURN);
    if (wide > 0 && spread() > 0) stage.camera.zoom(wide / spread());
    stage.redraw();
  });
  for (const end of ['pointerup', 'pointercancel']) {
    canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === 1 ? 16 : 1);
    stage.camera?.zoom(Math.exp(pixels * WHEEL));
    stage.redraw();
  }, { passive: false });
}

/** Lets the divider of a split picture be dragged, and moved by keys. */
function listenToDivider(stage) {
  const { divider, stage: box } = stage.elements;
  const move = (share) => stage.change({ split: Math.max(0, Math.min(1, share)) });
  divider.addEventListener('pointerdown', (event) => divider.setPointerCapture(event.pointerId));
  divider.addEventListener('pointermove', (event) => {
    if (!divider.hasPointerCapture(event.pointerId)) return;
    const { left, width } = box.getBoundingClientRect();
    move((event.clientX - left) / width);
  });
  const ways = { ArrowLeft: -0.02, ArrowRight: 0.02, PageDown: -0.1, PageUp: 0.1, Home: -1, End: 1 };
  divider.addEventListener('keydown', (event) => {
    if (!(event.key in ways)) return;
    event.preventDefault();
    event.stopPropagation();
    move(stage.state.split + ways[event.key]);
  });
}

/** Keys while something in the view has the focus, or nothing in the page has. */
function listenToKeys(stage, actions) {
  const turns = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };
  const zooms = { '+': 0.85, '=': 0.85, '-': 1 / 0.85, '_': 1 / 0.85 };
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !stage.camera) return;
    const { activeElement: focused } = document;
    const isOurs = focused === document.body || stage.elements.viewer.contains(focused);
    const isTyping = focused.matches?.('select, input:not([type=checkbox], [type=radio], [type=range])');
    if (!isOurs || isTyping) return;
    const onCanvas = focused === stage.elements.canvas;
    if (onCanvas && event.key in turns) stage.camera.orbit(...turns[event.key]);
    else if (event.key in zooms) stage.camera.zoom(zooms[event.key]);
    else if (/^[1-9]$/.test(event.key)) actions.select(Number(event.key) - 1);
    else if (!actions.key(event.key.toLowerCase())) return;
    event.preventDefault();
    stage.redraw();
  });
}
