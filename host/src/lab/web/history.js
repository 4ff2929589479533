// Commands: the one that runs or ran last at the foot of the page, and all of them with what they printed.

import { act } from "./talk.js";
import { openTab } from "./stage.js";

let clock = null;
let last = "";

/** The foot of the page. */
export function showCommand(state) {
  const foot = document.querySelector("footer.command");
  clearInterval(clock);
  const { job } = state;
  const ran = state.done[state.done.length - 1];
  foot.classList.toggle("running", Boolean(job));
  const copy = (text) => element("button", { type: "button", class: "small", "aria-label": "Copy the command",
    onclick: () => navigator.clipboard.writeText(text) }, "copy");
  if (job) {
    const begun = Date.now() - 1000 * job.seconds;
    const time = element("span", { class: "time" });
    const tick = () => { time.textContent = `${Math.floor((Date.now() - begun) / 1000)} s`; };
    tick();
    clock = setInterval(tick, 1000);
    foot.replaceChildren(element("span", { class: "pulse", "aria-hidden": "true" }), element("code", {}, `$ ${job.command}`),
      element("span", { class: "said" }, job.said), time,
      element("button", { type: "button", class: "small", id: "cancel", onclick: () => act({ do: "cancel" }) }, "Cancel"));
    say(`${job.what}, running`);
    return;
  }
  if (!ran) {
    foot.replaceChildren(element("span", { class: "said" }, "Every action is a command; it is shown here."));
    return;
  }
  foot.replaceChildren(element("span", { class: ran.done ? "good" : "bad" }, ran.done ? "✓" : "✗"), element("code", {}, `$ ${ran.command}`),
    element("span", { class: "said" }, ran.done ? "" : ran.said.split("\n")[0]), element("span", { class: "time" }, seconds(ran)), copy(ran.command),
    element("button", { type: "button", class: "small", onclick: () => openTab("commands", true) }, "all commands"));
  say(`${ran.what}: ${ran.done ? "done" : ran.said}`);
}

const seconds = (ran) => `${ran.seconds < 10 ? ran.seconds.toFixed(1) : Math.round(ran.seconds)} s`;

/** Tells a screen reader, once. */
function say(text) {
  if (text !== last) document.getElementById("status").textContent = text;
  last = text;
}

/** All commands, the newest first. */
export function commandList(state) {
  const newest = [...state.done].reverse();
  if (!newest.length) return [element("p", { class: "hint" }, "Nothing was run yet.")];
  return newest.map((ran, i) => element("details", { class: "ran", open: i === 0 },
    element("summary", {}, element("span", { class: ran.done ? "good" : "bad" }, ran.done ? "✓ " : "✗ "), element("code", {}, ran.command),
      element("span", { class: "time" }, seconds(ran))),
    element("pre", { tabindex: "0" }, ran.said || "It printed nothing.")));
}
