// The model of the chosen axis as an equation, with values, units and intervals.

function drawModel() {
  const body = section("model", "The model", "The restoring force as a sum; intervals cover the true value in 95 of 100 such experiments.");
  const show = () => {
    const axis = contents.axes[chosen.axis];
    const words = axis.models[chosen.version];
    const parts = [element("p", { class: "equation" }, "r", element("sub", {}, axis.name), words.equation.slice(words.equation.indexOf(" = ")))];
    if (words.terms.length) {
      const rows = words.terms.flatMap((term) => term.values.map((value, i) => [
        i ? "" : term.name, i ? "" : term.law, value.symbol, value.meaning,
        `${significant(value.value, 4)}${unitText(value.unit)}`, intervalText(value)]));
      parts.push(table("Terms and values", ["term", "law", "symbol", "meaning", "value", "95 % interval"], rows));
    }
    words.notes.forEach((note) => parts.push(element("pre", { class: "note" }, note)));
    body.replaceChildren(...parts);
  };
  follow(["axis", "version"], show);
}

function unitText(unit) {
  return !unit || unit === "–" ? "" : ` ${unit}`;
}

function intervalText(value) {
  if (!value.interval) return "unknown";
  return `${value.interval.map((v) => significant(v, 4)).join(" to ")}${unitText(value.unit)}`;
}
