// Models side by side: what each is made of, how wrong it is, and which to look at.

import { act } from "./talk.js";

/** The error of a model on an axis. */
export const errorOn = (model, axis) => (model.errors.find((e) => e.axis === axis) || {}).relative_error;

/** A table of all models, the newest first. */
export function modelTable(state, drawn) {
  const axes = state.study ? state.study.axes.map((a) => a.name) : [];
  if (!state.models.length) return [element("p", { class: "hint" }, "There are no models yet.")];
  const best = new Map(axes.map((axis) => [axis, Math.min(...state.models.map((m) => errorOn(m, axis) ?? Infinity))]));
  const idle = !state.job;
  const row = (model) => {
    const current = model.file === state.current;
    const beside = drawn && drawn.beside === model.file;
    const show = element("button", { type: "button", class: "small", disabled: current || !idle, "aria-label": `Show ${model.stem}`,
      onclick: () => act({ do: "show", model: model.file }) }, "show");
    const lay = element("button", { type: "button", class: "small", disabled: current || beside || !idle, "aria-label": `Lay ${model.stem} beside`,
      onclick: () => act({ do: "show", model: state.current, beside: model.file }) }, "beside");
    return element("tr", current ? { class: "current", "aria-current": "true" } : {},
      element("th", { scope: "row" }, model.stem, current ? element("span", { class: "tag" }, "on stage") : beside ? element("span", { class: "tag" }, "beside") : null),
      element("td", {}, made(model)),
      ...axes.map((axis) => {
        const error = errorOn(model, axis);
        return element("td", { class: `number${error === best.get(axis) ? " best" : ""}` }, error === undefined ? "–" : percent(error));
      }),
      element("td", { class: "acts" }, show, lay));
  };
  return [element("div", { class: "scrolled", tabindex: "0", role: "region", "aria-label": "Models" }, element("table", { class: "models" },
    element("thead", {}, element("tr", {}, ...["model", "made of", ...axes.map((a) => `error of ${a}`), ""].map((h) => element("th", { scope: "col" }, h)))),
    element("tbody", {}, ...[...state.models].reverse().map(row)))),
  element("p", { class: "hint" }, "Relative error: RMS error over RMS force, on the validation records where there are any; the lowest is in bold.")];
}

/** What a model is made of, in a line. */
export function made(model) {
  const parts = model.base === "physical" ? [] : [model.base];
  return [...parts, ...model.effects].join(" + ") || "nothing";
}
