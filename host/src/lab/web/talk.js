// Talking to the server: the token out of the address, requests, and news as they come.

// The part behind # is not sent with requests, so it stands in no log; a header carries it.
const token = location.hash.slice(1);

/** A request; an answer that refuses becomes an error with its sentence. */
async function ask(path, options = {}) {
  let answer;
  try {
    answer = await fetch(path, { ...options, headers: { ...options.headers, "X-Jointwatch-Token": token } });
  } catch {
    throw Object.assign(new Error("The lab does not answer; it was ended, or is busy. Start jointwatch lab again."), { away: true });
  }
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => ({}));
  throw Object.assign(new Error(told.sentence || `The lab answered ${answer.status}`), { code: answer.status });
}

export const read = async (path) => (await ask(path)).json();

/** Asks for an action; what is wrong with it is shown on the page. */
export async function act(action) {
  try {
    await ask("api/do", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(action) });
    refuse("");
  } catch (error) {
    refuse(error.message);
  }
}

/** Looks at a device, or at none. */
export async function look(place) {
  try {
    await ask("api/live", place ? { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(place) } : { method: "DELETE" });
    refuse("");
  } catch (error) {
    refuse(error.message);
  }
}

/** Calls `hear` with every server-sent event until `signal` aborts. An EventSource could not send the token's header. */
export async function followLive(hear, signal) {
  while (!signal.aborted) {
    try {
      const reader = (await ask("api/live", { signal })).body.pipeThrough(new TextDecoderStream()).getReader();
      let rest = "";
      for (;;) {
        const { done, value } = await reader.read();
        if (done) break;
        const parts = (rest + value).split("\n\n");
        rest = parts.pop();
        for (const part of parts) hear(JSON.parse(part.slice("data: ".length)));
      }
    } catch (error) {
      if (signal.aborted) return;
      refuse(error.message);
      if (error.code === 401) return;
      await new Promise((done) => setTimeout(done, 2000));
    }
  }
}

/** Sends a dropped file. */
export const send = (file) => ask(`api/log/${encodeURIComponent(file.name)}`, { method: "PUT", body: file });

/** Fetches a file and hands it to the browser to keep. */
export async function keep(what) {
  try {
    const answer = await ask(`api/download/${what}`);
    const name = /filename="([^"]*)"/.exec(answer.headers.get("Content-Disposition") || "");
    const url = URL.createObjectURL(await answer.blob());
    const link = document.createElement("a");
    Object.assign(link, { href: url, download: name ? name[1] : what });
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  } catch (error) {
    refuse(error.message);
  }
}

/** Shows a sentence that says why something was not done; an empty one takes it away. */
export function refuse(sentence) {
  const place = document.getElementById("refused");
  place.hidden = !sentence;
  place.textContent = sentence && `${sentence[0].toUpperCase()}${sentence.slice(1).replace(/[.?]?$/, (end) => end || ".")}`;
}

let held = null;
let letGo = null;
document.addEventListener("pointerdown", (event) => {
  if (event.target.closest("button, a, label")) held ||= new Promise((done) => { letGo = done; });
}, true);
for (const end of ["pointerup", "pointercancel"]) {
  // The click comes after the button is let go, in the same turn.
  document.addEventListener(end, () => setTimeout(() => {
    letGo?.();
    held = letGo = null;
  }), true);
}

/** Waits while a button is held down: one that is drawn anew before it is let go would hear no click. */
export const released = () => held;

/** Calls `hear` with every new state. A page that has the newest waits for an answer and does nothing. */
export async function listen(hear) {
  let seen = 0;
  let away = false;
  for (;;) {
    try {
      const state = await read(`api/state/${seen}`);
      if (away) refuse("");
      away = false;
      await released();
      if (state.revision !== seen) hear(state);
      seen = state.revision;
    } catch (error) {
      if (error.code === 401) return refuse(error.message);
      refuse(error.message);
      away = true;
      seen = 0;
      await new Promise((done) => setTimeout(done, 2000));
    }
  }
}
