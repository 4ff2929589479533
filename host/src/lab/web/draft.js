// Logs that no study describes yet: dropping them, what was guessed as a form, and every channel as a plot.

import { act, read, refuse, released, send } from "./talk.js";

const ROLES = [["time", "Time"], ["force", "Force"], ["displacement", "Displacement"], ["velocity", "Velocity"], ["acceleration", "Acceleration"]];

/** What `init` calls the time of a log that has none. */
const NO_TIME = "none";

/** The stage of a folder without a study; `current` tells whether the stage still waits for it. */
export async function showDraft(state, page, current) {
  const parts = [drop(state)];
  if (state.drafted) {
    const draft = await read("api/draft").catch((error) => current() && refuse(error.message));
    if (draft) parts.push(form(draft, state), channels(draft));
  }
  await released();
  // While it was read a newer state may have come, whose draft or study must not be drawn over.
  if (!current()) return;
  const focused = page.contains(document.activeElement) ? document.activeElement.id : "";
  page.replaceChildren(...parts);
  if (focused) document.getElementById(focused)?.focus({ preventScroll: true });
  page.querySelectorAll("canvas.plot").forEach((plot) => plot.draw());
  document.documentElement.dataset.drawn = "draft";
}

function drop(state) {
  const pick = element("input", { type: "file", id: "pick", multiple: true, class: "unseen", onchange: () => take(pick.files) });
  const zone = element("section", { class: "drop" }, element("h2", {}, state.drafted ? "Another log" : "Drop a log of the rig"),
    element("p", {}, "CSV, Excel, Parquet, Arrow, MATLAB, HDF5, MDF 4, NumPy, TDMS, UFF 58 or JSON: force and displacement over time, one file per run."),
    element("p", {}, element("label", { for: "pick", class: "button primary" }, "Choose files"), pick),
    element("p", { class: "hint" }, `Logs are copied to ${state.folder}.`));
  zone.addEventListener("dragover", (event) => {
    event.preventDefault();
    zone.classList.add("over");
  });
  zone.addEventListener("dragleave", () => zone.classList.remove("over"));
  zone.addEventListener("drop", (event) => {
    event.preventDefault();
    zone.classList.remove("over");
    take(event.dataTransfer.files);
  });
  return zone;
}

async function take(files) {
  refuse("");
  try {
    for (const file of files) await send(file);
  } catch (error) {
    refuse(error.message);
  }
}

/** The guesses; a changed one is asked for anew, so that what follows from it changes too. */
function form(draft, state) {
  const { guess, said } = draft;
  const axis = guess && guess.axes[0];
  const stated = new Map(said.columns);
  const taken = { time: guess && guess.time && guess.time.column, force: axis && axis.force && axis.force.column, displacement: axis && axis.displacement.map((d) => d.column).join(" − "),
    velocity: axis && axis.velocity && axis.velocity.column, acceleration: axis && axis.acceleration && axis.acceleration.column };
  const field = ([role, words]) => {
    const pick = element("select", { id: `column-${role}`, name: role, onchange: () => act({ ...answers(made), do: "draft" }) },
      element("option", { value: "" }, stated.has(role) ? "guess it" : `${taken[role] || "none"} (guessed)`),
      ...(role === "time" ? [element("option", { value: NO_TIME, selected: stated.get(role) === NO_TIME }, "the log has none: rows in order")] : []),
      ...draft.columns.map((c) => element("option", { value: c, selected: stated.get(role) === c }, c)));
    return element("p", { class: "field" }, element("label", { for: `column-${role}` }, words), pick);
  };
  const number = (id, words, value, hint) => element("p", { class: "field" }, element("label", { for: id }, words),
    element("input", { id, name: id, inputmode: "decimal", value: value ?? "", placeholder: hint, onchange: () => act({ ...answers(made), do: "draft" }) }));
  const made = element("form", { class: "guess", onsubmit: (event) => {
    event.preventDefault();
    act({ ...answers(made), do: "init" });
  } }, element("div", { class: "fields" }, ...ROLES.map(field),
    number("rate", "Sample rate, Hz", said.rate, guess && guess.sample_rate_hz ? `${significant(guess.sample_rate_hz, 6)} (from the log)` : "as the log has it"),
    number("inertia", `Inertia, ${axis ? axis.inertia_unit : "kg"}`, said.inertia, axis && axis.inertia_seen ? `about ${significant(axis.inertia_seen, 3)} (identify it)` : "identify it")),
  draft.sentence ? element("p", { class: "sentence" }, `${draft.sentence}.`) : null,
  guess ? element("ul", { class: "sentences" }, ...guess.findings.map((f) => element("li", {}, `${f}.`)),
    ...guess.axes.map((a) => element("li", {}, `Axis ${a.name}, ${a.kind}; restoring force = ${a.restoring_force}; base ${a.base.join(", ") || "none"}.`)),
    ...guess.records.map((r) => element("li", {}, `${r.file}${r.rows ? `, rows ${r.rows[0]} to ${r.rows[1]}` : ""}: ${r.role}.`))) : null,
  element("p", {}, element("button", { class: "primary", id: "init", disabled: !guess || Boolean(state.job) }, "Write study.toml and go on")),
  draft.text ? element("details", {}, element("summary", {}, "study.toml as it will be"), element("pre", { tabindex: "0" }, draft.text)) : null);
  return element("section", { class: "guessed" }, element("h2", {}, "What was guessed"),
    element("p", { class: "hint" }, "Names, units and the numbers themselves say what is what. Change what is wrong; the rest is guessed anew."), made);
}

/** What the form says, as `init` takes it. */
function answers(made) {
  const number = (name) => {
    const text = made.elements[name].value.trim().replace(",", ".");
    return text === "" || !Number.isFinite(Number(text)) ? null : Number(text);
  };
  return { columns: ROLES.map(([role]) => [role, made.elements[role].value]).filter(([, column]) => column), rate: number("rate"), inertia: number("inertia") };
}

/** Every column of every log. */
function channels(draft) {
  const plots = draft.logs.flatMap((log) => [element("h3", {}, `${log.file}: ${log.format}, ${log.rows} rows${log.time ? `, ${significant(log.time.rate_hz, 5)} Hz` : ""}`),
    ...log.notes.map((n) => element("p", { class: "hint" }, `${n}.`)), element("div", { class: "channels" }, ...log.columns.map((c) => channel(c, log)))]);
  return element("section", {}, element("h2", {}, "Channels"), ...plots);
}

function channel(column, log) {
  const plot = canvas(`${column.name} over the rows of ${log.file}`, 90);
  const values = unpack(column.values);
  plot.draw = () => plot.redraw((context, width, height) => {
    const [low, high] = limits(0.05, values.filter(Number.isFinite));
    context.strokeStyle = colour("model");
    context.lineWidth = 1;
    line(context, column.rows.map((row, i) => [width * row / Math.max(1, column.of - 1), height - height * (values[i] - low) / (high - low)]));
  });
  const range = column.range.map((v) => significant(v, 3)).join(" to ");
  return element("figure", {}, element("figcaption", {}, column.name, element("span", { class: "time" }, ` ${range}${column.unit ? ` ${column.unit}` : ""}`)), plot);
}
