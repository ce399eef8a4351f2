// The documentation, made from /openapi.json: each operation with an example to paste.

import { element } from "./panels.js";

const openapi = await (await fetch("/openapi.json")).json();
const article = document.getElementById("document");
const contents = document.getElementById("contents");

const resolve = (schema) =>
  schema?.$ref ? openapi.components.schemas[schema.$ref.split("/").pop()] : (schema ?? {});
const anchor = (method, path) => `${method}-${path.replace(/[^a-z0-9]+/gi, "-")}`;

article.replaceChildren(element("h1", { text: `${openapi.info.title} API` }));
article.append(...prose(openapi.info.description));
for (const tag of openapi.tags) {
  article.append(element("h2", { text: tag.description }));
  contents.append(element("h2", { text: tag.description }));
  for (const [path, methods] of Object.entries(openapi.paths)) {
    for (const [method, operation] of Object.entries(methods)) {
      if (!operation.tags?.includes(tag.name)) continue;
      article.append(describe(method, path, operation));
      contents.append(link(`#${anchor(method, path)}`, `${method.toUpperCase()} ${path}`));
    }
  }
}
article.append(element("h2", { text: "Problems" }), problems());
contents.append(link("#problems", "Problems"));
if (location.hash) location.replace(location.hash); // its target exists only now

function describe(method, path, operation) {
  const section = element("section", { className: "operation" });
  section.id = anchor(method, path);
  const title = element("h3", {}, [
    element("code", { className: `method ${method}`, text: method.toUpperCase() }),
    element("code", { text: path }),
    element("span", { text: operation.summary ?? "" }),
  ]);
  section.append(title, ...prose(operation.description ?? ""));
  const fields = [...parameters(operation), ...bodyFields(operation)];
  if (fields.length) section.append(element("h4", { text: "Takes" }), table(fields));
  section.append(element("h4", { text: "Try it" }), code(curl(method, path, operation), true));
  const answer = example(operation.responses["200"] ?? operation.responses["201"]);
  if (answer) section.append(element("h4", { text: "Answers" }), code(pretty(answer)));
  section.append(element("h4", { text: "Responses" }), table(responses(operation)));
  return section;
}

function parameters(operation) {
  return (operation.parameters ?? []).map((parameter) => [
    element("code", { text: parameter.name }),
    kind(parameter.schema),
    parameter.description ?? parameter.schema.description ?? "",
  ]);
}

function bodyFields(operation) {
  const schema = resolve(operation.requestBody?.content?.["application/json"]?.schema);
  return Object.entries(schema.properties ?? {}).map(([name, field]) => [
    element("code", { text: name }),
    kind(field),
    fieldWords(field),
  ]);
}

function fieldWords(field) {
  const inner = (field.anyOf ?? []).find((option) => option.description || option.items);
  return field.description ?? inner?.description ?? inner?.items?.description ?? "";
}

function kind(schema) {
  const options = (schema.anyOf ?? [schema]).filter((option) => option.type !== "null");
  const words = options.map((option) =>
    option.type === "array" ? `list of ${option.items?.type ?? "values"}` : (option.type ?? "value"),
  );
  const fallback = schema.default ?? null;
  return words.join(" or ") + (fallback === null ? "" : `, default ${fallback}`);
}

function responses(operation) {
  return Object.entries(operation.responses).map(([status, response]) => [
    element("code", { text: status }),
    Object.keys(response.content ?? {}).join(", "),
    response.description === "Successful Response" ? "" : words(response.description),
  ]);
}

function curl(method, path, operation) {
  const address = location.origin + path.replace(/\{[^}]+\}/g, "current");
  const text = (operation.parameters ?? []).find((parameter) => parameter.name === "text");
  const parts = ["curl"];
  const types = Object.keys((operation.responses["200"] ?? {}).content ?? {});
  if (types.includes("text/event-stream")) parts.push("-N");
  if (types.some((type) => /image|octet/.test(type))) parts.push(`-o ${path.split("/").pop()}`);
  if (method !== "get") parts.push(`-X ${method.toUpperCase()}`);
  const body = example(operation.requestBody);
  if (body) parts.push("-H 'Content-Type: application/json'", `-d '${JSON.stringify(body)}'`);
  parts.push(text ? `'${address}?text=sofa'` : address);
  return parts.join(" ");
}

function example(part) {
  const schema = part?.content?.["application/json"]?.schema;
  return resolve(schema)?.examples?.[0];
}

function problems() {
  const body = table(
    Object.entries(openapi["x-problems"]).map(([name, problem]) => [
      element("code", { text: String(problem.status) }),
      element("code", { text: name }),
      problem.title,
    ]),
  );
  body.id = "problems";
  body.className = "problems";
  [...body.rows].forEach((row) => {
    row.id = `problem-${row.cells[1].textContent}`;
  });
  return body;
}

function table(rows) {
  const body = element("table");
  for (const cells of rows) {
    const row = body.insertRow();
    for (const cell of cells) row.insertCell().append(cell);
  }
  return body;
}

function code(text, copies = false) {
  const block = element("pre", {}, [element("code", { text })]);
  if (copies && navigator.clipboard) {
    const button = element("button", { text: "Copy" });
    button.addEventListener("click", async () => {
      await navigator.clipboard.writeText(text);
      button.textContent = "Copied";
    });
    block.append(button);
  }
  return block;
}

function pretty(value) {
  return JSON.stringify(value, null, 2);
}

function link(target, text) {
  const node = element("a", { text });
  node.href = target;
  return node;
}

// Paragraphs, lists and `code` of the descriptions: all the Markdown that they use.
function prose(text) {
  return text.trim().split(/\n\s*\n/).filter(Boolean).map((block) => {
    if (!block.startsWith("- ")) return element("p", {}, inline(block));
    const items = block.split(/\n- /).map((item) => item.replace(/^- /, ""));
    return element("ul", {}, items.map((item) => element("li", {}, inline(item))));
  });
}

function words(text) {
  return element("span", {}, inline(text));
}

function inline(text) {
  return text.split("`").map((part, index) => (index % 2 ? element("code", { text: part }) : part));
}
