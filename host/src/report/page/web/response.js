// How the rig moves with the model in place of its joint: simulated and measured displacement over time.

function drawResponse() {
  if (!contents.responses.length) return;
  const body = section("response", "The rig with the model in place of the joint",
    `Simulated displacement beside ${contents.responses[0].against}. Drag to zoom, double-click to show all.`);
  let shown = 0;
  let plot = null;
  const pick = element("select", { id: "response-record", onchange: () => { shown = Number(pick.value); build(); } },
    ...contents.responses.map((r, i) => element("option", { value: i }, r.file)));
  const host = element("div", { class: "over-time", role: "img" });
  const words = element("p", { class: "hint" });
  body.append(element("div", { class: "controls" }, element("label", { for: "response-record" }, "record"), pick),
    legend(["measured", "measured"], ["model", "simulated"]), host, words);
  const build = () => {
    if (plot) plot.destroy();
    const axis = contents.axes[chosen.axis];
    const record = contents.responses[shown];
    const own = record.axes[chosen.axis];
    const [measured, simulated] = [unpack(own.measured), unpack(own.simulated)];
    const x = prefixed(axis.units.displacement, peak(measured));
    const scaled = (values) => Array.from(values, (v) => (Number.isFinite(v) ? v * x.factor : null));
    host.setAttribute("aria-label", `Simulated and measured displacement of ${axis.name} over time in ${record.file}`);
    words.textContent = own.rests ? "The axis is at rest in this record." : `NMSE of the displacement: ${significant(own.nmse_percent)} %.`;
    const style = { stroke: colour("muted"), grid: { stroke: colour("grid"), width: 1 }, ticks: { stroke: colour("grid"), width: 1 },
      font: `12px ${colour("font")}`, labelFont: `12px ${colour("font")}` };
    plot = new uPlot({
      width: host.clientWidth || 600, height: 260, legend: { show: false }, padding: [8, 10, 0, 0],
      scales: { x: { time: false } },
      axes: [{ ...style, label: "time (s)", size: 30, labelSize: 18 }, { ...style, label: `displacement of ${axis.name} (${x.unit})`, size: 58, labelSize: 22 }],
      series: [{}, { stroke: colour("measured"), width: 2.6, points: { show: false } }, { stroke: colour("model"), width: 1.2, points: { show: false } }],
    }, [Array.from(unpack(record.time)), scaled(measured), scaled(simulated)], host);
  };
  follow(["axis"], build);
}
