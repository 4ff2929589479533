// A plot on a canvas: frame, ticks, units, and what a caller draws between them.

/** A colour of the theme. */
function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** The colour of a version: before or after. */
function versionColour(version) {
  return colour(contents.versions.length > 1 && version === 0 ? "before" : "model");
}

/** A canvas that a screen reader can name; `draw(context, width, height)` is in CSS pixels. */
function canvas(label, height) {
  const made = element("canvas", { role: "img", "aria-label": label, class: "plot" });
  made.redraw = (draw) => {
    const width = made.clientWidth || 320;
    const tall = typeof height === "function" ? height(width) : height;
    const sharp = window.devicePixelRatio || 1;
    made.width = Math.round(width * sharp);
    made.height = Math.round(tall * sharp);
    made.style.height = `${tall}px`;
    const context = made.getContext("2d");
    context.scale(sharp, sharp);
    context.clearRect(0, 0, width, tall);
    context.font = `12px ${colour("font")}`;
    context.lineJoin = "round";
    draw(context, width, tall);
  };
  return made;
}

const LEFT = 58;
const RIGHT = 10;
const TOP = 8;
const BOTTOM = 40;

/** Draws frame, ticks and labels; gives the maps from values to pixels. `x` and `y`: { label, range, log }. */
function frame(context, width, height, x, y) {
  const inner = { left: LEFT, right: width - RIGHT, top: TOP, bottom: height - BOTTOM };
  const across = (v) => inner.left + (v - x.range[0]) / (x.range[1] - x.range[0]) * (inner.right - inner.left);
  const scale = y.log ? (v) => Math.log10(Math.max(v, y.range[0] / 10)) : (v) => v;
  const [low, high] = y.range.map(scale);
  const up = (v) => inner.bottom - (scale(v) - low) / (high - low) * (inner.bottom - inner.top);
  context.strokeStyle = colour("grid");
  context.fillStyle = colour("muted");
  context.lineWidth = 1;
  context.textAlign = "center";
  context.textBaseline = "top";
  const along = ticks(...x.range, Math.max(2, (inner.right - inner.left) / 62));
  for (const value of along.values) {
    line(context, [[across(value), inner.top], [across(value), inner.bottom]]);
    context.fillText(tickText(value, along.decimals), across(value), inner.bottom + 5);
  }
  context.textAlign = "right";
  context.textBaseline = "middle";
  const upward = y.log ? decades(low, high) : ticks(low, high, Math.max(2, (inner.bottom - inner.top) / 45));
  for (const value of upward.values) {
    line(context, [[inner.left, up(value)], [inner.right, up(value)]]);
    context.fillText(y.log ? significant(value, 1) : tickText(value, upward.decimals), inner.left - 6, up(value));
  }
  context.fillStyle = colour("ink");
  context.textAlign = "center";
  context.textBaseline = "bottom";
  context.fillText(x.label, (inner.left + inner.right) / 2, height - 3);
  context.save();
  context.translate(12, (inner.top + inner.bottom) / 2);
  context.rotate(-Math.PI / 2);
  context.textBaseline = "middle";
  context.fillText(y.label, 0, 0);
  context.restore();
  return { across, up, inner };
}

function decades(low, high) {
  const values = [];
  for (let power = Math.ceil(low); power <= high; power += 1) values.push(10 ** power);
  return { values, decimals: 0 };
}

/** A line through points in pixels. */
function line(context, points) {
  context.beginPath();
  points.forEach(([px, py], i) => (i ? context.lineTo(px, py) : context.moveTo(px, py)));
  context.stroke();
}

/** Keeps what `draw` does inside the frame. */
function clipped(context, { inner }, draw) {
  context.save();
  context.beginPath();
  context.rect(inner.left, inner.top, inner.right - inner.left, inner.bottom - inner.top);
  context.clip();
  draw();
  context.restore();
}

/** Dots in one colour. */
function dots(context, map, points, fill, radius) {
  context.fillStyle = fill;
  for (const [x, y] of points) {
    context.fillRect(map.across(x) - radius, map.up(y) - radius, 2 * radius, 2 * radius);
  }
}

/** At most so many of some points, evenly. */
function some(points, most) {
  const step = Math.ceil(points.length / most);
  return step > 1 ? points.filter((_, i) => i % step === 0) : points;
}

/** A legend: marks and words. */
function legend(...entries) {
  return element("ul", { class: "legend" },
    ...entries.map(([kind, words]) => element("li", {}, element("span", { class: `mark ${kind}` }), words)));
}
