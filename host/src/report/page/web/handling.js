// What was done to the data: channels, filters, corrections, dropped rows, warnings.

function drawHandling() {
  const body = section("data", "What was done to the data");
  const { channels, filters, reason, corrections, notes, problems, warnings, checks, remarks } = contents.handling;
  const lists = [["The data are at fault or doubtful", problems, "problem"], ["The study may be wrong", checks, "problem"],
    ["Warnings", warnings, "warning"], ["Said by the search", remarks, ""],
    ["Corrected in the study's data", corrections, ""], ["Said by the reader of the logs", notes, ""]];
  for (const [heading, sentences, kind] of lists) {
    if (!sentences.length) continue;
    body.append(element("h3", {}, heading), element("ul", { class: `sentences ${kind}` }, ...sentences.map((s) => element("li", {}, s))));
  }
  if (channels.length) body.append(table("Channels", ["axis", "channel", "column", "unit", "calibration"], channels));
  body.append(table("Filters", ["what", "how much"], filters), element("p", { class: "hint" }, `Chosen because: ${reason}.`));
}
