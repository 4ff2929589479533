// The page as a whole: its toolbar, its theme, its keys, and the mark that everything was drawn.

function drawToolbar() {
  const pick = (label, id, names, value, act) => (names.length < 2 ? null : element("span", { class: "choice" },
    element("label", { for: id }, label), element("select", { id, onchange: (e) => act(Number(e.target.value)) },
      ...names.map((name, i) => element("option", { value: i, selected: i === value }, name)))));
  const two = contents.versions.length > 1;
  const toggle = two ? element("span", { class: "toggle", role: "group", "aria-label": "Model before or after; key B" },
    ...contents.versions.map((name, i) => element("button", { type: "button", "data-version": i, onclick: () => chooseVersion(i) }, name)),
    element("kbd", {}, "B")) : null;
  document.getElementById("page").append(element("nav", { class: "toolbar", "aria-label": "What is shown" },
    pick("axis", "axis", contents.axes.map((a) => a.name), chosen.axis, (axis) => choose({ axis, region: null, cycle: 0 })),
    pick("record", "record", contents.records.map((r) => `${r.file} (${role(r)})`), chosen.record, (record) => choose({ record, cycle: 0 })),
    toggle, element("button", { type: "button", class: "theme", onclick: switchTheme }, "light / dark")));
  follow(["version"], () => document.querySelectorAll("[data-version]").forEach((b) =>
    b.setAttribute("aria-pressed", String(Number(b.dataset.version) === chosen.version))));
}

/** Shows a version; a region of the other one gives way to the one of its kind. */
function chooseVersion(version) {
  const old = contents.regions[chosen.region];
  const same = old ? contents.regions.findIndex((r) => r.version === version && r.axis === old.axis && r.kind === old.kind) : -1;
  choose({ version, region: same < 0 ? null : same });
}

function switchTheme() {
  const dark = document.documentElement.dataset.theme || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  document.documentElement.dataset.theme = dark === "dark" ? "light" : "dark";
  redraw();
}

function listenToPage() {
  document.addEventListener("keydown", (event) => {
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName);
    if (event.key.toLowerCase() !== "b" || typing || event.ctrlKey || event.metaKey || event.altKey) return;
    if (contents.versions.length > 1) chooseVersion(1 - chosen.version);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  let width = document.documentElement.clientWidth;
  window.addEventListener("resize", () => {
    if (document.documentElement.clientWidth === width) return;
    width = document.documentElement.clientWidth;
    redraw();
  });
  let theme;
  window.addEventListener("beforeprint", () => {
    theme = document.documentElement.dataset.theme;
    document.documentElement.dataset.theme = "light";
    redraw();
  });
  window.addEventListener("afterprint", () => {
    if (theme) document.documentElement.dataset.theme = theme;
    else delete document.documentElement.dataset.theme;
    redraw();
  });
}

window.addEventListener("error", (event) => { document.documentElement.dataset.error = event.message; });
document.addEventListener("securitypolicyviolation", (event) => { document.documentElement.dataset.error = `refused: ${event.violatedDirective}`; });
[drawHeading, drawToolbar, drawErrors, drawModel, drawTime, drawLoops, drawPlane, drawResidual, drawCandidates, drawResponse, drawHandling]
  .forEach((draw) => draw());
listenToPage();
redraw();
document.documentElement.dataset.drawn = "all";
