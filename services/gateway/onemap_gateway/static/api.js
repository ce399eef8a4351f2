// Requests to the gateway; every failure becomes a ProblemError with a sentence for the user.

const TIMEOUT_MS = 8000;
const TOKEN = /^[!-~]*$/; // as the configuration allows
const NO_TOKEN = "A token has letters, digits and signs of ASCII only, and no space in it: copy it once more.";
// Of a robot behind a gateway of several, such as "/robots/r1"; empty for the gateway's own.
export const BASE = location.pathname.match(/^\/robots\/[^/]+/)?.[0] ?? "";

export class ProblemError extends Error {
  constructor(problem, status) {
    super(problem.detail || problem.title || `The gateway answered ${status}.`);
    this.problem = problem;
    this.status = status;
  }
}

let asking = null; // the open question for the token, one for all requests that wait for it
let declined = false; // what nobody pressed a button for does not ask again
let reading = new AbortController(); // ends all requests of the page itself

// A request of the user: asks for the token if it is missing, wrong, or may not do that.
export async function send(method, path, body, timeoutMs = TIMEOUT_MS) {
  return (await checked(await allowed(() => attempt(method, path, body, BASE, timeoutMs), true))).json();
}

// End a search. A browser opens six connections to a gateway: those of the page itself are freed.
export function stop(id) {
  reading.abort();
  reading = new AbortController();
  return send("DELETE", `/v1/searches/${id}`);
}

// A request of the page itself.
export async function read(path) {
  return (await load(path)).json();
}

// What the gateway says of all its robots.
export async function readAll(path) {
  return (await checked(await allowed(() => attempt("GET", path, undefined, "", TIMEOUT_MS, reading.signal), false))).json();
}

// The image at `path`, or the answer to a POST of `body`, and the headers of the response.
export async function fetchImage(path, body) {
  const response = await load(path, body);
  return { bitmap: await createImageBitmap(await response.blob()), headers: response.headers };
}

// The bytes at `path`, for an element that cannot send the token itself.
export async function fetchBlob(path) {
  return (await load(path)).blob();
}

// What a WebSocket sends in place of the header: the token as a subprotocol.
export function protocols() {
  const token = sessionStorage.getItem("token");
  if (!token) return ["onemap.live"];
  const encoded = btoa(token).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
  return ["onemap.live", `onemap.token.${encoded}`];
}

async function load(path, body) {
  return checked(await allowed(() => attempt(body ? "POST" : "GET", path, body, BASE, TIMEOUT_MS, reading.signal), false));
}

async function allowed(request, wanted) {
  const token = sessionStorage.getItem("token");
  const response = await request();
  const refused = response.status === 401 || (wanted && (await mayNot(response)));
  if (!refused || (declined && !wanted)) return response;
  const others = sessionStorage.getItem("token") !== token; // given while this request ran
  if (!others && !(await askForToken())) return response;
  return request();
}

// Whether the token is of a role that may not do this; a page of another site is refused too.
async function mayNot(response) {
  if (response.status !== 403) return false;
  const problem = await response.clone().json().catch(() => ({}));
  return String(problem.type).endsWith("#problem-forbidden");
}

async function attempt(method, path, body, base = BASE, timeoutMs = TIMEOUT_MS, ended = undefined) {
  const headers = {};
  const token = sessionStorage.getItem("token");
  if (token) headers.Authorization = `Bearer ${token}`;
  if (body !== undefined) headers["Content-Type"] = "application/json";
  try {
    return await fetch(base + path, {
      method,
      headers,
      body: body === undefined ? undefined : JSON.stringify(body),
      signal: AbortSignal.any([AbortSignal.timeout(timeoutMs), ...(ended ? [ended] : [])]),
    });
  } catch {
    if (ended?.aborted) throw new ProblemError({ detail: "This was given up to stop the robot first: try again." }, 0);
    throw new ProblemError({ detail: "The gateway cannot be reached." }, 0);
  }
}

async function checked(response) {
  if (response.ok) return response;
  const problem = await response.json().catch(() => ({}));
  throw new ProblemError(problem, response.status);
}

function askForToken() {
  asking ??= question().finally(() => {
    asking = null;
  });
  return asking;
}

function question() {
  const dialog = document.getElementById("token-dialog");
  const field = document.getElementById("token");
  field.value = "";
  field.setCustomValidity("");
  dialog.returnValue = "cancel";
  // What cannot be in a header never leaves the page.
  field.oninput = () => field.setCustomValidity(TOKEN.test(field.value.trim()) ? "" : NO_TOKEN);
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener(
      "close",
      () => {
        const given = dialog.returnValue === "use" && field.value.trim();
        if (given) sessionStorage.setItem("token", given);
        declined = !given;
        resolve(Boolean(given));
      },
      { once: true },
    );
  });
}
