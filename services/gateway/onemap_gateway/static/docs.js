// Swagger UI of /openapi.json, and below it the problems that a `type` of /docs#problem-… names.

const UNNAMED = [
  [".copy-to-clipboard button", "Copy"],
  ["textarea.body-param__text", "Body"],
  [".responses-table", "Answers"],
];

new MutationObserver(completeParts).observe(document.body, { childList: true, subtree: true });
SwaggerUIBundle({
  url: "/openapi.json",
  dom_id: "#swagger-ui",
  validatorUrl: null, // it would send the document to a server elsewhere
  syntaxHighlight: { theme: "tomorrow-night" }, // one with the contrast of WCAG AA
  requestInterceptor(request) {
    const token = sessionStorage.getItem("token"); // where the live page keeps it
    if (token) request.headers.Authorization = `Bearer ${token}`;
    return request;
  },
  plugins: [withHeading],
  onComplete: listProblems,
});

// A h2 before the requests: Swagger UI goes from its h1 to h3.
function withHeading({ React: { createElement, Fragment } }) {
  const heading = createElement("h2", { className: "requests" }, "Requests");
  const operations = (Original) => (props) =>
    createElement(Fragment, null, heading, createElement(Original, props));
  return { wrapComponents: { operations } };
}

// Names and keyboard focus that Swagger UI leaves out; it draws these parts when they are opened.
function completeParts() {
  for (const [selector, name] of UNNAMED) {
    for (const node of document.querySelectorAll(`${selector}:not([aria-label])`)) {
      const request = node.closest(".opblock")?.querySelector(".opblock-summary-path");
      node.ariaLabel = `${name}, ${request?.dataset.path ?? ""}`;
    }
  }
  for (const node of document.querySelectorAll(".microlight:not([tabindex])")) node.tabIndex = 0;
}

async function listProblems() {
  const openapi = await (await fetch("/openapi.json")).json();
  const table = document.getElementById("problems");
  for (const [name, problem] of Object.entries(openapi["x-problems"])) {
    const row = table.insertRow();
    row.id = `problem-${name}`;
    for (const text of [problem.status, name, problem.title]) row.insertCell().append(text);
  }
  if (location.hash) location.replace(location.hash); // its target exists only now
}
