// Draws the contents of this file, and marks that everything was drawn.

window.addEventListener("error", (event) => { document.documentElement.dataset.error = event.message; });
document.addEventListener("securitypolicyviolation", (event) => { document.documentElement.dataset.error = `refused: ${event.violatedDirective}`; });
openContents(JSON.parse(document.getElementById("contents").textContent));
[drawHeading, drawToolbar, drawErrors, drawModel, drawTime, drawLoops, drawPlane, drawResidual, drawCandidates, drawResponse, drawHandling]
  .forEach((draw) => draw());
listenToPage();
redraw();
document.documentElement.dataset.drawn = "all";
