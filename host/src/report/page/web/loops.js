// Force over displacement and, where the log has time, over velocity, a few cycles at a time, chosen by a slider over the record.

function drawLoops() {
  const body = section("loops", "Loops, a few cycles at a time",
    "The slider moves over the record; the band in the plots above shows where. What a loop encloses is the work that the joint takes per cycle.");
  const slider = element("input", { type: "range", min: 0, step: 1, id: "cycle", oninput: () => choose({ cycle: Number(slider.value) }) });
  const count = element("select", { id: "cycles", onchange: () => choose({ cycles: Number(count.value) }) },
    ...[1, 2, 3, 5, 10, 20].map((n) => element("option", { value: n, selected: n === chosen.cycles }, String(n))));
  const shown = element("output", { for: "cycle cycles" });
  const over = drawnStates();
  const plots = over.map((name) => canvas(`Force over ${name}, measured and predicted`, (w) => Math.min(380, 0.8 * w)));
  const marks = element("div", {});
  body.append(element("div", { class: "controls" }, element("label", { for: "cycle" }, "from cycle"), slider,
    element("label", { for: "cycles" }, "cycles"), count, shown), marks,
  element("div", { class: "columns" }, ...over.map((name, i) => figure(`Force over ${name}`, plots[i]))));
  const show = () => {
    const starts = cycleStarts(chosen.record, chosen.axis);
    slider.max = Math.max(0, starts.length - 1 - chosen.cycles);
    slider.value = chosen.cycle;
    const [first, last] = chosenSamples();
    const series = samples(chosen.record, chosen.axis);
    const span = [series.time[first], series.time[last]];
    shown.textContent = contents.timed ? `${significant(span[0], 4)} s to ${significant(span[1], 4)} s` : `rows ${Math.round(span[0])} to ${Math.round(span[1])}`;
    marks.replaceChildren(legend(["measured", "measured"],
      [contents.versions.length > 1 && chosen.version === 0 ? "before" : "model", contents.versions[chosen.version]]));
    over.forEach((name, i) => plots[i].redraw((context, w, h) => drawLoop(context, w, h, name, first, last)));
  };
  follow(["axis", "record", "version", "region", "cycle", "cycles"], show);
  followMove(() => {
    const [first, last] = chosenSamples();
    over.forEach((name, i) => plots[i].redraw((context, w, h) => drawLoop(context, w, h, name, first, last)));
  });
}

function drawLoop(context, width, height, name, first, last) {
  const axis = contents.axes[chosen.axis];
  const series = samples(chosen.record, chosen.axis);
  const now = series.versions[chosen.version];
  const all = series.versions.flatMap((v) => [v.measured, v.predicted]);
  const s = prefixed(axis.units[name], peak(series[name]));
  const f = prefixed(axis.units.force, peak(...all));
  const cut = (values) => values.subarray(first, last + 1);
  const map = frame(context, width, height,
    { label: `${name} of ${axis.name} (${s.unit})`, range: limits(0.04, cut(series[name])).map((v) => v * s.factor) },
    { label: `force of ${axis.name} (${f.unit})`, range: limits(0.04, ...all.map(cut)).map((v) => v * f.factor) });
  const inside = inRegion(chosen.record);
  clipped(context, map, () => {
    const part = (which) => onItsWay((v) => series.versions[v] && series.versions[v][which]);
    [[part("measured"), "measured", 3], [part("predicted"), null, 1.4]].forEach(([values, name_, thick]) => {
      const points = [];
      for (let i = first; i <= last; i += 1) points.push([map.across(series[name][i] * s.factor), map.up(values[i] * f.factor)]);
      context.strokeStyle = name_ ? colour(name_) : versionColour(chosen.version);
      context.lineWidth = thick;
      line(context, points);
    });
    if (!inside) return;
    const marked = [];
    for (let i = first; i <= last; i += 1) if (inside[i]) marked.push([series[name][i] * s.factor, now.measured[i] * f.factor]);
    dots(context, map, marked, colour("highlight"), 1.8);
  });
}
