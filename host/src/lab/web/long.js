// A study whose log is too long to be held in memory: its channels thinned by smallest and largest value, and segments to work on.

import { act, read, refuse } from "./talk.js";
import { commandList } from "./history.js";

const HEIGHT = 128;
const count = new Intl.NumberFormat("en");

let shown = "";
let log = 0;
let drawn = null;
/** The rows and the seconds that are looked at; nothing for the whole log. */
let view = null;
let asked = false;
let busy = false;
let state = null;

/** The stage of such a study; the plots stay while more of the log is read. */
export function showLong(next, page) {
  state = next;
  const key = JSON.stringify([state.folder, state.file, state.long.logs.map((l) => [l.file, l.rows]), state.studies]);
  if (page.dataset.key !== key) {
    page.dataset.key = key;
    view = drawn = null;
    log = Math.min(log, state.long.logs.length - 1);
    page.replaceChildren(...build());
  }
  const told = JSON.stringify([key, log, state.long, Boolean(state.job), state.done.length]);
  if (told === shown) return;
  shown = told;
  tell();
  fetchRows();
}

function build() {
  const { logs } = state.long;
  const pick = element("select", { id: "long-log", "aria-label": "Log", hidden: logs.length < 2, onchange: () => {
    log = Number(pick.value);
    view = drawn = null;
    channels();
    tell();
    fetchRows();
  } }, ...logs.map((l, i) => element("option", { value: i, selected: i === log }, l.file)));
  const buttons = [["◀", "Move back", () => move(-0.4)], ["▶", "Move on", () => move(0.4)], ["+", "Zoom in", () => zoom(0.5)], ["−", "Zoom out", () => zoom(2)],
    ["whole log", "Show the whole log", () => look(null)]].map(([text, label, onclick]) => element("button", { type: "button", "aria-label": label, onclick }, text));
  const plots = element("div", { id: "long-plots", tabindex: "0", role: "group", "aria-label": "Channels over time; arrow keys move, plus and minus zoom, 0 shows all" });
  plots.addEventListener("keydown", keys);
  plots.addEventListener("wheel", wheel, { passive: false });
  plots.addEventListener("mousedown", drag);
  plots.addEventListener("dblclick", () => look(null));
  queueMicrotask(channels);
  return [element("section", { class: "long" }, element("div", { class: "long-head" }, element("h2", {}, "Channels over time"), pick, element("div", { class: "buttons" }, ...buttons)),
    element("p", { class: "hint", id: "long-read", role: "status" }), element("p", { class: "sentence", id: "long-failed", hidden: true }), plots,
    element("p", { class: "hint" }, "Drag to zoom, wheel to zoom at the pointer. Each column of pixels shows the smallest and largest value of its rows, so peaks are kept.")),
  segments(), element("section", { id: "commands", hidden: true }, element("h2", {}, "Commands"), element("div", { class: "body" }))];
}

/** How the log is worked on: segments that `select` chooses become a study of their own. */
function segments() {
  const number = (id, words, value) => element("p", { class: "field" }, element("label", { for: id }, words), element("input", { id, inputmode: "decimal", value, size: 8 }));
  const form = element("form", { class: "row", onsubmit: (event) => {
    event.preventDefault();
    const [segments, seconds] = ["segments", "seconds"].map((id) => Number(document.getElementById(id).value.replace(",", ".")));
    if (!(segments >= 2 && Number.isInteger(segments) && seconds > 0)) refuse("Give a whole number of segments, two or more, and their length in seconds");
    else act({ do: "select", segments, seconds });
  } }, number("segments", "Segments", "100"), number("seconds", "Length, s", "2"), element("button", { class: "primary", id: "select" }, "Choose segments and work on them"));
  const made = state.studies.filter((study) => study !== state.file);
  return element("section", {}, element("h2", {}, "Work on segments"),
    element("p", { class: "hint" }, "This log is too long to be learnt from as a whole. The whole training part is read once, and segments are kept that cover position, amplitude, speed and time. Of four, one validates."),
    form, made.length ? element("div", { class: "row" }, element("span", { class: "label" }, "chosen before"),
      ...made.map((study) => element("button", { type: "button", class: "work", onclick: () => act({ do: "work", study }) }, study.split("/").slice(-2)[0]))) : null);
}

/** What was read so far, and which buttons can be used. */
function tell() {
  const { file, format, rows, read: seen } = state.long.logs[log];
  const done = seen >= rows;
  document.getElementById("long-read").textContent = `${file}, ${format}: ${count.format(rows)} rows${done ? ", all read" : `, ${count.format(seen)} read (${Math.floor(100 * seen / rows)} %)`}.`;
  const failed = document.getElementById("long-failed");
  failed.hidden = !state.long.sentence;
  failed.textContent = state.long.sentence ? `${state.long.sentence}.` : "";
  const commands = document.getElementById("commands");
  commands.hidden = !state.done.length;
  commands.querySelector(".body").replaceChildren(...commandList(state));
  for (const button of document.querySelectorAll("#select, .work")) button.disabled = Boolean(state.job);
  if (done) document.documentElement.dataset.drawn = "long";
}

/** A canvas for every channel. */
function channels() {
  const place = document.getElementById("long-plots");
  place.replaceChildren(...state.long.logs[log].channels.map((c) => canvas(`${c.name} over time`, HEIGHT)));
}

/** Asks for what is looked at, one request at a time; where somebody went on meanwhile, for that at the end. */
async function fetchRows() {
  asked = true;
  if (busy) return;
  busy = true;
  while (asked && state.long) {
    asked = false;
    const mine = log;
    const [from, to] = view ? view.rows : [0, state.long.logs[log].rows];
    try {
      const answer = await read(`api/overview/${log}/${from}/${to}`);
      // A study may have been opened in the log's place meanwhile.
      if (!document.getElementById("long-plots")) break;
      if (mine !== log) continue;
      drawn = answer;
      draw();
    } catch (error) {
      refuse(error.message);
    }
  }
  busy = false;
}

const seconds = () => (view ? view.seconds : [drawn.times[0], drawn.times[drawn.times.length - 1]]);

function draw() {
  if (!drawn) return;
  const place = document.getElementById("long-plots");
  const timed = state.long.logs[log].timed;
  drawn.channels.forEach((channel, i) => {
    const values = [channel.low, channel.high].map((side) => side.filter((v) => v !== null));
    const { factor, unit } = channel.unit ? prefixed(channel.unit, peak(...values)) : { factor: 1, unit: "" };
    place.children[i].redraw((context, width, height) => {
      const range = values[0].length ? limits(0.05, ...values).map((v) => v * factor) : [-1, 1];
      const map = frame(context, width, height, { label: timed ? "time (s)" : "row", range: seconds() },
        { label: unit ? `${channel.name} (${unit})` : channel.name, range });
      clipped(context, map, () => {
        context.strokeStyle = colour("model");
        context.lineWidth = 1;
        for (const points of stretches(channel)) line(context, points.map(([t, v]) => [map.across(t), map.up(v * factor)]));
      });
      place.children[i].map = map;
    });
  });
  // A test and a screen reader's user can see what is drawn.
  place.dataset.rows = drawn.rows.length ? `${drawn.rows[0]} ${drawn.rows[drawn.rows.length - 1]}` : "";
  place.dataset.peaks = drawn.channels.map((c) => peak(c.high.filter((v) => v !== null))).join(" ");
}

/** The points of a channel, low and high in turn; what was not read yet is left out. */
function stretches(channel) {
  const parts = [[]];
  channel.low.forEach((low, i) => {
    const from = drawn.times[i];
    const to = drawn.times[i + 1];
    if (low === null || from === null) parts.push([]);
    else {
      const middle = to === null ? from : (from + to) / 2;
      parts[parts.length - 1].push(...(low === channel.high[i] ? [[middle, low]] : [[middle, low], [middle, channel.high[i]]]));
    }
  });
  return parts.filter((p) => p.length);
}

/** Looks at some seconds; of the whole log where there are none. What is there is drawn at once, finer rows follow. */
function look(range) {
  if (!drawn) return;
  const total = state.long.logs[log].rows;
  if (range) {
    const rows = range.map(rowAt).map((row, i) => Math.min(total, Math.max(0, i ? Math.ceil(row) + 1 : Math.floor(row))));
    view = rows[1] - rows[0] < total ? { rows, seconds: range } : null;
    if (view && rows[1] - rows[0] < 8) return;
  } else view = null;
  draw();
  fetchRows();
}

/** The row at a time, between those that are known; beyond what is drawn as it goes on there. */
function rowAt(time) {
  const known = drawn.rows.map((row, i) => [drawn.times[i], row]).filter(([t]) => t !== null);
  let at = known.findIndex(([t]) => t >= time);
  at = Math.min(Math.max(1, at < 0 ? known.length - 1 : at), known.length - 1);
  const [[t0, r0], [t1, r1]] = [known[at - 1], known[at]];
  return r0 + (time - t0) / (t1 - t0 || 1) * (r1 - r0);
}

function zoom(factor, at = 0.5) {
  if (!drawn) return;
  const [min, max] = seconds();
  const fixed = min + at * (max - min);
  look([fixed - at * (max - min) * factor, fixed + (1 - at) * (max - min) * factor]);
}

function move(share) {
  if (!drawn) return;
  const [min, max] = seconds();
  look([min, max].map((v) => v + share * (max - min)));
}

function keys(event) {
  const acts = { ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2), "+": () => zoom(0.6), "=": () => zoom(0.6), "-": () => zoom(1.7), 0: () => look(null), Home: () => look(null) };
  if (!acts[event.key] || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  acts[event.key]();
}

/** Where in the plots the pointer is, in seconds and as a share of the width. */
function pointer(event) {
  const plot = event.target.closest("canvas");
  if (!plot || !plot.map) return null;
  const { left, right } = plot.map.inner;
  const x = Math.min(right, Math.max(left, event.clientX - plot.getBoundingClientRect().left));
  return { seconds: plot.map.right(x), share: (x - left) / (right - left) };
}

function wheel(event) {
  const at = pointer(event);
  if (!at || event.ctrlKey) return;
  event.preventDefault();
  zoom(event.deltaY > 0 ? 1.25 : 0.8, at.share);
}

/** Dragging chooses what is looked at. */
function drag(down) {
  const begin = pointer(down);
  if (!begin || down.button) return;
  const plot = down.target;
  const end = (up) => {
    window.removeEventListener("mouseup", end);
    const { left, right } = plot.map.inner;
    const x = Math.min(right, Math.max(left, up.clientX - plot.getBoundingClientRect().left));
    if (Math.abs(up.clientX - down.clientX) >= 4) look([begin.seconds, plot.map.right(x)].sort((a, b) => a - b));
  };
  window.addEventListener("mouseup", end);
}

window.addEventListener("resize", () => document.getElementById("long-plots") && draw());
