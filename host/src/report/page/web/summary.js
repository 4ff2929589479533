// The top of the page: what was asked, the answer, the errors step by step down to the noise floor, every record's figures.

/** Heading and answer. */
function drawHeading() {
  const made = contents.made ? ` · ${contents.made}` : "";
  document.getElementById("page").append(element("header", {},
    element("p", { class: "kicker" }, `Jointwatch ${contents.version}${made}`),
    element("h1", {}, contents.title),
    element("p", { class: "answer" }, contents.answer),
    element("p", { class: "asked" }, element("code", {}, contents.asked))));
}

/** The staircase of every axis and the table of records. */
function drawErrors() {
  const body = section("errors", "Errors, step by step",
    `RMS error over RMS force, on the ${contents.judged_on}; the line is the noise floor, which no model can go below.`);
  const stairs = element("div", { class: "columns" });
  contents.axes.forEach((axis) => stairs.append(staircase(axis)));
  body.append(stairs, recordTable());
}

/** One axis: a bar for every step, on a logarithmic axis. */
function staircase(axis) {
  const width = 520;
  const row = 46;
  const right = 90;
  const errors = axis.steps.map((s) => s.error);
  const all = errors.concat(axis.floor > 0 ? [axis.floor] : []).filter((e) => e > 0);
  const low = 10 ** Math.floor(Math.log10(Math.min(...all) / 1.5));
  const high = Math.max(...all);
  const span = Math.log10(high / low) || 1;
  const place = (e) => (width - right) * Math.max(0, Math.log10(Math.max(e, low) / low) / span);
  const height = axis.steps.length * row + 30;
  const said = axis.steps.map((s) => `${s.label} ${percent(s.error)}`).join(", ");
  const image = vector("svg", { viewBox: `0 0 ${width} ${height}`, role: "img",
    "aria-label": `Error of ${axis.name} step by step: ${said}${axis.floor > 0 ? `; noise floor ${percent(axis.floor)}` : ""}` });
  // The floor's line lies over the bars and under the words.
  const bars = vector("g", {});
  const words = vector("g", {});
  image.append(bars);
  if (axis.floor > 0) {
    const at = place(axis.floor);
    // The words have half their length to the left of the line where there is room for it.
    const half = 70;
    image.append(vector("line", { x1: at, x2: at, y1: 0, y2: height - 22, class: "floor" }),
      vector("text", { x: Math.max(at, half), y: height - 6, "text-anchor": "middle", class: "floor-words" }, `noise floor ${percent(axis.floor)}`));
  }
  axis.steps.forEach((step, i) => {
    const kind = i === axis.steps.length - 1 ? "model" : "before";
    const label = step.label.length > 68 ? `${step.label.slice(0, 67)}…` : step.label;
    // Above its bar, where what was added together has room.
    bars.append(vector("rect", { x: 0, y: i * row + 20, width: Math.max(2, place(step.error)), height: row - 26, rx: 2, class: `bar ${kind}` }));
    words.append(
      vector("text", { x: 0, y: i * row + 14, class: "label" }, (i && !label.startsWith("without ") ? "+ " : "") + label),
      vector("text", { x: place(step.error) + 6, y: i * row + 35, class: "value" }, percent(step.error)));
  });
  image.append(words);
  return figure(`Axis ${axis.name}, logarithmic`, image);
}

/** Figures of every record, axis and version. */
function recordTable() {
  const rows = [];
  contents.records.forEach((record) => record.axes.forEach((axis, a) => axis.versions.forEach((v, i) => {
    if (axis.rests) {
      if (i === 0) rows.push([record.file, role(record), contents.axes[a].name, "", "at rest", "", "", "", ""]);
      return;
    }
    const force = prefixed(contents.axes[a].units.force, v.peak_error);
    rows.push([record.file, role(record), contents.axes[a].name, contents.versions[i], percent(v.relative_error),
      `${significant(v.nmse_percent)} %`, `${significant(v.fit_percent)} %`,
      `${significant(v.peak_error * force.factor)} ${force.unit}`, percent(v.outside_range, 2)]);
  })));
  return table("Errors of every record",
    ["record", "used for", "axis", "model", "relative error", "NMSE", "fit", "largest error", "outside range"], rows);
}

function role(record) {
  return record.role === "train" ? "training" : "validation";
}
