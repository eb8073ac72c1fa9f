// What is asked of the service, with which token, and whether it answers.

class Refused extends Error {
  constructor(status, words) {
    super(words);
    this.status = status;
  }
}

/** What kept an answer away; `then` is what to do about silence. */
const reason = (error, then = "") => error instanceof Refused ? error.message : "The service does not answer" + then + ".";

const TOKEN = "isotherm-token";

/** The token of the address bar is kept for this tab, and taken out of the bar. */
function takeToken() {
  const found = location.hash.match(/^#token=([\w-]+)/);
  if (!found) return false;
  sessionStorage.setItem(TOKEN, found[1]);
  history.replaceState(null, "", location.pathname + "#/");
  return true;
}

/** Asks; `body` is sent as JSON. Gives the answer, or throws: Refused with the service's words, else nobody answers. */
async function request(path, body, signal) {
  const limit = AbortSignal.timeout(12000);
  const options = {
    headers: { Authorization: "Bearer " + (sessionStorage.getItem(TOKEN) ?? "") },
    signal: signal ? AbortSignal.any([signal, limit]) : limit,
  };
  if (body !== undefined) {
    options.method = "POST";
    options.headers["Content-Type"] = "application/json";
    options.body = JSON.stringify(body);
  }
  const answer = await fetch("/api/" + path, options);
  if (answer.ok) return answer;
  const said = await answer.text();
  let words = said;
  try { words = JSON.parse(said).error ?? said; } catch { /* not of the console: as it is */ }
  throw new Refused(answer.status, words.trim() || "the service answers with " + answer.status);
}

const ask = async (path, body, signal) => (await request(path, body, signal)).json();
const unitPath = (serial, rest) => "unit/" + encodeURIComponent(serial) + (rest ? "/" + rest : "");

/** Saves an answer as a file. */
async function download(path, name) {
  const file = await (await request(path)).blob();
  const link = document.createElement("a");
  link.href = URL.createObjectURL(file);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** Calls `look` every so many milliseconds, one at a time, until the signal; not while nobody sees the page. */
async function watch(every, signal, look) {
  while (!signal.aborted) {
    if (document.visibilityState === "visible") await look();
    await pause(every, signal);
  }
}

function pause(ms, signal) {
  return new Promise(resolve => {
    const done = () => {
      clearTimeout(timer);
      signal.removeEventListener("abort", done);
      document.removeEventListener("visibilitychange", done);
      resolve();
    };
    const timer = setTimeout(done, ms);
    signal.addEventListener("abort", done);
    document.addEventListener("visibilitychange", done);
  });
}
