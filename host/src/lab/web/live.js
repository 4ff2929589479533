// The live view: a device's state, forces, residual and loop as they come, in place of the stage.

import { followLive, look } from "./talk.js";
import { drawLive } from "./live-plots.js";

/** Columns of 10 ms and points that are kept, as many as the server tells of. */
const COLUMNS = 600;
const POINTS = 1000;

let stop = null;
let plots = "";
let axes = [];
let happened = [];
let due = false;
let seen = { picture: null };

/** Opens the live view, or goes back to the stage; nothing is asked of the server while it is closed. */
export function switchLive() {
  const open = !stop;
  document.getElementById("to-live").setAttribute("aria-pressed", String(open));
  document.getElementById("page").hidden = open;
  const place = document.getElementById("live");
  place.hidden = !open;
  if (!open) {
    stop.abort();
    stop = null;
    redraw();
    return;
  }
  if (!place.hasChildNodes()) build(place);
  stop = new AbortController();
  plots = "";
  happened = [];
  followLive(hear, stop.signal);
  document.getElementById("live-place").focus();
}

function build(place) {
  const kind = element("select", { id: "live-kind", "aria-label": "Kind of line" }, element("option", { value: "tcp" }, "address"), element("option", { value: "port" }, "serial port"));
  const where = element("input", { id: "live-place", "aria-label": "Where the device is", value: "127.0.0.1:4000", size: 24 });
  const form = element("form", { class: "row", onsubmit: (event) => {
    event.preventDefault();
    look({ [kind.value]: where.value });
  } }, kind, where, element("button", { class: "primary", id: "live-connect" }, "Connect"),
  element("button", { type: "button", id: "live-leave", onclick: () => look(null) }, "Disconnect"));
  const part = (id, title, ...more) => element("section", { "aria-labelledby": `${id}-title` }, element("h2", { id: `${id}-title` }, title), ...more, element("div", { id }));
  place.append(element("section", {}, form,
    element("p", { class: "hint" }, "A board's serial port, such as /dev/ttyUSB0 or COM3; or the address of a device without a board: jointwatch emulate model.bin study.toml --serve 4000"),
    element("div", { id: "live-state", role: "status" })),
  part("live-plots", "Forces and loop", legend(["measured", "measured"], ["model", "predicted"], ["highlight", "residual"])),
  part("live-counts", "Sensors and counters"), part("live-events", "Events"));
}

/** Takes what is new. */
function hear(news) {
  const key = news.plots.join(" ");
  if (key !== plots) {
    if (key.split(" ")[0] !== plots.split(" ")[0]) happened = [];
    plots = key;
    axes = [];
  }
  news.axes.forEach((fresh, i) => {
    const axis = axes[i] || (axes[i] = { columns: [], points: [] });
    if (fresh.columns.length && axis.columns.length && axis.columns[axis.columns.length - 1].at === fresh.columns[0].at) axis.columns.pop();
    axis.columns = [...axis.columns, ...fresh.columns].slice(-COLUMNS);
    axis.points = [...axis.points, ...fresh.points].slice(-POINTS);
  });
  happened = [...happened, ...news.happened].slice(-100);
  seen = news;
  if (due) return;
  due = true;
  // One picture for all that came since the last; none while the page is not looked at.
  requestAnimationFrame(() => {
    due = false;
    if (stop) show();
  });
}

function show() {
  const { picture } = seen;
  stateOf(picture);
  document.getElementById("live-leave").disabled = !picture;
  drawLive(document.getElementById("live-plots"), picture, axes);
  listOf("live-counts", picture ? counts(picture) : []);
  listOf("live-events", [...happened].reverse().map((h) => element("li", {}, element("span", { class: "time" }, h.time_s === null ? "–" : `${h.time_s.toFixed(1)} s`), h.text)));
}

const share = (value, digits = 2) => (value === null ? "–" : `${significant(value, digits)} %`);

function stateOf(picture) {
  const place = document.getElementById("live-state");
  if (!picture) {
    replace(place, [element("p", { class: "hint" }, "No device is looked at.")]);
    return;
  }
  const time = picture.time_s === null ? "" : ` · ${picture.time_s.toFixed(0)} s since its start`;
  const speed = picture.speed === null ? "" : ` · ${picture.speed.toFixed(1)} × real time`;
  const axis = (a) => [a.name, a.state, a.reason, a.age_s === null ? "–" : `${a.age_s.toFixed(1)} s ago, ${a.judged_percent.toFixed(0)} % of the time`,
    a.limit_percent === null ? "below 75 %" : `${a.limit_percent.toFixed(0)} %`, a.nmse_percent.map((n) => share(n)).join(" / ")];
  replace(place, [element("p", { class: "word" }, element("strong", { class: `state ${picture.state.replace(" ", "-")}` }, picture.state), picture.reason),
    picture.alarm ? element("p", { class: "sentence" }, `Alarm ${picture.alarm}`) : null,
    element("p", { class: "facts" }, `${picture.line}${time}${speed}`),
    table("The axes of the joint", ["axis", "state", "why", "judged", "change, of its limit", "NMSE fast / slow"], picture.axes.map(axis)),
    element("p", { class: "facts" }, picture.device || "The device has not introduced itself yet.")]);
}

function counts(picture) {
  const ill = picture.sensors.filter((s) => s.trouble).map((s) => element("li", { class: "bad" }, `${s.name}: ${s.trouble}`));
  const well = picture.sensors.length ? element("li", {}, `${picture.sensors.length - ill.length} of ${picture.sensors.length} channels well`) : null;
  const outside = picture.outside_percent === null ? null : element("li", {}, `${picture.outside_percent.toFixed(1)} % of the recent time outside the trained range`);
  const counted = picture.counters.filter((c) => c.count || !c.bad).map((c) => element("li", { class: c.bad ? "bad" : "" }, `${c.count} ${c.what}`));
  return [...ill, well, outside, ...counted].filter(Boolean);
}

const listOf = (id, items) => replace(document.getElementById(id), [element("ul", { class: "records" }, ...items)]);

/** Puts parts in place, unless they would look as those that are there. */
function replace(place, parts) {
  const made = element("div", {}, ...parts);
  if (place.firstChild && made.textContent === place.textContent) return;
  place.replaceChildren(made);
}
