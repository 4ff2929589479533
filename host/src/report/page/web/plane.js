// Where the model fails: regions to choose, the residual over the state plane, the restoring-force surface with the data on it.

const view = { turn: -0.65, tilt: 0.95 };

function drawPlane() {
  const body = section("where", "Where it fails", contents.timed
    ? "Choose a region, here or on a map: its samples are marked in every plot. Left the signed mean (which way the model is wrong), right the RMS (how much)."
    : "Choose a region: its samples are marked in every plot.");
  const list = element("div", { class: "regions", role: "group", "aria-label": "Regions that hold a large part of the error" });
  follow(["axis", "version", "region"], () => list.replaceChildren(...regionButtons()));
  body.append(list);
  // Without a velocity there is no plane.
  if (!contents.timed) return;
  const maps = [["mean", "Mean residual, signed"], ["rms", "RMS residual"]]
    .map(([kind, words]) => ({ kind, words, plot: canvas(words + " over displacement and velocity", (w) => Math.min(360, 0.74 * w)) }));
  const surface = canvas("Restoring force over displacement and velocity: predicted surface and measured means", (w) => Math.min(460, 0.75 * w));
  surface.tabIndex = 0;
  surface.classList.add("turnable");
  body.append(element("div", { class: "columns" }, ...maps.map((m) => figure(m.words, m.plot))),
    figure("Restoring force: predicted as a surface, measured means as dots; drag or use the arrow keys to turn it",
      surface));
  follow(["axis", "version", "region"], () => maps.forEach(({ kind, plot }) => plot.redraw((c, w, h) => drawMap(c, w, h, kind, plot))));
  followMove(() => maps.forEach(({ kind, plot }) => plot.redraw((c, w, h) => drawMap(c, w, h, kind, plot))));
  maps.forEach(({ plot }) => plot.addEventListener("click", (event) => chooseRegionAt(plot, event.offsetX, event.offsetY)));
  const turn = () => surface.redraw(drawSurface);
  follow(["axis", "version"], turn);
  surface.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.08], ArrowDown: [0, 0.08] }[event.key];
    if (!by) return;
    event.preventDefault();
    turnBy(...by);
    turn();
  });
  surface.addEventListener("pointerdown", (down) => surface.setPointerCapture(down.pointerId));
  surface.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    turnBy(event.movementX / 150, event.movementY / 150);
    turn();
  });
}

/** Chooses the region of states that holds a place on a map: the smallest where several do, none where none does. */
function chooseRegionAt(plot, px, py) {
  const [displacement, velocity] = [plot.map.right(px) / plot.factors[0], plot.map.over(py) / plot.factors[1]];
  const here = (c) => {
    if (c.state >> 1 !== chosen.axis) return true;
    const value = c.state % 2 ? velocity : displacement;
    const size = c.magnitude ? Math.abs(value) : value;
    return (c.above === null || size > c.above) && (c.below === null || size < c.below);
  };
  const own = (c) => c.state >> 1 === chosen.axis;
  const holding = contents.regions.map((r, i) => ({ r, i })).filter(({ r }) => r.axis === chosen.axis && r.version === chosen.version
    && r.conditions && r.conditions.some(own) && r.conditions.every(here));
  holding.sort((a, b) => a.r.share_of_rows - b.r.share_of_rows);
  choose({ region: holding.length ? holding[0].i : null });
}

function turnBy(turn, tilt) {
  view.turn += turn;
  view.tilt = Math.min(1.5, Math.max(0.1, view.tilt + tilt));
}

/** A button per region of the chosen axis and version. */
function regionButtons() {
  const mine = contents.regions.map((r, i) => i)
    .filter((i) => contents.regions[i].axis === chosen.axis && contents.regions[i].version === chosen.version);
  if (!mine.length) return [element("p", { class: "hint" }, "No region stands out: the error is spread evenly.")];
  return mine.map((i) => {
    const region = contents.regions[i];
    const of = region.kind === "frequency" ? "band" : "rows";
    const pressed = chosen.region === i;
    return element("button", { type: "button", class: "region", "aria-pressed": String(pressed),
      onclick: () => choose({ region: pressed ? null : i }) },
    element("strong", {}, region.words),
    element("span", {}, `${percent(region.share_of_error, 2)} of the squared error in ${percent(region.share_of_rows, 2)} of the ${of}`));
  });
}

/** A colour between stops, 0 to 1. */
function shade(stops, at) {
  const place = Math.min(Math.max(at, 0), 1) * (stops.length - 1);
  const index = Math.min(Math.floor(place), stops.length - 2);
  const mix = (k) => Math.round(stops[index][k] + (place - index) * (stops[index + 1][k] - stops[index][k]));
  return `rgb(${mix(0)},${mix(1)},${mix(2)})`;
}

function stops(name) {
  return colour(name).split("/").map((stop) => stop.split(",").map(Number));
}

function drawMap(context, width, height, kind, plot) {
  const axis = contents.axes[chosen.axis];
  const plane = axis.residual[chosen.version].plane;
  const sign = kind === "mean";
  // One scale for before and after; cells with few rows do not set it.
  const most = Math.max(1e-300, ...axis.residual.flatMap((r) => r.plane[kind].map((v, i) => (r.plane.rows[i] >= 5 ? Math.abs(v) : 0))));
  const x = prefixed(axis.units.displacement, peak(plane.displacement));
  const y = prefixed(axis.units.velocity, peak(plane.velocity));
  const f = prefixed(axis.units.force, most);
  const bar = 66;
  const map = frame(context, width - bar, height,
    { label: `displacement of ${axis.name} (${x.unit})`, range: plane.displacement.map((v) => v * x.factor) },
    { label: `velocity of ${axis.name} (${y.unit})`, range: plane.velocity.map((v) => v * y.factor) });
  Object.assign(plot, { map, factors: [x.factor, y.factor] });
  const scale = stops(sign ? "diverging" : "sequential");
  const [across, up] = plane.cells;
  const { left, right, top, bottom } = map.inner;
  const [w, h] = [(right - left) / across, (bottom - top) / up];
  onItsWay((v) => axis.residual[v] && axis.residual[v].plane[kind]).forEach((value, i) => {
    if (value === null) return;
    context.fillStyle = shade(scale, sign ? 0.5 + 0.5 * value / most : value / most);
    context.fillRect(left + (i % across) * w, bottom - (Math.floor(i / across) + 1) * h, w + 0.6, h + 0.6);
  });
  for (let i = 0; i < 100; i += 1) {
    context.fillStyle = shade(scale, i / 99);
    context.fillRect(width - bar + 12, bottom - (i + 1) * (bottom - top) / 100, 12, (bottom - top) / 100 + 0.6);
  }
  context.fillStyle = colour("muted");
  context.textAlign = "left";
  context.textBaseline = "middle";
  const ends = sign ? [[most, top + 6], [0, (top + bottom) / 2], [-most, bottom - 6]] : [[most, top + 6], [0, bottom - 6]];
  ends.forEach(([value, at]) => context.fillText(significant(value * f.factor, 2), width - bar + 28, at));
  context.textBaseline = "bottom";
  context.fillText(f.unit, width - bar + 12, height - 3);
  const marked = markedSamples((s, v, i) => [s.displacement[i] * x.factor, s.velocity[i] * y.factor]);
  context.globalAlpha = 0.65;
  clipped(context, map, () => dots(context, map, some(marked, 5000), colour("highlight"), 0.8));
  context.globalAlpha = 1;
}

/** A point per sample in the chosen region, over all judged records. */
function markedSamples(point) {
  const marked = [];
  for (const record of judgedRecords()) {
    const inside = inRegion(record);
    if (!inside) continue;
    const series = samples(record, chosen.axis);
    for (let i = 0; i < inside.length; i += 1) if (inside[i]) marked.push(point(series, series.versions[chosen.version], i, record));
  }
  return marked;
}

function drawSurface(context, width, height) {
  const axis = contents.axes[chosen.axis];
  const plane = axis.residual[chosen.version].plane;
  const [across, up] = plane.cells;
  const forces = plane.predicted.concat(plane.measured).filter((v) => v !== null);
  const most = peak(forces) || 1;
  const size = Math.min(width * 0.36, height * 0.43);
  const [sinT, cosT] = [Math.sin(view.turn), Math.cos(view.turn)];
  const [sinE, cosE] = [Math.sin(view.tilt), Math.cos(view.tilt)];
  /** Cube coordinates −1 to 1 as pixels, and how far away. */
  const project = (x, y, z) => {
    const [rx, ry] = [x * cosT - y * sinT, x * sinT + y * cosT];
    return [width / 2 + size * rx, height / 2 - size * (0.7 * z * sinE + 0.7 * ry * cosE), ry * sinE - z * cosE * 0.3];
  };
  const place = (i) => [2 * (i % across + 0.5) / across - 1, 2 * (Math.floor(i / across) + 0.5) / up - 1];
  const corner = (i, v) => project(...place(i), v / most);
  context.strokeStyle = colour("grid");
  [[-1, -1, 1, -1], [1, -1, 1, 1], [1, 1, -1, 1], [-1, 1, -1, -1]].forEach(([a, b, c, d]) =>
    line(context, [project(a, b, -1), project(c, d, -1)]));
  line(context, [project(-1, -1, -1), project(-1, -1, 1)]);
  const scale = stops("diverging");
  const drawn = [];
  const meshed = new Uint8Array(plane.predicted.length);
  for (let i = 0; i + across < plane.predicted.length; i += 1) {
    if (i % across === across - 1) continue;
    const quad = [i, i + 1, i + 1 + across, i + across];
    if (quad.some((q) => plane.predicted[q] === null)) continue;
    quad.forEach((q) => { meshed[q] = 1; });
    const corners = quad.map((q) => corner(q, plane.predicted[q]));
    const mean = quad.reduce((s, q) => s + plane.predicted[q], 0) / 4;
    drawn.push({ depth: corners.reduce((s, c) => s + c[2], 0) / 4, corners, fill: shade(scale, 0.5 + 0.5 * mean / most) });
  }
  // A path through the plane has cells without neighbours to mesh with: they are drawn one by one.
  plane.predicted.forEach((v, i) => {
    if (v === null || meshed[i]) return;
    const [px, py, depth] = corner(i, v);
    const square = [[-3, -3], [3, -3], [3, 3], [-3, 3]].map(([dx, dy]) => [px + dx, py + dy, depth]);
    drawn.push({ depth, corners: square, fill: shade(scale, 0.5 + 0.5 * v / most) });
  });
  plane.measured.forEach((v, i) => {
    if (v !== null && plane.rows[i] >= 3) drawn.push({ depth: corner(i, v)[2] - 0.02, dot: corner(i, v) });
  });
  drawn.sort((a, b) => b.depth - a.depth);
  context.lineWidth = 0.5;
  for (const one of drawn) {
    if (one.dot) {
      context.fillStyle = colour("measured-dot");
      context.fillRect(one.dot[0] - 1.1, one.dot[1] - 1.1, 2.2, 2.2);
      continue;
    }
    context.beginPath();
    one.corners.forEach(([px, py], i) => (i ? context.lineTo(px, py) : context.moveTo(px, py)));
    context.closePath();
    context.fillStyle = one.fill;
    context.fill();
    context.strokeStyle = colour("mesh");
    context.stroke();
  }
  surfaceWords(context, axis, plane, most, project);
}

/** Names, units and ends of the surface's three axes. */
function surfaceWords(context, axis, plane, most, project) {
  const x = prefixed(axis.units.displacement, peak(plane.displacement));
  const y = prefixed(axis.units.velocity, peak(plane.velocity));
  const f = prefixed(axis.units.force, most);
  context.fillStyle = colour("ink");
  context.textAlign = "center";
  context.textBaseline = "middle";
  const tidy = (v, range) => (Math.abs(v) < 0.005 * (range[1] - range[0]) ? 0 : v);
  const ends = (range, q) => range.map((v) => significant(tidy(v, range) * q.factor, 2)).join(" to ");
  const write = (text, at) => {
    const half = context.measureText(text).width / 2 + 2;
    const right = context.canvas.clientWidth - half;
    context.fillText(text, Math.max(half, Math.min(right, at[0])), at[1]);
  };
  // Along the two edges of the floor that are in front.
  const front = (a, b) => (a[1] > b[1] ? a : b);
  write(`displacement ${ends(plane.displacement, x)} ${x.unit}`, front(project(0, -1.3, -1.15), project(0, 1.3, -1.15)));
  write(`velocity ${ends(plane.velocity, y)} ${y.unit}`, front(project(1.3, 0, -1.15), project(-1.3, 0, -1.15)));
  write(`force ±${significant(most * f.factor, 2)} ${f.unit}`, project(-1, -1, 1.15));
}
