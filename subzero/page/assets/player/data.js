// The runs of the page as functions of time. `subzero/page/replay.py` says how they are stored.

const MISSING = -32768, LOWEST = 32767;

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
}

/** A stored series as numbers; NaN where there is none. */
export function unpacked(series) {
  if (series.doubles !== undefined) return new Float64Array(bytesOf(series.doubles).buffer);
  const values = new Float64Array(series.n).fill(series.low ?? NaN);
  if (series.data === undefined) return values;
  const codes = new DataView(bytesOf(series.data).buffer);
  for (let i = 0; i < series.n; i++) {
    const code = codes.getInt16(2 * i, true);
    values[i] = code === MISSING ? NaN : series.low + series.step * (code + LOWEST);
  }
  return values;
}

/** Where a time lies among rising times: the sample before it, and the share of the way to the next. */
export function placeIn(times, t) {
  const last = times.length - 1;
  if (last <= 0 || !(t > times[0])) return [0, 0];
  if (t >= times[last]) return [last - 1, 1];
  let low = 0, high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle;
  }
  return [low, (t - times[low]) / (times[high] - times[low])];
}

function between(values, [before, share]) {
  const a = values[before], b = values[Math.min(before + 1, values.length - 1)];
  if (share === 0) return a;
  return share === 1 ? b : a + (b - a) * share;
}

/** Channels over time; one that is asked for is unpacked once. */
class Channels {
  constructor(stored) {
    this.time = unpacked(stored.time);
    this.stored = stored.channels;
    this.known = new Map();
  }

  has(name) {
    return name in this.stored;
  }

  /** All samples of a channel. */
  values(name) {
    if (!this.known.has(name)) this.known.set(name, unpacked(this.stored[name]));
    return this.known.get(name);
  }

  /** A channel at a time, between its samples linearly. */
  at(name, t) {
    return between(this.values(name), placeIn(this.time, t));
  }
}

/** A vehicle with its cable. */
export class Actor extends Channels {
  constructor(stored) {
    super(stored);
    this.name = stored.name;
    this.isGhost = stored.ghost;
    this.turns = unpacked(stored.turns);
    this.cable = stored.cable ? new Cable(stored.cable) : null;
    this.end = this.time[this.time.length - 1];
  }

  place(t) {
    return ["north", "east", "depth"].map((name) => this.at(name, t));
  }

  /** Roll, pitch and heading. [degree] */
  attitude(t) {
    return ["roll_angle", "pitch", "heading"].map((name) => this.at(name, t));
  }

  /** How often the propeller has turned since the start. */
  propellerTurns(t) {
    return between(this.turns, placeIn(this.time, t));
  }
}

/** The shapes of a cable: for each time the places and tensions of its points, from the vehicle to the drum. */
class Cable {
  constructor(stored) {
    this.time = unpacked(stored.time);
    this.points = stored.points;
    this.columns = ["north", "east", "down", "tension"].map((name) => unpacked(stored[name]));
    this.highest = this.columns[3].reduce((most, value) => (value > most ? value : most), 0);
  }

  /** Fill `out` with [north, east, down, tension] of every point; returns whether there is a cable at this time. */
  fill(t, out) {
    const [before, share] = placeIn(this.time, t);
    const first = before * this.points, second = Math.min(before + 1, this.time.length - 1) * this.points;
    for (let axis = 0; axis < 4; axis++) {
      const values = this.columns[axis];
      for (let i = 0; i < this.points; i++) {
        const a = values[first + i], b = values[second + i];
        out[4 * i + axis] = share === 0 ? a : share === 1 ? b : a + (b - a) * share;
      }
    }
    return Number.isFinite(out[0]);
  }

  /** Where the cable comes off the drum. */
  drum(t) {
    const at = new Float32Array(4 * this.points), last = 4 * (this.points - 1);
    return this.fill(t, at) ? [at[last], at[last + 1], at[last + 2]] : null;
  }
}

/** All that a page shows: `actors`, what was `measured`, the table of `channels`, the last time. */
export function readReplay(stored) {
  const actors = stored.actors.map((one) => new Actor(one));
  return {
    ...stored,
    actors,
    measured: stored.measured ? new Channels(stored.measured) : null,
    end: Math.max(...actors.map((actor) => actor.end)),
    highestTension: Math.max(0, ...actors.map((actor) => actor.cable?.highest ?? 0)),
    extent: extentOf(actors),
  };
}

/** The box that holds all tracks and cables: [lowest, highest] corner. */
function extentOf(actors) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const include = (axis, values) => {
    for (const value of values) {
      if (value < low[axis]) low[axis] = value;
      if (value > high[axis]) high[axis] = value;
    }
  };
  for (const actor of actors) {
    ["north", "east", "depth"].forEach((name, axis) => include(axis, actor.values(name)));
    if (actor.cable) [0, 1, 2].forEach((axis) => include(axis, actor.cable.columns[axis]));
  }
  return [low, high];
}

/** A round number, 1, 2 or 5 times a power of ten, not above `value`. */
export function roundNumber(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [5, 2, 1].find((step) => step * power <= value * 1.0001);
}
