// The stage: what the report draws, with the force over time always in sight and the rest in tabs below it.

import { act, read, refuse } from "./talk.js";
import { commandList } from "./history.js";
import { modelTable } from "./models.js";
import { showDraft } from "./draft.js";
import { showLong } from "./long.js";

const TABS = [["where", "Where it fails"], ["candidates", "What is missing"], ["loops", "Loops"], ["residual", "Residual"],
  ["correlations", "Is it noise?"], ["errors", "Errors"], ["model", "Equation"], ["models", "Models"], ["data", "Data"], ["commands", "Commands"]];

let state = null;
let drawn = null;
let tab = "where";
let busy = Promise.resolve();

/** Shows what a state says is to be seen. */
export function showStage(next) {
  const before = state;
  state = next;
  const view = state.view;
  if (!view) {
    if (state.opened !== "study") drawn = null;
    if (!drawn) waiting(before);
    return;
  }
  if (drawn && drawn.key === view.key) {
    renewLists();
    return;
  }
  busy = busy.then(() => change(view)).catch((error) => refuse(error.message));
}

/** Draws another view; where a model was added to or an addition taken back, the plots move. */
async function change(view) {
  if (state.view.key !== view.key || (drawn && drawn.key === view.key)) return;
  const next = await read(`api/view/${view.key}`);
  const back = drawn && drawn.beside && drawn.beside === view.model && !view.beside;
  if (back && chosen.version === 1) {
    stageTop();
    chooseVersion(0);
    await new Promise((done) => setTimeout(done, MOVE_MS + 80));
  }
  const on = drawn && view.beside && view.beside === drawn.model;
  const first = !contents;
  const fresh = !drawn;
  drawn = view;
  openContents(next);
  if (next.candidates.length) tab = "candidates";
  else if (tab === "candidates") tab = "where";
  if (on) Object.assign(chosen, { version: 0, from: 0 });
  draw();
  if (first) listenToPage();
  if (fresh) document.documentElement.dataset.drawn = "all";
  document.documentElement.dataset.view = String(view.key);
  document.dispatchEvent(new CustomEvent("drawn"));
  if (next.candidates.length && !fresh && !back) openTab("candidates", true);
  if (!on) return;
  stageTop();
  requestAnimationFrame(() => chooseVersion(1));
}

/** Where the force and the residual are in sight. */
function stageTop() {
  const stage = document.getElementById("stage");
  stage.scrollTo({ top: 0 });
  // Where the rail stands above the stage the whole page scrolls.
  if (document.scrollingElement.scrollHeight > innerHeight) stage.scrollIntoView({ block: "start" });
}

function draw() {
  const stage = document.getElementById("stage");
  const scrolled = stage.scrollTop;
  const page = document.getElementById("page");
  delete page.dataset.key;
  page.replaceChildren();
  page.append(element("p", { class: "answer" }, contents.answer));
  Object.assign(timeLook, { force: 150, residual: 130, twice: false });
  [drawToolbar, drawTime, drawPlane, drawCandidates, drawLoops, drawResidual, drawErrors, drawModel, drawResponse, drawHandling].forEach((one) => one());
  section("models", "Models side by side", "Errors of every model in this folder. Show one, or lay it beside the one on the stage.");
  section("commands", "Commands", "What was done here, as it is typed in the study's folder.");
  addButtons();
  tabs();
  renewLists();
  openTab(tab);
  stage.scrollTop = scrolled;
}

/** What follows the state and not the view. */
function renewLists() {
  const fill = (id, parts) => {
    const body = document.querySelector(`#${id} .body`);
    if (body) body.replaceChildren(...parts);
  };
  fill("models", modelTable(state, drawn));
  fill("commands", commandList(state));
}

/** Beside the words of the chosen candidate: the button that adds it. */
function addButtons() {
  const words = document.querySelector("#candidates .words");
  if (!words) return;
  follow(["candidate"], () => {
    const candidate = contents.candidates[chosen.candidate];
    words.prepend(element("button", { type: "button", class: "primary add", onclick: () => act({ do: "add", effects: addable(candidate.name, state) }) },
      `Add ${candidate.name}`));
  });
}

/** A candidate as `add` takes it: once per axis where it was found on both. */
export function addable(name, { study }) {
  const [effect, axis] = name.split("@");
  if (study.effects.includes(effect)) return [effect];
  return axis === "both" ? study.axes.map((a) => `${effect}@${a.name}`) : [name];
}

function tabs() {
  const present = TABS.filter(([id]) => document.getElementById(id));
  const list = element("div", { class: "tabs", role: "tablist", "aria-label": "Views of the model" },
    ...present.map(([id, words]) => element("button", { type: "button", role: "tab", id: `tab-${id}`, "aria-controls": id, onclick: () => openTab(id) }, words)));
  list.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1, Home: -present.length, End: present.length }[event.key];
    if (!step) return;
    event.preventDefault();
    const at = present.findIndex(([id]) => id === tab);
    const to = Math.abs(step) > 1 ? (step < 0 ? 0 : present.length - 1) : (at + step + present.length) % present.length;
    openTab(present[to][0]);
    document.getElementById(`tab-${tab}`).focus();
  });
  document.getElementById("time").after(list);
  for (const [id] of present) {
    const panel = document.getElementById(id);
    panel.setAttribute("role", "tabpanel");
    panel.setAttribute("aria-labelledby", `tab-${id}`);
  }
}

/** Opens a tab; what is in it is drawn now that it has a width. `come`: asked for from elsewhere, so it is brought into sight. */
export function openTab(id, come = false) {
  if (!document.getElementById(id)) return;
  if (!document.getElementById(`tab-${id}`)) {
    // A stage without tabs has its parts below one another.
    document.getElementById(id).scrollIntoView();
    return;
  }
  tab = id;
  for (const [other] of TABS) {
    const panel = document.getElementById(other);
    if (!panel) continue;
    panel.hidden = other !== id;
    const own = document.getElementById(`tab-${other}`);
    own.setAttribute("aria-selected", String(other === id));
    own.tabIndex = other === id ? 0 : -1;
  }
  const response = document.getElementById("response");
  if (response) response.hidden = id !== "errors";
  redraw();
  const own = document.getElementById(`tab-${id}`);
  own.parentElement.scrollTo({ left: own.offsetLeft - own.parentElement.offsetLeft - 60 });
  // The plots over time take their height only after this.
  if (come) requestAnimationFrame(() => own.parentElement.scrollIntoView({ block: "start" }));
}

/** What stands on the stage while there is nothing to draw. */
function waiting(before) {
  const page = document.getElementById("page");
  if (state.opened === "long") {
    showLong(state, page);
    return;
  }
  const key = JSON.stringify([state.opened, state.study, state.sentence, state.logs, state.drafted, state.opened === "missing" && state.revision]);
  if (before && page.dataset.key === key) return;
  page.dataset.key = key;
  delete document.documentElement.dataset.drawn;
  if (state.opened === "reading") page.replaceChildren(element("p", { class: "hint wait" }, "Reading the study and its records…"));
  else if (state.opened === "missing") showDraft(state, page, () => page.dataset.key === key);
  else if (state.opened === "wrong") {
    page.replaceChildren(element("section", { class: "wrong" }, element("h2", {}, "The study could not be read"),
      element("p", { class: "sentence" }, `${state.sentence}.`),
      element("button", { type: "button", class: "primary", onclick: () => act({ do: "reopen" }) }, "Read it again")));
  } else page.replaceChildren(welcome());
}

const KINDS = [["physical", "Physical", "The sum of the effects that the study lists, each with value, unit and interval."],
  ["polynomial", "Polynomial", "Powers and products of displacement and velocity; takes a second and needs no physics."],
  ["network", "Network", "A small tanh network; the lowest error for a smooth joint, a few seconds to minutes."]];

/** The kinds of model that a study can have: the physical one where it lists effects, the others where there are velocities. */
export function kinds(study) {
  return KINDS.filter(([kind]) => (kind === "physical" ? study.base_terms.length > 0 : study.sample_rate_hz !== null));
}

/** A study without a model. */
function welcome() {
  return element("section", { class: "welcome" }, element("h2", {}, "Choose a first model"),
    element("p", { class: "hint" }, "It is learnt from the training records and judged on the validation records."),
    element("div", { class: "cards" }, ...kinds(state.study).map(([kind, name, words]) => element("button", { type: "button", class: "card",
      onclick: () => act({ do: "identify", kind }) }, element("strong", {}, name), element("span", {}, words)))));
}
