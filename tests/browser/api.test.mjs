// What the page makes of the server's answers: node --test tests/browser/api.test.mjs
import assert from "node:assert/strict";
import { test } from "node:test";

globalThis.location = { pathname: "/secret/" };
const api = await import("../../thermal/plan/page/static/api.js");
const answers = (response) => { globalThis.fetch = async () => response; };
const cut = (status) => new Response(new ReadableStream({
  start(body) { body.enqueue(new TextEncoder().encode('{"revision": 3, "fin')); },
  pull(body) { body.error(new TypeError("network error")); },
}), { status });

test("an answer is its content", async () => {
  answers(new Response('{"revision": 3}'));
  assert.deepEqual(await api.send("api/draft"), { revision: 3 });
});

test("an answer that was cut off is none", async () => {
  answers(cut(200));
  await assert.rejects(api.send("api/draft"), (error) => error.status === 0 && error.refusal === "ServerGone");
});

test("a refusal keeps its sentence, and its status even where it was cut off", async () => {
  answers(new Response('{"error": "SessionHeldError", "message": "another window"}', { status: 409 }));
  await assert.rejects(api.send("api/draft"), (error) => error.status === 409 && error.refusal === "SessionHeldError" && error.message === "another window");
  answers(cut(409));
  await assert.rejects(api.send("api/draft"), (error) => error.status === 409);
});
