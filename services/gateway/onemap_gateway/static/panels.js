// The parts of the page that show text and numbers.

import { capital, duration, height, place, seconds, thing } from "./format.js";
import { blankThumbnail, paintThumbnail } from "./thumbnail.js";

const NOTICE_MS = 1500;

export function element(tag, { className = "", text = "", title = "" } = {}, children = []) {
  const node = document.createElement(tag);
  if (className) node.className = className;
  if (text) node.textContent = text;
  if (title) node.title = title;
  node.append(...children);
  return node;
}

// The name of a robot, after a dot of its colour on the map.
export function robotName({ name, colour }) {
  const node = element("b", { className: "finder", text: name });
  node.style.setProperty("--robot", `var(--${colour})`);
  return node;
}

export const by = (id) => document.getElementById(id);

// Scroll no further than is needed to see the node.
export function reveal(node) {
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  node.scrollIntoView({ block: "nearest", behavior: still ? "auto" : "smooth" });
}

// Replace the children only if their content has changed: else hovering and screen readers restart.
export function refill(node, shown, children) {
  const key = JSON.stringify(shown);
  if (node.dataset.shown === key) return;
  node.dataset.shown = key;
  node.replaceChildren(...children());
}

export function showServices(services) {
  const wrong = services.filter((service) => service.condition !== "ok");
  const worst = wrong.find((service) => service.condition === "down") ?? wrong[0];
  const summary = by("health-summary");
  summary.textContent = wrong.length > 1 ? `${wrong.length} problems` : worst ? `${worst.name} ${worst.condition}` : "all well";
  summary.className = `chip ${worst?.condition ?? "ok"}`;
  refill(by("services"), services.map((s) => [s.name, s.condition, s.problem]), () =>
    services.map((service) => {
      const chip = element("li", {
        className: service.condition,
        text: service.name,
        title: service.problem || `The ${service.name} is well.`,
      });
      chip.setAttribute("aria-label", `${service.name}: ${service.condition}. ${service.problem}`);
      return chip;
    }),
  );
}

const wrongSince = new Map(); // service name -> time at which its problem began

export function showNotices(state) {
  const wrong = state.services.filter((service) => lasts(service.name, service.problem));
  const notices = wrong.map((service) => [service.condition, service.name, service.problem]);
  const repeats = state.services.some((service) => service.problem === state.problem);
  if (lasts("map", state.problem) && !repeats) {
    notices.unshift(["degraded", "map", state.problem]);
  }
  refill(by("notices"), notices, () =>
    notices.map(([condition, name, problem]) =>
      element("li", { className: `notice ${condition}` }, [element("b", { text: name }), problem]),
    ),
  );
}

// Whether the problem lasts: a notice of a short one could not be read.
function lasts(name, problem) {
  if (!problem) {
    wrongSince.delete(name);
    return false;
  }
  if (!wrongSince.has(name)) wrongSince.set(name, performance.now());
  return performance.now() - wrongSince.get(name) >= NOTICE_MS;
}

// moves: whether the robot moves without a search, as when another program drives it
// starting: whether one was asked for, and not answered yet
// where(place): the room that holds it, in words
export function showSearch(search, moves, starting, where) {
  by("search-card").hidden = !search && !moves && !starting;
  document.body.classList.toggle("searching", Boolean(search?.active || moves));
  by("stop").hidden = !search?.active && !moves && !starting;
  by("search-moves").hidden = !moves;
  by("search-title").textContent = search ? searchTitle(search) : moves ? "The robot moves" : "A search is checked";
  by("search-title").title = by("search-title").textContent;
  if (!search) return;
  by("search-state").textContent = search.state.replaceAll("_", " ");
  by("search-state").className = `state ${search.state}`;
  by("search-understood").hidden = !search.understood;
  by("search-understood").textContent = `Understood as: ${search.understood}.`;
  by("search-reason").textContent = capital(search.reason);
  by("back").hidden = moves || search.active;
  showPassed(search.passed);
  by("again").hidden = moves || search.state !== "interrupted";
  by("search-numbers").textContent =
    `${duration(search.elapsed_s)} · ${search.path_length_m.toFixed(1)} m driven`;
  const rows = search.requests.map((request, index) => describe(search, request, index, where));
  refill(by("objects"), rows, () =>
    rows.map(([kind, name, note]) => {
      const words = element("span", { text: name });
      if (note) words.append(element("small", { text: note }));
      return element("li", { className: kind }, [words]);
    }),
  );
}

const PASSED = 3; // things left aside that are shown, the newest

function showPassed(passed = []) {
  const rows = passed.slice(-PASSED).reverse().map(({ position_m: at, reason }) => `Not the one at ${place(at)} m: ${reason}.`);
  refill(by("passed"), rows, () => rows.map((text) => element("li", { text })));
}

// What a search is about.
export function searchTitle({ kind, active, state, index, requests, place_m: goal }) {
  if (state === "returning") return "Returning to where it set out";
  if (kind === "go_to") return `${active ? "Driving" : "Drive"} to (${place(goal)})`;
  if (kind === "look_at") return `${active ? "Going to look" : "Look"} at (${place(goal)})`;
  return active ? `Looking for ${thing(requests[index])}` : `Search for ${requests.join("; ")}`;
}

// What the robot does, after "The robot is"; search: null if it is not known.
export function activity(search) {
  if (!search?.active) return "busy with another search";
  const title = searchTitle(search);
  return title[0].toLowerCase() + title.slice(1);
}

function describe(search, request, index, where) {
  const result = search.results[index]; // they are in the order of the request
  if (!result) {
    return [search.active && index === search.index ? "now" : "waiting", request, ""];
  }
  if (result.outcome !== "found") return [result.outcome, request, capital(result.reason)];
  const found = capital([where(result.position_m), `at ${place(result.position_m)} m`].filter(Boolean).join(", "));
  return ["found", request, `${found} · ${duration(result.duration_s)} · ${result.path_length_m.toFixed(1)} m`];
}

const UNCALIBRATED =
  "Not calibrated: these scores rank places, they are no probabilities, and “found” says little.";

// A list of regions for each answer. `shown`: the text whose heatmap is on the map. `actions`:
// onRegion and onAnswer take what was clicked, onWord the asked and the suggested word; find(region)
// is the found object that it is, if one is. An answer to a picture has it as `image`.
export function showAnswers(answers, shown, actions) {
  by("regions-card").hidden = !answers.length;
  by("regions-card").replaceChildren(
    ...answers.flatMap((answer) => [
      answerTitle(answer, shown, answers.length > 1 && !answer.refused && actions.onAnswer),
      ...(answer.understood ? [element("p", { className: "reason", text: `Understood as: ${answer.understood}.` })] : []),
      ...(answer.sentence ? [element("p", { className: "verdict", text: answer.sentence })] : []),
      ...(answer.calibrated === false ? [element("p", { className: "uncalibrated", text: UNCALIBRATED })] : []),
      element("ol", { className: "regions" }, answerRows(answer, actions)),
    ]),
  );
}

function answerTitle(answer, shown, onAnswer) {
  if (answer.image) return pictureTitle(answer.image);
  const text = answer.refused ? `“${answer.text}”` : capital(answer.request);
  if (!onAnswer) return element("h2", { className: "cut", text, title: text });
  const button = element("button", { className: "answer cut", text, title: "Show its heatmap" });
  button.type = "button";
  button.setAttribute("aria-pressed", String(answer.text === shown));
  button.addEventListener("click", () => onAnswer(answer));
  return element("h2", {}, [button]);
}

function pictureTitle(image) {
  const picture = element("img");
  picture.src = image;
  picture.alt = "Picture that was asked with";
  return element("h2", { className: "pictured" }, [picture, "Where is what it shows?"]);
}

const MARKS = { yes: "✓", no: "✗" };

// A region as people say where it is, then what was checked, then metres and score.
function regionRow(region, onRegion, find) {
  const facts = `${place(region.centre_m)} m${height(region.height_m)} · score ${region.score.toFixed(2)}`;
  const checked = (region.conditions ?? []).map(({ what, holds, evidence }) =>
    element("small", { className: `check ${holds}`, text: `${MARKS[holds] ?? "?"} ${what}${evidence && `: ${evidence}`}` }),
  );
  const words = element("span", { text: capital(region.where ?? "") }, [...checked, element("small", { text: facts })]);
  const button = element("button", { title: "Show it on the map" }, [
    element("span", { className: "rank", text: String(region.rank) }),
    words,
  ]);
  if (region.picture) button.append(photograph({ picture: region.picture, ...find }));
  button.type = "button";
  button.addEventListener("click", () => onRegion(region));
  return element("li", {}, [button]);
}

function photograph(find) {
  const canvas = blankThumbnail(find);
  paintThumbnail(canvas, find).then((there) => there || canvas.remove());
  return canvas;
}

function answerRows(answer, { onRegion, onWord, find }) {
  const name = answer.request || "thing in the picture";
  const rows = answer.regions.map((region) => regionRow(region, onRegion, find(region) ?? { name }));
  if (!rows.length) {
    const text = capital(answer.message) + (answer.refused ? "" : " “Go and find” explores further.");
    rows.push(element("li", { className: "none", text }));
  }
  for (const word of answer.near ?? []) {
    const button = element("button", { className: "word", text: `Ask for “${word}”` });
    button.type = "button";
    button.addEventListener("click", () => onWord(answer.text, word));
    rows.push(element("li", {}, [button]));
  }
  return rows;
}

// How long frames took of late from the gateway to the map and to the command.
function latencyFacts(latencies) {
  const shown = [["map", "image to map"], ["command", "image to command"]];
  return shown.flatMap(([stage, label]) => {
    const timed = latencies.find((each) => each.stage === stage);
    if (!timed) return [];
    return [[label, `${timed.p50_s.toFixed(2)} s, 95 % in ${timed.p95_s.toFixed(2)} s`, false]];
  });
}

export function showFacts(map, latencies = []) {
  const fresh = by("freshness");
  fresh.hidden = !map;
  if (map) {
    const age = map.age_s === null ? "map empty" : `map ${seconds(map.age_s)} old`;
    fresh.textContent = `${age} · ${map.rate_hz.toFixed(1)} updates/s`;
    fresh.classList.toggle("old", map.age_s > 5 || map.rate_hz < 1);
  }
  const facts = map
    ? [
        ["map update", `${map.update_ms.toFixed(0)} ms`, false],
        ["frames", map.frames_fused.toLocaleString("en"), false],
        ["cells", map.cells_observed.toLocaleString("en"), false],
        ...latencyFacts(latencies),
        ["encoder", map.encoder_id || "–", false],
      ]
    : [["map", "none yet", true]];
  refill(by("facts"), facts, () =>
    facts.map(([name, value, old]) =>
      element("div", {}, [
        element("dt", { text: name }),
        element("dd", { text: value, className: old ? "old" : "", title: value }),
      ]),
    ),
  );
}

export function showError(text) {
  by("error").hidden = !text;
  by("error").textContent = text;
  if (text) reveal(by("error"));
}
