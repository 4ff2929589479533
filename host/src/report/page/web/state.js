// The page's contents, and what the reader has chosen: axis, record, before or after, a region, a stretch of cycles.

let contents = null;
const chosen = { axis: 0, record: 0, version: 0, from: 0, moved: 1, region: null, cycle: 0, cycles: 3, candidate: 0 };
const listeners = [];

/** Calls `draw` now and whenever one of these choices changes. */
function follow(choices, draw) {
  listeners.push({ choices, draw });
}

/** Changes what is chosen and redraws what depends on it. */
function choose(change) {
  Object.assign(chosen, change);
  const names = Object.keys(change);
  for (const { choices, draw, step } of listeners) {
    if (choices.some((c) => names.includes(c)) && !(step && names.includes("version"))) draw();
  }
}

/** Calls `draw` for every step of the plots from one version to the other; a change of version draws by itself. */
function followMove(draw) {
  listeners.push({ choices: ["moved"], draw, step: true });
}

/** Redraws everything: the theme or the width has changed. */
function redraw() {
  for (const { draw, step } of listeners) if (!step) draw();
}

/** A packed series as numbers. */
function unpack(packed) {
  if (!packed) return null;
  const bytes = Uint8Array.from(atob(packed.data), (c) => c.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  const values = new Float64Array(bytes.length / 2);
  for (let i = 0; i < values.length; i += 1) {
    const count = view.getInt16(2 * i, true);
    values[i] = count === -32768 ? NaN : packed.middle + packed.step * count;
  }
  return values;
}

const unpacked = new Map();

/** Takes contents to draw; axis, record and cycles stay as they were where these contents have them. */
function openContents(from) {
  const record = contents && from.records.findIndex((r) => r.file === contents.records[chosen.record].file);
  const fresh = contents === null || record < 0;
  contents = from;
  unpacked.clear();
  listeners.length = 0;
  const version = contents.versions.length - 1;
  Object.assign(chosen, { version, from: version, moved: 1, region: null, candidate: 0 });
  if (chosen.axis >= contents.axes.length) chosen.axis = 0;
  chosen.record = fresh ? Math.max(0, contents.records.findIndex((r) => r.role === "validate" && !r.axes[chosen.axis].rests)) : record;
}

/** What the chosen version has, or what lies between it and the other one while the plots move. */
function onItsWay(of) {
  const to = of(chosen.version);
  if (chosen.moved >= 1) return to;
  const from = of(chosen.from);
  if (!from || !to || from.length !== to.length) return to;
  return to.map((value, i) => (value === null || from[i] === null ? value : from[i] + chosen.moved * (value - from[i])));
}

/** One axis of one record: its series, SI. */
function samples(record, axis) {
  const key = `${record}/${axis}`;
  if (!unpacked.has(key)) {
    const from = contents.records[record].axes[axis];
    const versions = from.versions.map((version) => {
      const measured = unpack(version.measured);
      const residual = unpack(version.residual);
      return { measured, residual, predicted: measured.map((m, i) => m - residual[i]) };
    });
    unpacked.set(key, {
      time: unpack(contents.records[record].time),
      displacement: unpack(from.displacement),
      velocity: unpack(from.velocity),
      versions,
      candidates: from.candidates.map(unpack),
    });
  }
  return unpacked.get(key);
}

/** What a plot over the record has below it. */
function alongLabel() {
  return contents.timed ? "time (s)" : "row";
}

/** The states that forces are drawn over: without time there is no velocity. */
function drawnStates() {
  return contents.timed ? ["displacement", "velocity"] : ["displacement"];
}

/** The records that errors are judged on and in which the chosen axis moves. */
function judgedRecords() {
  const validates = contents.records.some((r) => r.role === "validate");
  const role = validates ? "validate" : "train";
  return contents.records.map((r, i) => i)
    .filter((i) => contents.records[i].role === role && !contents.records[i].axes[chosen.axis].rests);
}

/** Which samples of a record lie in the chosen region; none when no region is chosen or it is a band of frequencies. */
function inRegion(record) {
  const region = contents.regions[chosen.region];
  if (!region || region.band_hz) return null;
  const time = samples(record, 0).time;
  const inside = new Uint8Array(time.length);
  if (region.stretch) {
    const [where, from, to] = region.stretch;
    if (where === record) time.forEach((t, i) => { inside[i] = t >= from && t <= to ? 1 : 0; });
    return inside;
  }
  const conditions = region.conditions.map((c) => {
    const axis = samples(record, c.state >> 1);
    return { ...c, series: c.state % 2 ? axis.velocity : axis.displacement };
  });
  for (let i = 0; i < inside.length; i += 1) {
    inside[i] = conditions.every((c) => {
      const value = c.magnitude ? Math.abs(c.series[i]) : c.series[i];
      return (c.above === null || value > c.above) && (c.below === null || value < c.below);
    }) ? 1 : 0;
  }
  return inside;
}

/** Seconds since the velocity last changed sign, sample by sample. */
function sinceReversal(time, velocity) {
  const limit = 0.1 * Math.sqrt(velocity.reduce((s, v) => s + v * v, 0) / velocity.length);
  const since = new Float64Array(time.length).fill(NaN);
  let side = 0;
  let crossing = -1;
  let reversal = -1;
  for (let i = 0; i < time.length; i += 1) {
    if (i > 0 && velocity[i] > 0 !== velocity[i - 1] > 0) crossing = i;
    if (Math.abs(velocity[i]) > limit && Math.sign(velocity[i]) !== side) {
      if (side !== 0 && crossing >= 0) {
        reversal = crossing;
        for (let late = crossing; late < i; late += 1) since[late] = time[late] - time[crossing];
      }
      side = Math.sign(velocity[i]);
    }
    if (reversal >= 0) since[i] = time[i] - time[reversal];
  }
  return since;
}

/** Where the cycles of a record begin: samples at which the displacement rises through its mean. */
function cycleStarts(record, axis) {
  const { displacement } = samples(record, axis);
  const mean = displacement.reduce((s, x) => s + x, 0) / displacement.length;
  const band = 0.15 * Math.sqrt(displacement.reduce((s, x) => s + (x - mean) ** 2, 0) / displacement.length);
  const starts = [];
  let below = false;
  for (let i = 0; i < displacement.length; i += 1) {
    const x = displacement[i] - mean;
    if (x < -band) below = true;
    if (below && x > 0) {
      starts.push(i);
      below = false;
    }
  }
  return starts;
}

/** First and last sample of the chosen cycles. */
function chosenSamples() {
  const starts = cycleStarts(chosen.record, chosen.axis);
  const last = samples(chosen.record, chosen.axis).time.length - 1;
  if (starts.length < 2) return [0, last];
  const first = Math.min(chosen.cycle, starts.length - 2);
  const end = Math.min(first + chosen.cycles, starts.length - 1);
  return [starts[first], starts[end]];
}
