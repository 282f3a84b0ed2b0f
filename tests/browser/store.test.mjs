// How the page saves where answers are lost: node --test tests/browser/store.test.mjs
import assert from "node:assert/strict";
import { test } from "node:test";

const kept = new Map();
globalThis.location = { pathname: "/secret/" };
globalThis.localStorage = { getItem: (k) => kept.get(k) ?? null, setItem: (k, v) => kept.set(k, v), removeItem: (k) => kept.delete(k) };
const { page, change, save, listen } = await import("../../thermal/plan/page/static/store.js");
const { windowName } = await import("../../thermal/plan/page/static/api.js");

// A server as `desk.py` is one: it saves what follows its revision, and says who saved last.
const server = { revision: 0, name: "", savedBy: "", cut: false };
const answer = (content, status = 200) => new Response(JSON.stringify(content), { status });
globalThis.fetch = async (url, options) => {
  if (!options) return answer({ draft: { revision: server.revision }, saved_by: server.savedBy });
  const sent = JSON.parse(options.body);
  if (sent.revision !== server.revision) return answer({ error: "SessionHeldError", message: "another revision" }, 409);
  Object.assign(server, { revision: server.revision + 1, name: sent.name, savedBy: windowName });
  if (server.cut) { server.cut = false; throw new TypeError("network error"); }
  return answer({ revision: server.revision, written: true, findings: [], zones: {}, telemetry: "" });
};

const lost = [];
listen((what) => { if (what.lost) lost.push(what.lost); });

function begin() {
  Object.assign(server, { revision: 0, name: "", savedBy: "" });
  page.mode = "edit";
  page.draft = { name: "house", revision: 0, seconds: 0, floors: [], devices: [], site: {}, glazing: {} };
}

test("a save that came and whose answer was lost is followed by the next one", async () => {
  begin();
  server.cut = true;
  change("name", { name: "first" });
  await save();
  assert.deepEqual([page.saved, server.revision, server.name], ["trouble", 1, "first"]);
  change("name", { name: "second" });
  await save();
  assert.deepEqual([page.saved, page.mode, server.revision, server.name], ["saved", "edit", 2, "second"]);
  assert.deepEqual(lost, []);
});

test("what another window has saved meanwhile is not overwritten", async () => {
  begin();
  server.cut = true;
  change("name", { name: "first" });
  await save();
  Object.assign(server, { revision: 2, name: "theirs", savedBy: "another" });
  change("name", { name: "second" });
  await save();
  assert.deepEqual([page.mode, server.revision, server.name], ["read", 2, "theirs"]);
  assert.equal(lost.length, 1);
});
