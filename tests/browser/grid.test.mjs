// The model of the page without a page: node --test tests/browser/grid.test.mjs
import assert from "node:assert/strict";
import { test } from "node:test";
import * as grid from "../../thermal/plan/page/static/grid.js";
import { measure, trace } from "../../thermal/plan/page/static/shapes.js";

// A floor from rows of letters.
function floor(...rows) {
  const legend = [...grid.BASIC], cells = new Int32Array(rows.length * rows[0].length);
  rows.join("").split("").forEach((sign, k) => {
    if (!legend.includes(sign)) legend.push(sign);
    cells[k] = legend.indexOf(sign);
  });
  return { name: "F1", height: 3, rows: rows.length, columns: rows[0].length, legend, cells, drawing: null, picture: null };
}

// Rows of letters of a floor; new zones become 1, 2, ...
function spell(f) {
  const signs = f.legend.map((name) => (name.length === 1 ? name : name.replace("F1_R0", "")));
  return Array.from({ length: f.rows }, (_, r) => Array.from(f.cells.slice(r * f.columns, (r + 1) * f.columns), (n) => signs[n]).join(""));
}

const TWO = () => floor(".......", ".#####.", ".#A+B#.", ".#A+B#.", ".#A+B#.", ".#####.", ".......");
const ONE = () => floor(".........", ".#######.", ".#AAAAA#.", ".#AAAAA#.", ".#AAAAA#.", ".#######.", ".........");

test("a floor survives its runs", () => {
  const f = TWO();
  const again = grid.decodeFloor(JSON.parse(JSON.stringify(grid.encodeFloor(f))));
  assert.deepEqual(spell(again), spell(f));
});

test("a wall through a zone parts it, and the larger part keeps the name", () => {
  const f = ONE(), { floor: drawn, born } = grid.drawWall(f, [f], [[2, 3], [3, 3], [4, 3]]);
  assert.deepEqual(spell(drawn), [".........", ".#######.", ".#1+AAA#.", ".#1+AAA#.", ".#1+AAA#.", ".#######.", "........."]);
  assert.deepEqual(born, [{ name: "F1_R01", from: "A" }]);
  assert.deepEqual(spell(f), spell(ONE())); // what was there is never changed
});

test("a wall that parts nothing leaves the zone whole", () => {
  const f = ONE(), { born } = grid.drawWall(f, [f], [[2, 3], [3, 3]]);
  assert.deepEqual(born, []);
});

test("a split goes from wall to wall whichever way it was drawn", () => {
  const f = ONE();
  assert.deepEqual(spell(grid.splitZone(f, [f], [3, 3], [4, 3]).floor)[3], ".#1+AAA#.");
  assert.equal(grid.splitZone(f, [f], [0, 0], [0, 3]), null); // outside
});

test("a merge opens the wall between two zones only", () => {
  const f = floor("#######", "#A+B+C#", "#A+B+C#", "#A+++C#", "#A+D+C#", "#######");
  const merged = grid.mergeZones(f, ["A", "B"]);
  assert.deepEqual(spell(merged), ["#######", "#AAA+C#", "#AAA+C#", "#A+++C#", "#A+D+C#", "#######"]);
  assert.equal(grid.mergeZones(f, ["A", "C"]), null);
});

test("merging what was split gives what was there", () => {
  const f = ONE(), { floor: parted } = grid.splitZone(f, [f], [3, 4], [4, 4]);
  assert.deepEqual(spell(grid.mergeZones(parted, ["A", "F1_R01"])), spell(f));
});

test("a room is drawn with its walls, exterior where the outside is", () => {
  const f = TWO(), { floor: drawn } = grid.drawRoom({ ...f, ...grid.growFloor(f, 3) }, [f], [4, 8], [8, 12]);
  const rows = spell(drawn);
  assert.equal(rows[6].slice(3), ".#A+B+111#".padEnd(10, "."));
  assert.equal(rows[4].slice(8, 13), "#####");
  assert.equal(grid.drawRoom(f, [f], [0, 0], [1, 1]), null);
});

test("an enclosed place becomes a zone, an open one does not", () => {
  const f = floor(".......", ".#####.", ".#A+.#.", ".#A+.#.", ".#####.", ".......");
  assert.deepEqual(spell(grid.fillZone(f, [f], 2, 4).floor)[3], ".#A+1#.");
  assert.equal(grid.fillZone(f, [f], 0, 0), null);
  assert.equal(grid.fillZone(f, [f], 2, 2), null);
});

test("zones that are dropped take their walls along", () => {
  assert.deepEqual(spell(grid.dropZones(TWO(), ["B"])), [".......", ".###...", ".#A#...", ".#A#...", ".#A#...", ".###...", "......."]);
});

test("an erased wall goes to the zone where the stroke began", () => {
  assert.deepEqual(spell(grid.eraseWall(TWO(), [[3, 2], [3, 3]]))[3], ".#AAB#.");
  assert.deepEqual(spell(grid.eraseWall(TWO(), [[3, 4], [3, 3]]))[3], ".#ABB#.");
  assert.deepEqual(spell(grid.eraseWall(TWO(), [[3, 1]]))[3], "..A+B#.");
});

test("a name can be given once", () => {
  assert.equal(grid.renameZone(TWO(), "A", "B"), null);
  assert.deepEqual(grid.renameZone(TWO(), "A", "lobby").legend, [...grid.BASIC, "lobby", "B"]);
  assert.equal(grid.renameZone({ ...TWO(), legend: [...grid.BASIC, "A", "B", "old"] }, "A", "old").legend[3], "old"); // no cell has it any more
});

test("a floor moves with its drawing, and never off its grid", () => {
  const f = { ...TWO(), picture: { matrix: [1, 0, 0, 1, 5, 6] } }, moved = grid.shiftFloor(f, 1, -1);
  assert.deepEqual(spell(moved)[2], "#####..");
  assert.deepEqual(moved.picture.matrix, [1, 0, 0, 1, 4, 7]);
  assert.equal(grid.shiftFloor(f, 2, 0), null);
  assert.deepEqual(grid.growFloor(f, 2).picture.matrix, [1, 0, 0, 1, 7, 8]);
});

test("a point snaps to the zone there, or the nearest one in reach", () => {
  assert.equal(grid.snapZone(TWO(), 2.5, 3.5), "A");
  assert.equal(grid.snapZone(TWO(), 3.9, 3.5, 2), "B");
  assert.equal(grid.snapZone(TWO(), 3.1, 3.5, 2), "A");
  assert.equal(grid.snapZone(TWO(), 0.5, 0.5, 1), null);
});

test("the innermost point of a zone lies in it", () => {
  const f = floor("########", "#AAAAAA#", "#A#####+", "#A#BBBB#", "#A#BBBB#", "########"), zones = measure(f);
  for (const [name, zone] of zones) assert.equal(grid.zoneAt(f, zone.row, zone.column), name);
  assert.equal(zones.get("A").cells, 9);
});

test("paths cover each cell once", () => {
  const { fills } = trace(TWO());
  const count = [...fills.values()].join("").matchAll(/h(\d+)v1/g);
  assert.equal([...count].reduce((sum, [, n]) => sum + Number(n), 0), 25);
});

test("lines are straight unless they are let be free, and hang together", () => {
  assert.deepEqual(grid.line([0, 0], [1, 3]), [[0, 0], [0, 1], [0, 2], [0, 3]]);
  const free = grid.line([0, 0], [3, 5], true);
  free.slice(1).forEach(([r, c], k) => assert.equal(Math.abs(r - free[k][0]) + Math.abs(c - free[k][1]), 1));
  assert.deepEqual(free.at(-1), [3, 5]);
});

test("names are the same whatever their signs and zeros", () => {
  assert.equal(grid.key("VAV-01.03"), grid.key("vav_1_3"));
  assert.notEqual(grid.key("R10"), grid.key("R1"));
});
