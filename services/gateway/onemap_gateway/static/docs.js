// Swagger UI of /openapi.json, and below it the problems that a `type` of /docs#problem-… names.

SwaggerUIBundle({
  url: "/openapi.json",
  dom_id: "#swagger-ui",
  validatorUrl: null, // it would send the document to a server elsewhere
  requestInterceptor(request) {
    const token = sessionStorage.getItem("token"); // where the live page keeps it
    if (token) request.headers.Authorization = `Bearer ${token}`;
    return request;
  },
  onComplete: listProblems,
});

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
