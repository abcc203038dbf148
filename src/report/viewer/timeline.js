// A primitive over time, as a progressive file has it: time is the number of splits done, and any level is
// looked up at once, corner by corner.

const TIMELINE = 'SEAMWISE_timeline';
const NO_WEDGE = 0xffffffff;
const TABLES = ['births', 'cornerStarts', 'cornerTimes', 'cornerWedges', 'valueStarts', 'valueTimes', 'parents', 'places',
  'shareTimes', 'shares'];

/** Per primitive of a document: its levels. */
const timelines = new WeakMap();

/** All levels of a primitive, read once; none if it has one only. */
function timelineOf(file, primitive) {
  const told = primitive.extensions?.[TIMELINE];
  if (!told) return null;
  if (!timelines.has(primitive)) timelines.set(primitive, new Timeline(file, told));
  return timelines.get(primitive);
}

/** How many sorted numbers from one place to another are at most a number. */
function countUpTo(sorted, most, from = 0, to = sorted.length) {
  let [low, high] = [from, to];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= most) low = middle + 1;
    else high = middle;
  }
  return low - from;
}

class Timeline {
  constructor(file, told) {
    for (const name of TABLES) this[name] = readAccessor(file, told[name]).values;
    const read = (index) => (index === undefined ? null : readAccessor(file, index));
    this.attributes = Object.entries(CORNER).filter(([, { name }]) => told.values[name] !== undefined)
      .map(([key, { name, size }]) => ({ key, size, ...read(told.values[name]), ends: read(told.ends[name])?.values }));
  }

  /**
   * The corners of a moment: of the level of a `time`, moved by a `share` to where they come to lie at an
   * earlier one, `coarse`.
   */
  corners({ time, coarse = time, share = 0 }) {
    const order = new Uint32Array(3 * countUpTo(this.births, time));
    for (let corner = 0; corner < order.length; corner += 1) order[corner] = this.wedgeAt(corner, time);
    const fine = order.map((wedge) => this.valueAt(wedge, time));
    const corners = Object.fromEntries(this.attributes.map((own) => [own.key, this.pick(own, fine, time)]));
    if (share > 0) this.blend(corners, { order, fine, coarse, share });
    return { corners, order, vertices: this.parents.length };
  }

  blend(corners, { order, fine, coarse, share }) {
    const [places, rows] = [fine.slice(), fine.slice()];
    order.forEach((wedge, corner) => {
      const isThere = this.births[Math.floor(corner / 3)] <= coarse;
      const own = isThere ? this.wedgeAt(corner, coarse) : wedge;
      const [place, parent] = [this.follow(own, this.places, coarse), this.follow(own, this.parents, coarse)];
      // What comes from nowhere stands where it will be.
      if (place !== NO_WEDGE) places[corner] = this.valueAt(place, coarse);
      if (parent !== NO_WEDGE) rows[corner] = this.valueAt(parent, coarse);
    });
    for (const own of this.attributes) {
      const ends = this.pick(own, own.key === 'position' ? places : rows, coarse);
      const values = corners[own.key];
      // The fourth of a tangent is a side, and has no middle.
      const isSide = (at) => own.key === 'tangent' && at % 4 === 3;
      for (let at = 0; at < values.length; at += 1) {
        if (!isSide(at)) values[at] += share * (ends[at] - values[at]);
      }
    }
  }

  /** The wedge of a corner of a triangle that is there. */
  wedgeAt(corner, time) {
    const [from, to] = [this.cornerStarts[corner], this.cornerStarts[corner + 1]];
    return this.cornerWedges[from + countUpTo(this.cornerTimes, time, from, to) - 1];
  }

  /** The place in the lists of values of a wedge at a time; its first before it comes. */
  valueAt(wedge, time) {
    const [from, to] = [this.valueStarts[wedge], this.valueStarts[wedge + 1]];
    return from + Math.max(1, countUpTo(this.valueTimes, time, from, to)) - 1;
  }

  /** The wedge at a time that one comes from. */
  follow(wedge, before, time) {
    let own = wedge;
    while (own !== NO_WEDGE && this.valueTimes[this.valueStarts[own]] > time) own = before[own];
    return own;
  }

  /** The values of an attribute at places in the lists, as they are shown at a time. */
  pick({ key, size, values, components, ends }, places, time) {
    const share = ends ? this.shares[countUpTo(this.shareTimes, time) - 1] ?? 0 : 0;
    const picked = new Float32Array(places.length * size);
    if (components < size) picked.fill(1); // the alpha of a color of three parts
    for (let corner = 0; corner < places.length; corner += 1) {
      for (let k = 0; k < Math.min(size, components); k += 1) {
        const at = places[corner] * components + k;
        picked[corner * size + k] = share > 0 ? values[at] + share * (ends[at] - values[at]) : values[at];
      }
    }
    return key === 'normal' ? unitRows(picked, 3) : picked;
  }
}
