// Where a model stands on the way from the coarsest level of a progressive file to its source.

/** Triangles grow by this factor from one stop of a geomorph to the next. */
const STOP = Math.SQRT2;

class Progress {
  /** From the number of triangles at each time. */
  constructor(triangles) {
    this.triangles = triangles;
    this.count = this.coarsest;
    this.isMorphing = false;
  }

  get coarsest() {
    return Math.max(1, this.triangles[0]);
  }

  get finest() {
    return Math.max(this.coarsest, this.triangles.at(-1));
  }

  /** The last time with at most so many triangles; the first, if there is none. */
  timeOf(count) {
    return Math.max(1, countUpTo(this.triangles, count)) - 1;
  }

  /** The triangles at a place of a slider: 0 is the coarsest level, 1 the source; they grow by equal factors. */
  countAt(place) {
    return Math.round(this.coarsest * (this.finest / this.coarsest) ** place);
  }

  placeOf(count) {
    if (this.finest === this.coarsest) return 0;
    return Math.log(count / this.coarsest) / Math.log(this.finest / this.coarsest);
  }

  /** The stops around the count; the source is one. */
  stops() {
    const last = Math.ceil(Math.log(this.finest / this.coarsest) / Math.log(STOP) - 1e-9);
    const stop = (at) => Math.min(this.finest, this.coarsest * STOP ** at);
    const at = Math.min(Math.max(0, last - 1), Math.floor(Math.log(this.count / this.coarsest) / Math.log(STOP)));
    return [stop(at), stop(at + 1)];
  }

  /** What is to be drawn. */
  moment() {
    if (!this.isMorphing) return { time: this.timeOf(this.count), coarse: this.timeOf(this.count), share: 0 };
    const [from, to] = this.stops();
    const share = to > from ? Math.log(to / this.count) / Math.log(to / from) : 0;
    return { time: this.timeOf(to), coarse: this.timeOf(from), share: Math.min(1, Math.max(0, share)) };
  }
}

/** Brings a model to the moment that it is to be at. */
function updateModel(model, renderer) {
  const moment = model.progress.moment();
  if (['time', 'coarse', 'share'].every((key) => moment[key] === model.moment[key])) return;
  const scene = flattenScene(model.file, model.level, model.origin, moment);
  renderer.refill(model, scene);
  Object.assign(model, { moment, triangles: scene.triangles, charts: null });
}
