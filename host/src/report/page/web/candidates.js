// Ranked candidates for what is missing: errors with intervals, and each one's force laid over the residual.

function drawCandidates() {
  if (!contents.candidates.length) return;
  const body = section("candidates", "What could be missing",
    "Error with each candidate added alone, on rows that it was not fitted to, with its 95 % interval; the line is the error without. " +
    "Choose one to lay its force over the residual.");
  const list = element("div", { class: "candidates", role: "group", "aria-label": "Candidates, best first" });
  const words = element("div", { class: "words" });
  const over = drawnStates();
  const plots = over.map((name) => canvas(`Residual over ${name} with the candidate's force`, (w) => Math.min(340, 0.75 * w)));
  const loops = element("div", {}, legend([contents.versions.length > 1 ? "before" : "model", "residual without it"],
    ["candidate", "the candidate's force, less what a constant, a spring and a damper take up"]),
  element("div", { class: "columns" }, ...over.map((name, i) => figure(`Over ${name}`, plots[i]))));
  body.append(list, words, loops);
  follow(["candidate"], () => {
    list.replaceChildren(...contents.candidates.map(candidateButton));
    words.replaceChildren(...candidateWords(contents.candidates[chosen.candidate]));
  });
  follow(["candidate", "cycle", "cycles"], () => {
    const record = contents.records.findIndex((r) => r.axes.some((a) => a.candidates[chosen.candidate]));
    loops.hidden = record < 0;
    if (record < 0) return;
    const axis = contents.records[record].axes.findIndex((a) => a.candidates[chosen.candidate]);
    over.forEach((name, i) => plots[i].redraw((c, w, h) => drawCandidate(c, w, h, name, record, axis)));
  });
}

function candidateButton(candidate, i) {
  const most = Math.max(...contents.candidates.flatMap((c) => [c.error_before, c.interval[1], c.error_after]));
  const place = (e) => 100 * Math.min(1, Math.max(0, e / most));
  const [low, high] = candidate.interval.map(place);
  const image = vector("svg", { viewBox: "0 0 100 14", preserveAspectRatio: "none", "aria-hidden": "true" },
    vector("rect", { x: 0, y: 2, width: place(candidate.error_after), height: 10, class: `bar ${candidate.found ? "model" : "plain"}` }),
    vector("rect", { x: low, y: 6, width: Math.max(0.3, high - low), height: 2, class: "whisker" }),
    vector("rect", { x: place(candidate.error_before) - 0.2, y: 0, width: 0.4, height: 14, class: "without" }));
  return element("button", { type: "button", class: "candidate", "aria-pressed": String(chosen.candidate === i), onclick: () => choose({ candidate: i }) },
    element("strong", {}, (candidate.found ? "✓ " : "") + candidate.name), image,
    element("span", {}, `${percent(candidate.error_before)} → ${percent(candidate.error_after)}`));
}

function candidateWords(candidate) {
  const values = candidate.values.map((v) => `${v.meaning} ${v.symbol} = ${significant(v.value, 4)}${unitText(v.unit)}`);
  const parts = [element("p", {}, element("strong", {}, candidate.title || candidate.name),
    values.length ? ` with ${values.join(", ")}.` : ".")];
  if (candidate.as_good.length) {
    parts.push(element("p", {}, `These records cannot tell it from ${candidate.as_good.join(", ")}. To tell them apart: ${candidate.experiment}`));
  }
  if (candidate.worse.length) {
    parts.push(element("p", {}, `Much like it, but worse here: ${candidate.worse.join(", ")}.`));
  }
  return parts;
}

function drawCandidate(context, width, height, name, record, at) {
  const axis = contents.axes[at];
  const series = samples(record, at);
  const residual = series.versions[0].residual;
  const force = series.candidates[chosen.candidate];
  const starts = cycleStarts(record, at);
  const begin = Math.max(0, Math.min(chosen.cycle, starts.length - 1 - chosen.cycles));
  const first = starts[begin] || 0;
  const last = starts[Math.min(begin + chosen.cycles, starts.length - 1)] || residual.length - 1;
  const cut = (values) => values.subarray(first, last + 1);
  const s = prefixed(axis.units[name], peak(series[name]));
  const f = prefixed(axis.units.force, peak(residual, force));
  const map = frame(context, width, height,
    { label: `${name} of ${axis.name} (${s.unit})`, range: limits(0.04, cut(series[name])).map((v) => v * s.factor) },
    { label: `residual (${f.unit})`, range: limits(0.06, cut(residual), cut(force)).map((v) => v * f.factor) });
  clipped(context, map, () => [[residual, versionColour(0), 1.4], [force, colour("candidate"), 2.4]].forEach(([values, stroke, thick]) => {
    context.strokeStyle = stroke;
    context.lineWidth = thick;
    line(context, Array.from(cut(values), (v, i) => [map.across(series[name][first + i] * s.factor), map.up(v * f.factor)]));
  }));
}
