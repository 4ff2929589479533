// Elements of the page: made from code, never from text, so that a name out of a file stays a name.

/** An element with attributes (on… are handlers) and children (strings become text). */
function element(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) {
    if (value === undefined || value === null || value === false) continue;
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (key === "text") made.textContent = value;
    else made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

/** An SVG element; children as above. */
function vector(name, attributes, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/** A section of the page with a heading, a line that says what to look for, and a place for its plots. */
function section(id, title, hint) {
  const body = element("div", { class: "body" });
  const made = element("section", { id, "aria-labelledby": `${id}-title` },
    element("h2", { id: `${id}-title` }, title), hint ? element("p", { class: "hint" }, hint) : null, body);
  document.getElementById("page").append(made);
  return body;
}

/** A table; cells that are numbers with a unit stand to the right. */
function table(caption, heading, rows) {
  const cell = (text) => element("td", /^[−-]?[\d.]/.test(text) ? { class: "number" } : {}, text);
  return element("div", { class: "scrolled", tabindex: "0", role: "region", "aria-label": caption },
    element("table", {}, element("caption", {}, caption),
      element("thead", {}, element("tr", {}, ...heading.map((h) => element("th", { scope: "col" }, h)))),
      element("tbody", {}, ...rows.map((row) => element("tr", {}, ...row.map(cell))))));
}

/** A picture with its caption, which also says to a screen reader what is drawn. */
function figure(caption, ...parts) {
  return element("figure", {}, element("figcaption", {}, caption), ...parts);
}
