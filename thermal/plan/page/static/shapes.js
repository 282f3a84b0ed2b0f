// What a plan looks like: where its zones are, and the paths that draw them. Pure functions, no page.

import { FIRST_ZONE, OUTSIDE, at } from "./grid.js";

// Zones in use: name -> {number, cells, row, column (innermost point), depth}
export function measure(floor) {
  const { rows, columns, cells, legend } = floor;
  const depth = new Int32Array(cells.length);
  const step = (i, other, far) => (other >= 0 && cells[other] === cells[i] ? depth[other] + far : far);
  for (let r = 0, i = 0; r < rows; r++) {
    for (let c = 0; c < columns; c++, i++) {
      if (cells[i] < FIRST_ZONE) continue;
      const left = c ? step(i, i - 1, 3) : 3, up = r ? step(i, i - columns, 3) : 3;
      const upLeft = r && c ? step(i, i - columns - 1, 4) : 4;
      const upRight = r && c < columns - 1 ? step(i, i - columns + 1, 4) : 4;
      depth[i] = Math.min(left, up, upLeft, upRight);
    }
  }
  const zones = new Map();
  for (let r = rows - 1, i = cells.length - 1; r >= 0; r--) {
    for (let c = columns - 1; c >= 0; c--, i--) {
      if (cells[i] < FIRST_ZONE) continue;
      const right = c < columns - 1 ? step(i, i + 1, 3) : 3, down = r < rows - 1 ? step(i, i + columns, 3) : 3;
      const downRight = r < rows - 1 && c < columns - 1 ? step(i, i + columns + 1, 4) : 4;
      const downLeft = r < rows - 1 && c ? step(i, i + columns - 1, 4) : 4;
      depth[i] = Math.min(depth[i], right, down, downRight, downLeft);
      const name = legend[cells[i]];
      let zone = zones.get(name);
      if (!zone) zones.set(name, zone = { number: cells[i], cells: 0, depth: 0, left: c, right: c, top: r, bottom: r, sumRow: 0, sumColumn: 0 });
      zone.cells++;
      zone.sumRow += r;
      zone.sumColumn += c;
      zone.left = Math.min(zone.left, c);
      zone.right = Math.max(zone.right, c);
      zone.top = Math.min(zone.top, r);
      zone.bottom = Math.max(zone.bottom, r);
      zone.depth = Math.max(zone.depth, depth[i]);
    }
  }
  // Of the innermost cells of a zone, the one nearest to its middle.
  for (let r = 0, i = 0; r < rows; r++) {
    for (let c = 0; c < columns; c++, i++) {
      if (cells[i] < FIRST_ZONE) continue;
      const zone = zones.get(legend[cells[i]]);
      if (depth[i] < zone.depth) continue;
      const d = Math.hypot(r - zone.sumRow / zone.cells, c - zone.sumColumn / zone.cells);
      if (zone.near === undefined || d < zone.near) Object.assign(zone, { near: d, row: r, column: c });
    }
  }
  for (const zone of zones.values()) {
    zone.depth /= 3;
    let a = zone.column, b = zone.column;
    while (a > 0 && cells[zone.row * columns + a - 1] === zone.number) a--;
    while (b < columns - 1 && cells[zone.row * columns + b + 1] === zone.number) b++;
    zone.x = (a + b + 1) / 2;
    zone.span = b - a + 1;
    let top = zone.row, bottom = zone.row;
    while (top > 0 && cells[(top - 1) * columns + zone.column] === zone.number) top--;
    while (bottom < rows - 1 && cells[(bottom + 1) * columns + zone.column] === zone.number) bottom++;
    const letters = 0.62 * legend[zone.number].length;
    zone.upright = bottom - top + 1 > 2 * zone.span && zone.span < 1.3 * letters; // too slim for its name: written upwards
    zone.y = zone.upright ? (top + bottom + 1) / 2 : zone.row + 0.5;
    if (zone.upright) [zone.x, zone.span] = [zone.column + 0.5, bottom - top + 1];
  }
  return zones;
}

// SVG paths of all cells of one number: filled runs, and the line around them.
export function trace(floor) {
  const { rows, columns, cells } = floor;
  const fills = new Map(), lines = new Map();
  const add = (map, key, text) => {
    const list = map.get(key);
    if (list) list.push(text); else map.set(key, [text]);
  };
  for (let r = 0; r < rows; r++) {
    for (let c = 0; c < columns;) {
      const value = cells[r * columns + c];
      let end = c + 1;
      while (end < columns && cells[r * columns + end] === value) end++;
      if (value !== OUTSIDE) add(fills, value, `M${c} ${r}h${end - c}v1h${c - end}z`);
      c = end;
    }
  }
  for (let r = 0; r <= rows; r++) {
    for (const side of [-1, 0]) {
      for (let c = 0; c < columns;) {
        const value = at(floor, r + side, c);
        const edge = (k) => at(floor, r + side, k) === value && at(floor, r - 1 - side, k) !== value;
        if (value < FIRST_ZONE || !edge(c)) { c++; continue; }
        let end = c + 1;
        while (end < columns && edge(end)) end++;
        add(lines, value, `M${c} ${r}h${end - c}`);
        c = end;
      }
    }
  }
  for (let c = 0; c <= columns; c++) {
    for (const side of [-1, 0]) {
      for (let r = 0; r < rows;) {
        const value = at(floor, r, c + side);
        const edge = (k) => at(floor, k, c + side) === value && at(floor, k, c - 1 - side) !== value;
        if (value < FIRST_ZONE || !edge(r)) { r++; continue; }
        let end = r + 1;
        while (end < rows && edge(end)) end++;
        add(lines, value, `M${c} ${r}v${end - r}`);
        r = end;
      }
    }
  }
  const joined = (map) => new Map([...map].map(([key, list]) => [key, list.join("")]));
  return { fills: joined(fills), lines: joined(lines) };
}
