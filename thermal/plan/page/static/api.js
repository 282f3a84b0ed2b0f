// What the page asks the server for; whatever is refused is an error with the library's name and sentence.

const base = location.pathname.replace(/[^/]*$/, "");
export const windowName = crypto.randomUUID();

export class Refused extends Error {
  constructor(status, name, message) {
    super(message);
    this.status = status;
    this.refusal = name;
  }
}

export function address(path, query = {}) {
  const text = new URLSearchParams(query).toString();
  return `${base}${path}${text ? `?${text}` : ""}`;
}

// An answer of which only the first part came, as when the page is left meanwhile, is none.
async function answer(request) {
  let response, content;
  try {
    response = await request;
    content = await response.json().catch((error) => { if (response.ok) throw error; return {}; });
  } catch {
    throw new Refused(0, "ServerGone", "The server does not answer. Is buildingmpc label still running? What you do is kept on this page.");
  }
  if (!response.ok) throw new Refused(response.status, content.error || "Error", content.message || response.statusText);
  return content;
}

export const get = (path, query) => answer(fetch(address(path, query)));
export const remove = (path) => answer(fetch(address(path, { window: windowName }), { method: "DELETE" }));

export function send(path, content = {}, { method = "POST", query = {}, keepalive = false } = {}) {
  const body = JSON.stringify(content);
  const headers = { "content-type": "application/json" };
  return answer(fetch(address(path, { window: windowName, ...query }), { method, body, headers, keepalive }));
}

export function upload(path, file) {
  return answer(fetch(address(path, { window: windowName, name: file.name }), { method: "POST", body: file }));
}

// Wait for a job; tell its progress; give its result or raise its error.
export async function job(started, told = () => {}, signal = null) {
  let state = started;
  while (state.state === "waiting" || state.state === "runs") {
    told(state);
    await new Promise((done) => setTimeout(done, 300));
    if (signal?.aborted) await send(`api/jobs/${started.number}/stop`);
    state = await get(`api/jobs/${started.number}`);
  }
  if (state.state === "failed") throw new Refused(400, state.error.error, state.error.message);
  if (state.state === "stopped") throw new Refused(0, "Stopped", "stopped");
  return state.result;
}
