// The plots of the live view: for each axis the forces, the residual, and the loop of force over displacement.

/** Seconds that the plots go back, and of one column. */
const SHOWN_S = 6;
const COLUMN_S = 0.01;

/** Draws all axes into a place, whose canvases stay as long as the axes do. */
export function drawLive(place, picture, axes) {
  const shown = picture ? picture.axes.filter((_, i) => axes[i] && axes[i].columns.length) : [];
  const key = shown.map((a) => `${a.name} ${a.unit}`).join("|");
  if (place.dataset.key !== key || !place.hasChildNodes()) {
    place.dataset.key = key;
    place.replaceChildren(...(shown.length ? shown.map(rowOf) : [element("p", { class: "hint" }, "No samples yet.")]));
  }
  shown.forEach((axis, i) => {
    const [force, residual, loop] = place.children[i].querySelectorAll("canvas");
    const { columns, points } = axes[i];
    force.redraw((context, w, h) => overTime(context, w, h, `force (${axis.unit})`, columns, [["measured", "measured", 3], ["predicted", "model", 1.4]]));
    residual.redraw((context, w, h) => overTime(context, w, h, `residual (${axis.unit})`, columns, [["residual", "highlight", 1.4]]));
    loop.redraw((context, w, h) => overDisplacement(context, w, h, axis, points));
    // A test and a screen reader's user can see how much is drawn.
    force.dataset.columns = String(columns.length);
    loop.dataset.points = String(points.length);
  });
}

function rowOf(axis) {
  const plots = element("div", {}, canvas(`Measured and predicted force of ${axis.name} over the last ${SHOWN_S} seconds`, 190),
    canvas(`Residual of ${axis.name} over the last ${SHOWN_S} seconds`, 130));
  return element("div", { class: "live-axis" }, figure(`${axis.name}, over time`, plots),
    figure(`${axis.name}, over displacement`, canvas(`Measured and predicted force of ${axis.name} over its displacement, the last two seconds`, 320)));
}

/** Least and largest of every column, over seconds before the newest. */
function overTime(context, width, height, label, columns, curves) {
  const newest = columns[columns.length - 1].at;
  const most = Math.max(...curves.map(([name]) => peak(...columns.map((c) => c[name])))) || 1;
  const map = frame(context, width, height, { label: "time (s)", range: [-SHOWN_S, 0] }, { label, range: [-1.05 * most, 1.05 * most] });
  clipped(context, map, () => {
    for (const [name, tint, thick] of curves) {
      context.strokeStyle = colour(tint);
      context.lineWidth = thick;
      line(context, columns.flatMap((c) => c[name].map((value) => [map.across((c.at - newest) * COLUMN_S), map.up(value)])));
    }
  });
}

/** The loop, the older the fainter. */
function overDisplacement(context, width, height, axis, points) {
  if (!points.length) return;
  const range = (...names) => limits(0.05, ...names.map((name) => points.map((p) => p[name])));
  const map = frame(context, width, height, { label: "displacement (encoder counts)", range: range("counts") },
    { label: `force (${axis.unit})`, range: range("measured", "predicted") });
  const STEPS = 8;
  clipped(context, map, () => {
    for (const [name, tint, thick] of [["measured", "measured", 3], ["predicted", "model", 1.4]]) {
      context.strokeStyle = colour(tint);
      context.lineWidth = thick;
      for (let step = 0; step < STEPS; step += 1) {
        const [from, to] = [step, step + 1].map((s) => Math.floor(s * points.length / STEPS));
        context.globalAlpha = (step + 1) / STEPS;
        line(context, points.slice(Math.max(0, from - 1), to).map((p) => [map.across(p.counts), map.up(p[name])]));
      }
      context.globalAlpha = 1;
    }
  });
  const last = points[points.length - 1];
  dots(context, map, [[last.counts, last.measured]], colour("highlight"), 3);
}
