// Quantities as people read them: units with fitting prefixes, few digits, ticks in steps of 1, 2 and 5.

/** Unit with a prefix that suits values up to `peak`, and what an SI value is multiplied by. */
function prefixed(unit, peak) {
  if (peak >= 5e3) return { unit: "k" + unit, factor: 1e-3 };
  if (peak >= 0.1 || peak === 0) return { unit, factor: 1 };
  if (peak >= 1e-4) return { unit: "m" + unit, factor: 1e3 };
  return { unit: "µ" + unit, factor: 1e6 };
}

/** A number with so many significant digits and a minus that is no hyphen. */
function significant(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const exponent = Math.floor(Math.log10(size));
  let text;
  if (exponent >= 6 || exponent < -4) {
    const [mantissa, power] = size.toExponential(digits - 1).split("e");
    const raised = [...String(Number(power))].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] || "⁻").join("");
    text = `${mantissa}·10${raised}`;
  } else {
    text = size.toFixed(Math.max(0, digits - 1 - exponent));
  }
  return (value < 0 ? "−" : "") + text;
}

/** A ratio in percent. */
function percent(ratio, digits = 3) {
  return `${significant(100 * ratio, digits)} %`;
}

/** About `count` round numbers between two values; at least two, without which an axis has no scale. */
function ticks(low, high, count) {
  const rough = (high - low) / Math.max(1, count);
  const decade = 10 ** Math.floor(Math.log10(rough));
  const steps = [10, 5, 2, 1, 0.5, 0.2].map((s) => s * decade);
  const coarse = Math.max(0, steps.filter((s) => s >= rough).length - 1);
  let made = [];
  let step = rough;
  for (let finer = coarse; finer < steps.length && made.length < 2; finer += 1) {
    step = steps[finer];
    made = [];
    for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n += 1) made.push(n * step);
  }
  return { values: made, decimals: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

/** A tick's number. */
function tickText(value, decimals) {
  const text = Math.abs(value).toFixed(Math.min(decimals, 9));
  return (value < 0 && Number(text) !== 0 ? "−" : "") + text;
}

/** The largest magnitude in some series. */
function peak(...series) {
  let most = 0;
  for (const one of series) for (const value of one) most = Math.max(most, Math.abs(value) || 0);
  return most;
}

/** Smallest and largest value of some series, with a little room. */
function limits(room, ...series) {
  let low = Infinity;
  let high = -Infinity;
  for (const one of series) {
    for (const value of one) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (!(high > low)) return Number.isFinite(low) ? [low - 1, low + 1] : [-1, 1];
  return [low - room * (high - low), high + room * (high - low)];
}
