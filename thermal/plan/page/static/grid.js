// Plans as grids of cells: pure functions, no page. A floor is never changed, only replaced.
// A cell is a number in the floor's legend; the first three are outside, exterior wall and interior wall.

export const OUTSIDE = 0, EXTERIOR = 1, INTERIOR = 2, FIRST_ZONE = 3;
export const BASIC = [".", "#", "+"];
const SIDES = [[-1, 0], [0, 1], [1, 0], [0, -1]];
const AROUND = [...SIDES, [-1, -1], [-1, 1], [1, -1], [1, 1]];

export function decodeFloor(floor) {
  const { runs, ...rest } = floor;
  const cells = new Int32Array(floor.rows * floor.columns);
  for (let i = 0, at = 0; i < runs.length; i += 2) {
    cells.fill(runs[i], at, at + runs[i + 1]);
    at += runs[i + 1];
  }
  return { ...rest, legend: [...floor.legend], cells };
}

export function encodeFloor(floor) {
  const { cells, ...rest } = floor;
  const runs = [];
  for (let i = 0; i < cells.length;) {
    let j = i + 1;
    while (j < cells.length && cells[j] === cells[i]) j++;
    runs.push(cells[i], j - i);
    i = j;
  }
  return { ...rest, runs };
}

export function emptyFloor(name, height, rows, columns) {
  return { name, height, rows, columns, legend: [...BASIC], cells: new Int32Array(rows * columns), drawing: null, picture: null };
}

export function at(floor, row, column) {
  const inside = row >= 0 && column >= 0 && row < floor.rows && column < floor.columns;
  return inside ? floor.cells[row * floor.columns + column] : OUTSIDE;
}

export function zoneAt(floor, row, column) {
  const cell = at(floor, row, column);
  return cell >= FIRST_ZONE ? floor.legend[cell] : null;
}

// The zone at a point, or the nearest one within so many cells.
export function snapZone(floor, x, y, reach = 3) {
  const row = Math.floor(y), column = Math.floor(x);
  let best = zoneAt(floor, row, column), distance = Infinity;
  if (best) return best;
  for (let r = row - reach; r <= row + reach; r++) {
    for (let c = column - reach; c <= column + reach; c++) {
      const zone = zoneAt(floor, r, c), d = Math.hypot(r + 0.5 - y, c + 0.5 - x);
      if (zone && d < distance) [best, distance] = [zone, d];
    }
  }
  return best;
}

export function freeName(floors, floor) {
  const taken = new Set(floors.flatMap((f) => f.legend));
  for (let n = 1; ; n++) {
    const name = `${floor.name}_R${String(n).padStart(2, "0")}`;
    if (!taken.has(name)) return name;
  }
}

// Cells of a line, side by side; straight unless it is let be free.
export function line(from, to, free = false) {
  let [r, c] = from;
  let [r1, c1] = to;
  if (!free) {
    if (Math.abs(r1 - r) > Math.abs(c1 - c)) c1 = c; else r1 = r;
  }
  const found = [[r, c]];
  const rows = Math.abs(r1 - r), columns = Math.abs(c1 - c);
  for (let i = 0, j = 0; i < rows || j < columns;) {
    if (j >= columns || (i < rows && (i + 0.5) * columns < (j + 0.5) * rows)) { r += Math.sign(r1 - r); i++; } else { c += Math.sign(c1 - c); j++; }
    found.push([r, c]);
  }
  return found;
}

function touchesOutside(floor, cells, r, c) {
  return AROUND.some(([dr, dc]) => {
    const y = r + dr, x = c + dc;
    return y < 0 || x < 0 || y >= floor.rows || x >= floor.columns || cells[y * floor.columns + x] === OUTSIDE;
  });
}

// Walls are exterior where the outside is beside them, interior elsewhere.
function settleWalls(floor, cells, places) {
  for (const [r, c] of places) {
    for (let y = Math.max(0, r - 1); y <= Math.min(floor.rows - 1, r + 1); y++) {
      for (let x = Math.max(0, c - 1); x <= Math.min(floor.columns - 1, c + 1); x++) {
        const i = y * floor.columns + x;
        if (cells[i] === EXTERIOR || cells[i] === INTERIOR) cells[i] = touchesOutside(floor, cells, y, x) ? EXTERIOR : INTERIOR;
      }
    }
  }
}

function inside(floor, places) {
  return places.filter(([r, c]) => r >= 0 && c >= 0 && r < floor.rows && c < floor.columns);
}

// Parts of a zone that hang together by their sides, largest first.
export function parts(floor, cells, number) {
  const seen = new Uint8Array(cells.length), found = [];
  for (let start = 0; start < cells.length; start++) {
    if (cells[start] !== number || seen[start]) continue;
    const part = [start];
    seen[start] = 1;
    for (let k = 0; k < part.length; k++) {
      const r = Math.floor(part[k] / floor.columns), c = part[k] % floor.columns;
      for (const [dr, dc] of SIDES) {
        const y = r + dr, x = c + dc, i = y * floor.columns + x;
        if (y >= 0 && x >= 0 && y < floor.rows && x < floor.columns && cells[i] === number && !seen[i]) { seen[i] = 1; part.push(i); }
      }
    }
    found.push(part);
  }
  return found.sort((a, b) => b.length - a.length);
}

// Give each further part of a zone a name of its own; small crumbs become wall.
function splitParts(floor, floors, cells, numbers) {
  const legend = [...floor.legend], born = [];
  for (const number of numbers) {
    for (const part of parts(floor, cells, number).slice(1)) {
      if (part.length < 2) { for (const i of part) cells[i] = INTERIOR; continue; }
      const name = freeName([...floors, { legend }], floor);
      legend.push(name);
      for (const i of part) cells[i] = legend.length - 1;
      born.push({ name, from: floor.legend[number] });
    }
  }
  return { floor: { ...floor, legend, cells }, born };
}

// Draw a wall through places; zones that it parts become several. Returns {floor, born}.
export function drawWall(floor, floors, places) {
  const cells = floor.cells.slice(), hit = new Set(), drawn = inside(floor, places);
  for (const [r, c] of drawn) {
    const i = r * floor.columns + c;
    if (cells[i] >= FIRST_ZONE) hit.add(cells[i]);
    cells[i] = INTERIOR;
  }
  settleWalls(floor, cells, drawn);
  return splitParts(floor, floors, cells, hit);
}

// Part the zone at a place by a straight wall through it, from one of its walls to the other.
export function splitZone(floor, floors, from, to) {
  const middle = [Math.round((from[0] + to[0]) / 2), Math.round((from[1] + to[1]) / 2)];
  const number = at(floor, ...middle);
  if (number < FIRST_ZONE) return null;
  const [dr, dc] = Math.abs(to[0] - from[0]) > Math.abs(to[1] - from[1]) ? [1, 0] : [0, 1];
  const places = [];
  for (const way of [1, -1]) {
    for (let [r, c] = middle; at(floor, r, c) === number; r += way * dr, c += way * dc) places.push([r, c]);
  }
  const result = drawWall(floor, floors, places);
  return result.born.length ? result : null;
}

// Take walls away: the zone where the stroke began takes them, or the one beside; an exterior wall becomes outside.
export function eraseWall(floor, places) {
  const cells = floor.cells.slice(), done = inside(floor, places);
  let taker = done.length ? at(floor, ...done[0]) : OUTSIDE;
  for (const [r, c] of done) {
    const i = r * floor.columns + c;
    if (cells[i] >= FIRST_ZONE) { taker = taker < FIRST_ZONE ? cells[i] : taker; continue; }
    if (cells[i] === OUTSIDE) continue;
    const beside = SIDES.map(([dr, dc]) => at({ ...floor, cells }, r + dr, c + dc)).filter((n) => n >= FIRST_ZONE);
    if (touchesOutside(floor, cells, r, c)) cells[i] = OUTSIDE;
    else cells[i] = beside.includes(taker) || !beside.length ? (taker >= FIRST_ZONE ? taker : cells[i]) : beside[0];
  }
  return { ...floor, cells };
}

// Draw a room: walls around, a new zone inside, other zones keep what is left of them.
export function drawRoom(floor, floors, from, to) {
  const [top, bottom] = [from[0], to[0]].sort((a, b) => a - b), [left, right] = [from[1], to[1]].sort((a, b) => a - b);
  if (bottom - top < 2 || right - left < 2) return null;
  const cells = floor.cells.slice(), legend = [...floor.legend], hit = new Set(), places = [];
  const name = freeName(floors, floor), number = legend.length;
  legend.push(name);
  for (let r = top; r <= bottom; r++) {
    for (let c = left; c <= right; c++) {
      if (r < 0 || c < 0 || r >= floor.rows || c >= floor.columns) return null;
      const i = r * floor.columns + c, edge = r === top || r === bottom || c === left || c === right;
      if (cells[i] >= FIRST_ZONE) hit.add(cells[i]);
      cells[i] = edge ? INTERIOR : number;
      if (edge) places.push([r, c]);
    }
  }
  settleWalls(floor, cells, places);
  const result = splitParts({ ...floor, legend }, floors, cells, hit);
  return { floor: result.floor, born: [{ name, from: null }, ...result.born] };
}

// Make a zone of an enclosed place. null: it is open to the outside, or a zone already.
export function fillZone(floor, floors, row, column) {
  const start = at(floor, row, column);
  if (start >= FIRST_ZONE || row < 0 || column < 0 || row >= floor.rows || column >= floor.columns) return null;
  const cells = floor.cells.slice(), legend = [...floor.legend], stack = [row * floor.columns + column];
  const name = freeName(floors, floor), number = legend.length, places = [];
  legend.push(name);
  cells[stack[0]] = number;
  while (stack.length) {
    const i = stack.pop(), r = Math.floor(i / floor.columns), c = i % floor.columns;
    if (r === 0 || c === 0 || r === floor.rows - 1 || c === floor.columns - 1) return null;
    places.push([r, c]);
    for (const [dr, dc] of SIDES) {
      const j = (r + dr) * floor.columns + c + dc;
      if (cells[j] === start) { cells[j] = number; stack.push(j); }
    }
  }
  settleWalls(floor, cells, places);
  return { floor: { ...floor, legend, cells }, born: [{ name, from: null }] };
}

// Make one zone of several that have walls in common; null when they do not hang together then.
export function mergeZones(floor, names) {
  const numbers = new Set(names.map((name) => floor.legend.indexOf(name)));
  const keep = floor.legend.indexOf(names[0]);
  const cells = floor.cells.slice();
  for (let grown = true; grown;) {
    grown = false;
    for (let r = 0, i = 0; r < floor.rows; r++) {
      for (let c = 0; c < floor.columns; c++, i++) {
        if (cells[i] !== INTERIOR) continue;
        const near = AROUND.map(([dr, dc]) => at({ ...floor, cells }, r + dr, c + dc));
        if (near.some((n) => n >= FIRST_ZONE && !numbers.has(n))) continue;
        const across = (a, b) => numbers.has(near[a]) && numbers.has(near[b]);
        if (across(0, 2) || across(1, 3)) { cells[i] = keep; grown = true; }
      }
    }
  }
  for (let i = 0; i < cells.length; i++) if (numbers.has(cells[i])) cells[i] = keep;
  return parts(floor, cells, keep).length === 1 ? { ...floor, cells } : null;
}

// Take zones off the plan: outside, and walls that bound nothing any more with them.
export function dropZones(floor, names) {
  const numbers = new Set(names.map((name) => floor.legend.indexOf(name)));
  const cells = floor.cells.slice(), places = [];
  for (let i = 0; i < cells.length; i++) {
    if (numbers.has(cells[i])) { cells[i] = OUTSIDE; places.push([Math.floor(i / floor.columns), i % floor.columns]); }
  }
  const lone = [];
  for (const [r, c] of places) {
    for (const [dr, dc] of AROUND) {
      const y = r + dr, x = c + dc, value = at({ ...floor, cells }, y, x);
      const bounds = AROUND.some(([a, b]) => at({ ...floor, cells }, y + a, x + b) >= FIRST_ZONE);
      if ((value === EXTERIOR || value === INTERIOR) && !bounds) lone.push(y * floor.columns + x);
    }
  }
  for (const i of lone) cells[i] = OUTSIDE;
  settleWalls(floor, cells, [...places, ...lone.map((i) => [Math.floor(i / floor.columns), i % floor.columns])]);
  return { ...floor, cells };
}

export function renameZone(floor, from, to) {
  const target = floor.legend.indexOf(to);
  if (target >= 0) {
    const used = floor.cells.includes(target);
    if (used || target < FIRST_ZONE) return null;
    const legend = [...floor.legend];
    legend[target] = from;
    legend[floor.legend.indexOf(from)] = to;
    return { ...floor, legend };
  }
  return { ...floor, legend: floor.legend.map((name) => (name === from ? to : name)) };
}

// Move a plan over its grid; null when something would fall off it.
export function shiftFloor(floor, rows, columns) {
  const cells = new Int32Array(floor.cells.length);
  for (let r = 0; r < floor.rows; r++) {
    for (let c = 0; c < floor.columns; c++) {
      const value = floor.cells[r * floor.columns + c], y = r + rows, x = c + columns;
      if (value === OUTSIDE) continue;
      if (y < 0 || x < 0 || y >= floor.rows || x >= floor.columns) return null;
      cells[y * floor.columns + x] = value;
    }
  }
  const picture = floor.picture && { ...floor.picture, matrix: floor.picture.matrix.map((m, k) => (k === 4 ? m + columns : k === 5 ? m + rows : m)) };
  return { ...floor, cells, picture };
}

// Put all floors on a larger grid.
export function growFloor(floor, margin) {
  const rows = floor.rows + 2 * margin, columns = floor.columns + 2 * margin;
  const cells = new Int32Array(rows * columns);
  for (let r = 0; r < floor.rows; r++) cells.set(floor.cells.subarray(r * floor.columns, (r + 1) * floor.columns), (r + margin) * columns + margin);
  const picture = floor.picture && { ...floor.picture, matrix: floor.picture.matrix.map((m, k) => (k >= 4 ? m + margin : m)) };
  return { ...floor, rows, columns, cells, picture };
}

// Words and numbers of a name, without leading zeros, so that "VAV-01.03" and "vav_1_3" are the same.
export function key(name) {
  const words = name.replace(/([a-zäöüß])([A-Z])/g, "$1 $2").toLowerCase().match(/[^\W\d_]+|\d+/gu) || [];
  return words.map((word) => (/^\d/.test(word) ? word.replace(/^0+(?=\d)/, "") : word)).join(" ");
}
