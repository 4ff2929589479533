// What is left: the residual over velocity, displacement and time since reversal; its spectrum; its correlations. Without time the
// displacement alone.

function drawResidual() {
  const body = section("residual", "What the residual depends on",
    "Line: mean of every bin. Band: the middle four fifths of its rows. A mean that leaves zero is a force that the model lacks.");
  const kinds = [["velocity", "velocity"], ["displacement", "displacement"], ["since_reversal", "time since reversal"]]
    .filter(([kind]) => contents.timed || kind === "displacement");
  const plots = kinds.map(([, words]) => canvas(`Residual over ${words}`, (w) => Math.min(290, 0.8 * w)));
  const marks = element("div", {});
  body.append(marks, element("div", { class: "columns three" }, ...kinds.map(([, words], i) => figure(`Residual over ${words}`, plots[i]))));
  follow(["axis", "version", "region"], () => {
    marks.replaceChildren(versionLegend());
    kinds.forEach(([kind, words], i) => plots[i].redraw((c, w, h) => drawCurve(c, w, h, kind, words)));
  });
  if (!contents.timed) return;
  const spectral = section("correlations", "Is the residual noise?",
    "Bounds: 99 of 100 coefficients of a residual of the same colour that has nothing to do with the other signal stay inside " +
    "(surrogates of shuffled blocks). A coefficient outside says that something is left to model.");
  const spectrum = canvas("Spectrum of the residual and of the measured force", (w) => Math.min(300, 120 + 0.25 * w));
  const names = { residual: "Autocorrelation", force: "With the measured force", displacement: "With the displacement", velocity: "With the velocity" };
  const grid = Object.entries(names).map(([with_, words]) => ({ with_, words, plot: canvas(`${words}: correlation of the residual over lags`, (w) => Math.min(220, 0.62 * w)) }));
  const spectrumMarks = element("div", {});
  spectral.append(spectrumMarks, figure("Amplitude spectrum", spectrum),
    element("div", { class: "columns" }, ...grid.map((g) => figure(g.words, g.plot))));
  follow(["axis", "version", "region"], () => {
    spectrumMarks.replaceChildren(versionLegend(["measured", "measured force"]));
    spectrum.redraw(drawSpectrum);
    grid.forEach(({ with_, plot }) => plot.redraw((c, w, h) => drawCorrelation(c, w, h, with_)));
  });
}

/** The marks of the versions, the chosen one last. */
function versionLegend(...more) {
  const versions = contents.versions.map((name, i) => [contents.versions.length > 1 && i === 0 ? "before" : "model", `residual, ${name}`]);
  return legend(...more, ...versions);
}

/** Indices of the versions, the chosen one last so that it lies on top. */
function versionsInOrder() {
  return contents.versions.map((_, i) => i).filter((i) => i !== chosen.version).concat(chosen.version);
}

function drawCurve(context, width, height, kind, words) {
  const axis = contents.axes[chosen.axis];
  const curves = axis.residual.map((r) => r.over[kind]);
  if (!curves.some((c) => c.at.length)) {
    context.fillStyle = colour("muted");
    context.fillText("too few rows in every bin", 20, height / 2);
    return;
  }
  const unit = kind === "since_reversal" ? "s" : axis.units[kind];
  const x = prefixed(unit, peak(...curves.map((c) => c.at)));
  const e = prefixed(axis.units.force, peak(...curves.flatMap((c) => [c.low, c.high])));
  const map = frame(context, width, height,
    { label: `${words} (${x.unit})`, range: limits(0.02, ...curves.map((c) => c.at)).map((v) => v * x.factor) },
    { label: `residual (${e.unit})`, range: limits(0.08, ...curves.flatMap((c) => [c.low, c.high, [0]])).map((v) => v * e.factor) });
  clipped(context, map, () => {
    context.strokeStyle = colour("muted");
    context.lineWidth = 1;
    line(context, [[map.inner.left, map.up(0)], [map.inner.right, map.up(0)]]);
    for (const version of versionsInOrder()) {
      const curve = curves[version];
      const point = (values) => curve.at.map((at, i) => [map.across(at * x.factor), map.up(values[i] * e.factor)]);
      const front = version === chosen.version;
      context.fillStyle = versionColour(version);
      context.globalAlpha = front ? 0.2 : 0.1;
      context.beginPath();
      point(curve.low).concat(point(curve.high).reverse()).forEach(([px, py], i) => (i ? context.lineTo(px, py) : context.moveTo(px, py)));
      context.fill();
      context.globalAlpha = front ? 1 : 0.7;
      context.strokeStyle = versionColour(version);
      context.lineWidth = front ? 2.4 : 1.4;
      context.setLineDash(front ? [] : [5, 4]);
      line(context, point(curve.mean));
      context.setLineDash([]);
      context.globalAlpha = 1;
    }
    const since = new Map();
    const value = (s, i, record) => {
      if (kind !== "since_reversal") return s[kind][i];
      if (!since.has(record)) since.set(record, sinceReversal(s.time, s.velocity));
      return since.get(record)[i];
    };
    const marked = markedSamples((s, v, i, record) => [value(s, i, record) * x.factor, v.residual[i] * e.factor]);
    dots(context, map, some(marked, 3000), colour("highlight"), 1);
  });
}

function drawSpectrum(context, width, height) {
  const axis = contents.axes[chosen.axis];
  const spectra = axis.residual.map((r) => r.spectrum);
  const all = spectra.flatMap((s) => [...s.residual, ...s.force]).filter((v) => v > 0);
  if (!all.length) return;
  const most = Math.max(...all);
  const f = prefixed(axis.units.force, most);
  const least = Math.max(Math.min(...all), most * 1e-5);
  const first = spectra[chosen.version];
  const end = first.resolution_hz * Math.max(1, first.residual.length - 1);
  const map = frame(context, width, height, { label: "frequency (Hz)", range: [0, end] },
    { label: `amplitude (${f.unit} per √Hz)`, range: [least * f.factor * 0.7, most * f.factor * 1.4], log: true });
  clipped(context, map, () => {
    const region = contents.regions[chosen.region];
    if (region && region.band_hz) {
      const [from, to] = region.band_hz.map(map.across);
      context.globalAlpha = 0.25;
      context.fillStyle = colour("highlight");
      context.fillRect(from, map.inner.top, Math.max(2, to - from), map.inner.bottom - map.inner.top);
      context.globalAlpha = 1;
    }
    const trace = (values, resolution) => line(context,
      Array.from(values, (v, i) => [map.across(i * resolution), map.up(Math.max(v * f.factor, 1e-300))]).slice(1));
    context.strokeStyle = colour("measured");
    context.lineWidth = 2.4;
    trace(first.force, first.resolution_hz);
    for (const version of versionsInOrder()) {
      context.strokeStyle = versionColour(version);
      context.lineWidth = version === chosen.version ? 1.8 : 1.1;
      trace(spectra[version].residual, spectra[version].resolution_hz);
    }
  });
}

function drawCorrelation(context, width, height, with_) {
  const all = contents.axes[chosen.axis].residual.map((r) => r.correlation.find((c) => c.with === with_));
  const now = all[chosen.version];
  if (!now) {
    context.fillStyle = colour("muted");
    context.fillText("the records are too short", 20, height / 2);
    return;
  }
  const own = with_ === "residual";
  const middle = (c) => (own ? 0 : (c.coefficient.length - 1) / 2);
  const end = (now.coefficient.length - 1 - middle(now)) * now.step_s;
  const t = prefixed("s", end);
  // Of the residual with itself the 1 at no lag is known; what comes after sets the scale.
  const scale = all.flatMap((c) => (c ? [...c.coefficient.slice(own ? 3 : 0), c.bound, -c.bound] : []));
  const map = frame(context, width, height, { label: `lag of the residual (${t.unit})`, range: [own ? 0 : -end, end].map((v) => v * t.factor) },
    { label: "coefficient", range: limits(0.08, scale) });
  clipped(context, map, () => {
    context.fillStyle = colour("bound");
    context.fillRect(map.inner.left, map.up(now.bound), map.inner.right - map.inner.left, map.up(-now.bound) - map.up(now.bound));
    for (const version of versionsInOrder()) {
      const one = all[version];
      if (!one) continue;
      context.strokeStyle = versionColour(version);
      context.lineWidth = version === chosen.version ? 1.8 : 1;
      context.globalAlpha = version === chosen.version ? 1 : 0.6;
      line(context, one.coefficient.map((c, i) => [map.across((i - middle(one)) * one.step_s * t.factor), map.up(c)]));
      context.globalAlpha = 1;
    }
  });
}
