// Measured and predicted force over time, or over rows where the log has none, the residual below on the same axis; zoom by dragging, wheel or keys.

const timePlots = [];
const timeLook = { force: 260, residual: 170, twice: true };
let zoomed = null;
const timeNumber = new Intl.NumberFormat("en", { maximumFractionDigits: 6, useGrouping: false });

function drawTime() {
  const body = section("time", contents.timed ? "Force over time" : "Force row by row",
    "Drag to zoom, wheel to zoom at the pointer, Shift and drag to move. With the plot in focus: arrow keys move, + and − zoom, 0 shows all.");
  const bar = element("div", { class: "buttons" },
    ...[["◀", "Move back", () => move(-0.4)], ["▶", "Move on", () => move(0.4)], ["+", "Zoom in", () => zoom(0.5)],
      ["−", "Zoom out", () => zoom(2)], ["whole record", "Show the whole record", () => showTime(null)]]
      .map(([text, label, act]) => element("button", { type: "button", "aria-label": label, onclick: act }, text)));
  const force = element("div", { class: "over-time" });
  const residual = element("div", { class: "over-time" });
  const host = element("div", { tabindex: "0", role: "img", class: "focusable" }, force, residual);
  const note = element("p", { class: "hint" });
  host.addEventListener("keydown", timeKeys);
  host.addEventListener("wheel", timeWheel, { passive: false });
  const marks = element("div", {});
  body.append(bar, marks, host, note);
  let moving = () => {};
  const build = () => {
    timePlots.splice(0).forEach((plot) => plot.destroy());
    const axis = contents.axes[chosen.axis];
    const record = contents.records[chosen.record];
    host.setAttribute("aria-label", `Measured and predicted force of ${axis.name} over ${contents.timed ? "time" : "the rows"} in ${record.file}, residual below`);
    marks.replaceChildren(legend(["measured", "measured"],
      [contents.versions.length > 1 && chosen.version === 0 ? "before" : "model", contents.versions[chosen.version]],
      ["highlight", "chosen region"]));
    const series = samples(chosen.record, chosen.axis);
    const now = series.versions[chosen.version];
    const inside = inRegion(chosen.record);
    const marked = (values, factor) => values.map((v, i) => (inside && inside[i] ? v * factor : null));
    const all = series.versions.flatMap((v) => [v.measured, v.predicted]);
    const f = prefixed(axis.units.force, peak(...all));
    const e = prefixed(axis.units.force, peak(...series.versions.map((v) => v.residual)));
    const time = Array.from(series.time);
    const scaled = (values, factor) => Array.from(values, (v) => v * factor);
    const model = versionColour(chosen.version);
    const traces = () => {
      const part = (name, factor) => scaled(onItsWay((v) => series.versions[v] && series.versions[v][name]), factor);
      const [measured, residual] = [part("measured", f.factor), part("residual", e.factor)];
      return [[time, measured, part("predicted", f.factor), marked(Array.from(now.measured), f.factor)],
        [time, residual, marked(Array.from(now.residual), e.factor)]];
    };
    const [forces, residuals] = traces();
    moving = () => traces().forEach((data, i) => timePlots[i].setData(data, false) || timePlots[i].redraw(true, false));
    // A line of one pixel is drawn four times as fast as a wider one.
    timePlots.push(timePlot(force, `force of ${axis.name} (${f.unit})`, timeLook.force, limits(0.05, ...all).map((v) => v * f.factor),
      forces,
      [["measured", colour("measured"), 2.6], [contents.versions[chosen.version], model, 1], ["chosen region", colour("highlight"), 2]], timeLook.twice));
    timePlots.push(timePlot(residual, `residual (${e.unit})`, timeLook.residual,
      limits(0.05, ...series.versions.map((v) => v.residual)).map((v) => v * e.factor),
      residuals,
      [["measured less predicted", model, 1], ["chosen region", colour("highlight"), 2]]));
    note.textContent = record.kept < record.rows
      ? `${record.kept} of ${record.rows} rows are drawn: the smallest and largest of every stretch.` : "Every row that the filters leave is drawn.";
    showTime(zoomed);
  };
  follow(["axis", "record", "version", "region"], build);
  followMove(() => moving());
  follow(["cycle", "cycles"], () => timePlots.forEach((plot) => plot.redraw(false)));
}

function timePlot(host, label, height, range, data, series, times = true) {
  const axis = (more) => ({ stroke: colour("muted"), grid: { stroke: colour("grid"), width: 1 },
    ticks: { stroke: colour("grid"), width: 1 }, font: `12px ${colour("font")}`, labelFont: `12px ${colour("font")}`,
    labelSize: 22, labelGap: 0, values: (plot, splits) => splits.map((v) => (v === null ? "" : timeNumber.format(v).replace("-", "−"))), ...more });
  const wide = host.clientWidth || 600;
  return new uPlot({
    width: wide, height, legend: { show: false }, padding: [8, 10, 0, 0],
    cursor: { sync: { key: "time", scales: ["x", null] }, drag: { x: true, y: false, setScale: false }, points: { size: 6 } },
    scales: { x: { time: false }, y: { range: () => range } },
    axes: [axis({ label: times ? alongLabel() : undefined, size: times ? 30 : 4, labelSize: 18, ...(times ? {} : { values: () => [] }) }), axis({ label, size: 58, space: 20 })],
    series: [{}, ...series.map(([name, stroke, width]) => ({ label: name, stroke, width, points: { show: false }, spanGaps: false }))],
    hooks: {
      drawClear: [shadeCycles],
      setSelect: [(plot) => {
        if (plot.select.width < 4) return;
        showTime([plot.posToVal(plot.select.left, "x"), plot.posToVal(plot.select.left + plot.select.width, "x")]);
        plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
      }],
      ready: [(plot) => {
        plot.over.addEventListener("dblclick", () => showTime(null));
        plot.over.addEventListener("mousedown", (down) => startMove(plot, down), true);
      }],
    },
  }, data, host);
}

/** The cycles that the loops below show, as a band behind the curves. */
function shadeCycles(plot) {
  const { time } = samples(chosen.record, chosen.axis);
  const [first, last] = chosenSamples();
  const from = plot.valToPos(time[first], "x", true);
  const to = plot.valToPos(time[last], "x", true);
  const { left, top, width, height } = plot.bbox;
  const begin = Math.max(left, from);
  const end = Math.min(left + width, to);
  if (end <= begin) return;
  plot.ctx.fillStyle = colour("band");
  plot.ctx.fillRect(begin, top, Math.max(1, end - begin), height);
}

/** Moves the time axis with the pointer while Shift is held. */
function startMove(plot, down) {
  if (!down.shiftKey) return;
  down.stopPropagation();
  const { min, max } = plot.scales.x;
  const perPixel = (max - min) / plot.over.clientWidth;
  const drag = (at) => showTime([min, max].map((v) => v - (at.clientX - down.clientX) * perPixel));
  const end = () => {
    window.removeEventListener("mousemove", drag);
    window.removeEventListener("mouseup", end);
  };
  window.addEventListener("mousemove", drag);
  window.addEventListener("mouseup", end);
}

/** Shows a range of time in both plots; all of the record without one. */
function showTime(range) {
  const { time } = samples(chosen.record, chosen.axis);
  const whole = [time[0], time[time.length - 1]];
  let [min, max] = range || whole;
  const width = Math.min(Math.max(max - min, 4 * (whole[1] - whole[0]) / Math.max(4, time.length)), whole[1] - whole[0]);
  min = Math.min(Math.max(min, whole[0]), whole[1] - width);
  max = min + width;
  zoomed = range && width < whole[1] - whole[0] ? [min, max] : null;
  timePlots.forEach((plot) => plot.setScale("x", { min, max }));
}

function shownTime() {
  const { min, max } = timePlots[0].scales.x;
  return [min, max];
}

function zoom(factor, at = 0.5) {
  const [min, max] = shownTime();
  const fixed = min + at * (max - min);
  showTime([fixed - at * (max - min) * factor, fixed + (1 - at) * (max - min) * factor]);
}

function move(share) {
  const [min, max] = shownTime();
  showTime([min, max].map((v) => v + share * (max - min)));
}

function timeKeys(event) {
  const acts = { ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2), "+": () => zoom(0.6), "=": () => zoom(0.6),
    "-": () => zoom(1.7), 0: () => showTime(null), Home: () => showTime(null) };
  if (!acts[event.key] || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  acts[event.key]();
}

function timeWheel(event) {
  if (!event.target.classList.contains("u-over") || event.ctrlKey) return;
  event.preventDefault();
  const box = event.target.getBoundingClientRect();
  zoom(event.deltaY > 0 ? 1.25 : 0.8, (event.clientX - box.left) / box.width);
}
