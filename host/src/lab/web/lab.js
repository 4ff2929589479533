// The page's beginning: takes every new state and hands it to the parts that show it.

import { listen } from "./talk.js";
import { showRail } from "./rail.js";
import { showStage } from "./stage.js";
import { showCommand } from "./history.js";
import { switchLive } from "./live.js";

document.getElementById("old").remove();
document.querySelectorAll(".bar, .lab, .command").forEach((part) => { part.hidden = false; });
window.addEventListener("error", (event) => { document.documentElement.dataset.error = event.message; });
window.addEventListener("unhandledrejection", (event) => { document.documentElement.dataset.error = String(event.reason); });
document.addEventListener("securitypolicyviolation", (event) => { document.documentElement.dataset.error = `refused: ${event.violatedDirective}`; });

document.getElementById("to-live").addEventListener("click", switchLive);

listen((state) => {
  const name = state.study || state.long ? (state.study || state.long).name : state.opened === "missing" ? "New study" : "Jointwatch lab";
  document.getElementById("title").textContent = name;
  document.title = `${state.job ? "… " : ""}${name} – Jointwatch lab`;
  document.getElementById("folder").textContent = state.folder;
  showRail(state);
  showCommand(state);
  showStage(state);
});
