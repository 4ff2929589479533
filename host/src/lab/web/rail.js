// The rail: the steps of the loop from the study to the device, each with its buttons, and the error with its noise floor.

import { act, keep } from "./talk.js";
import { addable, kinds, openTab } from "./stage.js";
import { errorOn, made } from "./models.js";

let state = null;
let place = null;

/** Shows the steps; a part that has not changed is left alone, so that the keyboard keeps its place. */
export function showRail(next) {
  state = next;
  const rail = document.getElementById("rail");
  const model = state.models.find((m) => m.file === state.current);
  const busy = Boolean(state.job);
  const parts = state.study ? [
    ["study", [state.study, state.folder, state.file, state.studies, busy], studyPart],
    ["learn", [state.current, state.models, busy], () => learnPart(model)],
    ["missing", [state.current, state.diagnosis, state.models, state.done.length, busy], () => missingPart(model)],
    ["device", [state.current, state.blob, state.study.records, busy], () => devicePart(model)],
  ] : [];
  for (const old of [...rail.children]) if (!parts.some(([id]) => `step-${id}` === old.id)) old.remove();
  for (const [id, depends, build] of parts) {
    const key = JSON.stringify(depends);
    let step = document.getElementById(`step-${id}`);
    if (!step) rail.append(step = element("section", { class: "step", id: `step-${id}` }));
    if (step.dataset.key === key) continue;
    step.dataset.key = key;
    if (step.contains(document.activeElement)) place = document.activeElement.id;
    const built = build();
    step.hidden = !built;
    step.replaceChildren(...(built || []));
  }
  if (contents) meters();
  if (!busy) returnFocus();
  rail.hidden = !parts.length;
  document.querySelector(".lab").classList.toggle("alone", !parts.length);
}

/** Back to the button that was pressed, or where it is gone to the one that takes its action back; unless the user went elsewhere. */
function returnFocus() {
  if (place && document.activeElement === document.body) {
    const usable = [place, "undo", "diagnose"].map((id) => document.getElementById(id)).find((e) => e && !e.disabled);
    if (usable) usable.focus({ preventScroll: true });
  }
  place = null;
}

document.addEventListener("drawn", () => requestAnimationFrame(meters));

const button = (id, words, action, options = {}) => element("button", { type: "button", id, class: options.class, title: options.title,
  disabled: (Boolean(state.job) && !options.always) || options.disabled, onclick: typeof action === "function" ? action : () => act(action) }, words);

const step = (number, words, extra) => element("h2", {}, element("span", { class: "number", "aria-hidden": "true" }, String(number)), words, extra);

const timed = () => state.study.sample_rate_hz !== null;

function studyPart() {
  const { study } = state;
  const inertia = (a) => (a.inertia === null ? "inertia identified" : a.inertia === 0 ? "restoring force logged" : `${significant(a.inertia, 4)} ${a.inertia_unit}`);
  const few = study.records.length <= 12;
  const length = (records) => {
    const sum = (of) => records.reduce((total, r) => total + of(r), 0);
    return timed() ? `${significant(sum((r) => r.seconds), 3)} s` : `${sum((r) => r.rows)} rows`;
  };
  const roles = ["training", "validation"].map((role) => [role, study.records.filter((r) => r.role === role)]).filter(([, all]) => all.length);
  const summed = roles.map(([role, all]) => element("li", {}, element("span", { class: "file" }, `${all.length} records`),
    element("span", { class: `tag ${role}` }, role), element("span", { class: "time" }, length(all))));
  const others = state.studies.filter((file) => file !== state.file);
  const records = !few ? summed : study.records.map((r) => element("li", {}, element("span", { class: "file" }, r.file),
    element("span", { class: `tag ${r.role}` }, r.role), element("span", { class: "time" }, length([r]))));
  return [step(1, "Study", button("reopen", "read again", { do: "reopen" }, { class: "small" })),
    element("p", { class: "facts" }, `${timed() ? `${significant(study.sample_rate_hz, 5)} Hz` : "no time, row by row"} · ${study.axes.map((a) => `${a.name}: ${a.kind}, ${inertia(a)}`).join(" · ")}`),
    element("ul", { class: "records" }, ...records),
    ...(others.length ? [element("div", { class: "row" }, element("span", { class: "label" }, "go to"), ...others.map((file, i) => button(`study-${i}`,
      file.includes("/") ? file.split("/").slice(-2)[0] : file, { do: "work", study: file }, { class: "small", title: file })))] : []),
    ...(study.checks.length ? [element("ul", { class: "sentences problem" }, ...study.checks.map((c) => element("li", {}, `${c}.`)))] : [])];
}

function learnPart(model) {
  const learn = element("div", { class: "row", role: "group", "aria-label": "Identify a model" }, element("span", { class: "label" }, "identify"),
    ...kinds(state.study).map(([kind]) => button(`identify-${kind}`, kind, { do: "identify", kind })));
  if (!model) return [step(2, "Model"), learn];
  return [step(2, "Model", button("undo", "undo", { do: "undo" }, { class: "small", disabled: !model.parent,
    title: model.parent ? `Back to ${model.parent}` : "Nothing was added that could be undone" })),
  element("p", { class: "made" }, element("strong", {}, model.stem), element("span", {}, made(model))),
  element("div", { class: "meters" }, ...state.study.axes.map((axis) => meter(axis.name, errorOn(model, axis.name)))),
  learn,
  element("div", { class: "row" }, element("span", { class: "label" }, "keep"),
    button("keep-report", "report", () => keep("report"), { always: true }), button("keep-model", "model", () => keep("model"), { always: true }),
    button("to-models", `${state.models.length} model${state.models.length === 1 ? "" : "s"}`, () => openTab("models", true), { class: "small", always: true }))];
}

/** The error of one axis as a bar down to the noise floor. */
function meter(axis, error) {
  if (error === undefined) return null;
  return element("div", { class: "meter", "data-axis": axis, "data-error": error, role: "img", "aria-label": `Error of ${axis}: ${percent(error)}` },
    element("span", { class: "axis" }, axis), element("span", { class: "track" }, element("span", { class: "fill" }), element("span", { class: "tick", hidden: true })),
    element("span", { class: "value" }, percent(error)));
}

const widths = {};
const largest = {};

/** Sets the bars, which move to a new error; logarithmic, from below the floor to above the largest error seen. */
function meters() {
  for (const bar of document.querySelectorAll(".meter")) {
    const name = bar.dataset.axis;
    const error = Number(bar.dataset.error);
    const axis = contents.axes.find((a) => a.name === name);
    if (!axis || !(error > 0)) continue;
    largest[name] = Math.max(largest[name] || 0, error);
    const low = Math.min(axis.floor > 0 ? axis.floor : error, error) / 1.6;
    const place = (e) => 100 * Math.max(0.01, Math.log(e / low) / Math.log(1.15 * largest[name] / low));
    const [fill, tick] = [bar.querySelector(".fill"), bar.querySelector(".tick")];
    if (!fill.style.width && widths[name]) {
      fill.style.width = widths[name];
      fill.getBoundingClientRect();
    }
    fill.style.width = widths[name] = `${place(error)}%`;
    tick.hidden = !(axis.floor > 0);
    if (axis.floor > 0) {
      tick.style.left = `${place(axis.floor)}%`;
      bar.setAttribute("aria-label", `Error of ${name}: ${percent(error)}; noise floor ${percent(axis.floor)}`);
    }
  }
}

const VERDICTS = { effect: "An effect is missing", none: "Nothing is missing", unknown: "Something is missing that has no name", data: "The data are at fault" };

function missingPart(model) {
  if (!model) return null;
  const { diagnosis } = state;
  const ran = state.done[state.done.length - 1];
  const look = button("diagnose", diagnosis ? "look again" : "Look for what is missing", { do: "diagnose" }, { class: diagnosis ? "small" : "primary wide" });
  const parts = [step(3, "What is missing", diagnosis ? look : null)];
  if (!diagnosis) parts.push(element("p", { class: "hint" }, timed() ? "Choose a region of the map to see where the model fails, then look for what explains it." : "Look for what explains the residual."), look);
  else {
    const found = diagnosis.found.map((f) => `${f.effect}@${f.axis}`);
    parts.push(element("p", { class: `verdict ${diagnosis.verdict}` }, VERDICTS[diagnosis.verdict] || diagnosis.verdict,
      found.length ? `${diagnosis.verdict === "unknown" ? "; a part of it is" : ":"} ${found.join(", ")}` : ""));
    if (found.length) parts.push(button("add-found", `Add ${found.join(" and ")}`, { do: "add", effects: found.flatMap((name) => addable(name, state)) }, { class: "primary wide" }));
    if (diagnosis.ranked.length) parts.push(button("to-candidates", "see each candidate over the residual", () => openTab("candidates", true), { class: "wide", always: true }));
    const notes = (list) => list.map((note) => element("p", { class: "hint" }, `${note}.`));
    parts.push(...notes(diagnosis.data_problems));
    if (diagnosis.notes.length) parts.push(element("details", {}, element("summary", {}, "notes on the search"), ...notes(diagnosis.notes)));
  }
  if (ran && ran.useless) {
    parts.push(element("p", { class: "verdict data" }, `${ran.useless.join(", ")} does not help.`),
      button("add-anyway", "Add it all the same", { do: "add", effects: ran.useless, force: true }, { class: "wide" }));
  }
  const pick = element("select", { id: "other-effect", "aria-label": "Another effect", disabled: Boolean(state.job) },
    ...state.study.effects.filter((e) => !model.effects.includes(e)).map((e) => element("option", {}, e)));
  parts.push(element("div", { class: "row" }, pick, button("add-other", "add", () => act({ do: "add", effects: [pick.value] }))));
  return parts;
}

function devicePart(model) {
  // A device runs in time.
  if (!model || !timed()) return null;
  const records = [...new Set(state.study.records.map((r) => r.file))];
  const validates = state.study.records.find((r) => r.role === "validation");
  const pick = element("select", { id: "device-record", "aria-label": "Record for the device" },
    ...records.map((file) => element("option", { selected: validates && file === validates.file }, file)));
  const needs = { disabled: !state.blob, title: state.blob ? "" : "Export the model first" };
  return [step(4, "Device"),
    element("div", { class: "row" }, button("export", "export", { do: "export" }), button("keep-blob", "keep blob", () => keep("blob"), needs)),
    element("div", { class: "row" }, pick, button("replay", "replay", () => run("replay", pick), needs), button("emulate", "emulate", () => run("emulate", pick), needs)),
    element("p", { class: "hint" }, state.blob ? `Blob: ${state.blob}` : "Export turns the model into the bytes that the device evaluates.")];
}

function run(command, pick) {
  act({ do: command, record: pick.value });
  openTab("commands", true);
}
