// Pictures of columns: the band between lowest and highest value of each part of time.

import { shown, unitOf } from "./units.js";

const make = (tag, attributes, ...children) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
};

export function rangeOf({ low, high }) {
  const lows = low.filter((v) => v !== null), highs = high.filter((v) => v !== null);
  return lows.length ? [Math.min(...lows), Math.max(...highs)] : null;
}

// Runs of parts with a value, each as the outline of its band.
function bands({ low, high }, width, height, [least, most]) {
  const flat = most > least ? 0 : 1, y = (v) => height - 1 - ((v - least + flat / 2) / (most - least + flat)) * (height - 2);
  const x = (k) => (k * width) / low.length, found = [];
  for (let k = 0; k < low.length; k++) {
    if (low[k] === null) continue;
    let end = k;
    while (end < low.length && low[end] !== null) end++;
    const parts = Array.from({ length: end - k }, (_, n) => k + n);
    const there = parts.map((n) => `${x(n).toFixed(1)} ${y(high[n]).toFixed(1)}L${x(n + 1).toFixed(1)} ${y(high[n]).toFixed(1)}`);
    const back = parts.reverse().map((n) => `${x(n + 1).toFixed(1)} ${y(low[n]).toFixed(1)}L${x(n).toFixed(1)} ${y(low[n]).toFixed(1)}`);
    found.push(`M${[...there, ...back].join("L")}Z`);
    k = end;
  }
  return found.join("");
}

export function spark(column) {
  const range = rangeOf(column), text = (value) => short(shown(value, column.unit || ""));
  const svg = make("svg", { viewBox: "0 0 120 26", class: "spark", role: "img", "aria-label": range ? `from ${text(range[0])} to ${text(range[1])}` : "no numbers", preserveAspectRatio: "none" });
  if (range) svg.append(make("path", { d: bands(column, 120, 26, range) }));
  return svg;
}

export const short = (value) => (Math.abs(value) >= 1e5 || (value && Math.abs(value) < 1e-3) ? value.toExponential(2) : String(Number(value.toPrecision(4))));

export function figure(plot, title) {
  const range = rangeOf(plot), text = (value) => short(shown(value, plot.unit || "")), box = document.createElement("figure"), caption = document.createElement("figcaption");
  box.className = "plot";
  caption.textContent = `${title}${plot.unit ? ` [${unitOf(plot.unit)}]` : ""}`;
  box.append(caption);
  if (!range) { caption.textContent += ": no numbers"; return box; }
  const begin = Date.parse(plot.start), whole = Math.max(Date.parse(plot.end) - begin, 1), svg = make("svg", { viewBox: "0 0 600 150", preserveAspectRatio: "none", role: "img", "aria-label": `${title}, from ${text(range[0])} to ${text(range[1])}` });
  for (const [from, to, what] of plot.marks) {
    const x = (600 * (Date.parse(from) - begin)) / whole, width = Math.max(2, (600 * (Date.parse(to) - Date.parse(from))) / whole);
    svg.append(make("rect", { x, y: 0, width, height: 150, class: "flaw" }, make("title", {})));
    svg.lastChild.firstChild.textContent = `${what}, ${from.slice(0, 16)} to ${to.slice(0, 16)}`;
  }
  svg.append(make("path", { d: bands(plot, 600, 150, range) }));
  const ends = (className, ...texts) => {
    const line = document.createElement("p");
    line.className = className;
    line.append(...texts.map((text) => Object.assign(document.createElement("span"), { textContent: text })));
    return line;
  };
  const day = (text) => text.slice(0, 16).replace("T", " ");
  const kinds = [...new Set(plot.marks.map(([, , what]) => what))];
  box.append(ends("ends", `highest ${text(range[1])}`), svg, ends("ends", day(plot.start), `lowest ${text(range[0])}`, day(plot.end)));
  if (kinds.length) box.append(ends("ends flawed", `marked: ${kinds.join(", ")}`));
  return box;
}
