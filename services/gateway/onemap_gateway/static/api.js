// Requests to the gateway; every failure becomes a ProblemError with a sentence for the user.

const TIMEOUT_MS = 8000;

export class ProblemError extends Error {
  constructor(problem, status) {
    super(problem.detail || problem.title || `The gateway answered ${status}.`);
    this.problem = problem;
    this.status = status;
  }
}

export async function send(method, path, body) {
  const response = await attempt(method, path, body);
  if (response.status !== 401) return checked(response);
  if (!(await askForToken())) return checked(response);
  return checked(await attempt(method, path, body));
}

// The image at `path` and the headers of the response.
export async function fetchImage(path) {
  const response = await checked(await attempt("GET", path), true);
  return { bitmap: await createImageBitmap(await response.blob()), headers: response.headers };
}

async function attempt(method, path, body) {
  const headers = {};
  const token = sessionStorage.getItem("token");
  if (token) headers.Authorization = `Bearer ${token}`;
  if (body !== undefined) headers["Content-Type"] = "application/json";
  try {
    return await fetch(path, {
      method,
      headers,
      body: body === undefined ? undefined : JSON.stringify(body),
      signal: AbortSignal.timeout(TIMEOUT_MS),
    });
  } catch {
    throw new ProblemError({ detail: "The gateway cannot be reached: is it running?" }, 0);
  }
}

async function checked(response, raw = false) {
  if (response.ok) return raw ? response : response.json();
  const problem = await response.json().catch(() => ({}));
  throw new ProblemError(problem, response.status);
}

function askForToken() {
  const dialog = document.getElementById("token-dialog");
  const field = document.getElementById("token");
  field.value = "";
  dialog.returnValue = "cancel";
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener(
      "close",
      () => {
        const given = dialog.returnValue === "use" && field.value;
        if (given) sessionStorage.setItem("token", field.value);
        resolve(Boolean(given));
      },
      { once: true },
    );
  });
}
