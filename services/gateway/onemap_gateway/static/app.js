// The live page: what comes in goes to the views, what the user asks goes to the gateway.

import { picture, send } from "./api.js";
import { CameraView } from "./camera.js";
import { follow } from "./live.js";
import { MapView } from "./map.js";
import { by, showError, showFacts, showNotices, showRegions, showSearch, showServices } from "./panels.js";

const MAP_MS = 600; // between two pictures of the map
const SCALE = 4; // pixels per cell: the heat is smooth, walls are crisp

const map = new MapView(by("map"));
const camera = new CameraView(by("camera"), by("camera-numbers"));
let state = null;
let connected = false;
let asked = ""; // whose similarity is shown; empty: that of the object now sought
let dismissed = ""; // the sought object whose heat map the user removed

follow(onState, onConnection);
repeat(refreshMap, MAP_MS);
repeat(refreshCamera, 100);

function onState(next) {
  state = next;
  map.show(state);
  showServices(state.services);
  showNotices(state);
  showSearch(state.search);
  showFacts(state.map);
  by("map-hint").hidden = state.map?.frames_fused > 0;
  if (state.camera) camera.show(state.camera);
  showHeat();
}

function onConnection(up) {
  connected = up;
  by("lost").hidden = up;
  document.body.classList.toggle("stale", !up);
}

// Run a task again and again, one at a time, while somebody looks.
async function repeat(task, pauseMs) {
  for (;;) {
    if (connected && !document.hidden) await task().catch(() => {}); // the notices say what is wrong
    await new Promise((resolve) => setTimeout(resolve, pauseMs));
  }
}

let shownMap = "";
async function refreshMap() {
  const text = heatText();
  const wanted = `${state.map?.revision}/${text}`;
  if (!state.map || wanted === shownMap) return;
  const path = `/v1/map.png?marks=false&scale=${SCALE}`;
  const warm = `${path}&text=${encodeURIComponent(text)}`;
  // without perception there is no heat, but still a map
  const { bitmap, headers } = await (text ? picture(warm).catch(() => picture(path)) : picture(path));
  map.showImage(bitmap, headers.get("X-OneMap-Bounds").split(",").map(Number));
  shownMap = wanted;
}

let shownFrame = -1;
async function refreshCamera() {
  if (!state.camera || state.camera.sequence === shownFrame) return;
  shownFrame = state.camera.sequence;
  const { bitmap } = await picture("/v1/camera.jpg?detections=false");
  camera.showImage(bitmap);
  camera.show(state.camera);
}

function heatText() {
  const target = state?.search?.target ?? "";
  return asked || (target === dismissed ? "" : target);
}

function showHeat() {
  const text = heatText();
  by("heat").hidden = !text;
  by("heat").textContent = text;
}

function names() {
  return by("text").value.split(",").map((name) => name.trim()).filter(Boolean);
}

// Run what a button means, and show the sentence if it fails.
async function act(button, task) {
  showError("");
  button.disabled = true;
  try {
    await task();
  } catch (problem) {
    showError(problem.message);
  } finally {
    button.disabled = false;
  }
}

function askWhere() {
  return act(by("where"), async () => {
    const reply = await send("POST", "/v1/queries", { text: names()[0] ?? "" });
    asked = reply.text;
    showRegions(reply, (region) => map.lookAt(...region.centre_m), askInstead);
    map.showRegions(reply.regions);
    showHeat();
  });
}

function askInstead(word) {
  by("text").value = word;
  return askWhere();
}

function goAndFind() {
  return act(by("find"), async () => {
    await send("POST", "/v1/searches", { objects: names() });
    clearAnswer();
    dismissed = "";
  });
}

function clearAnswer() {
  asked = "";
  showRegions(null);
  map.showRegions([]);
  showHeat();
}

by("ask").addEventListener("submit", (event) => {
  event.preventDefault();
  askWhere();
});
by("text").addEventListener("keydown", (event) => {
  if (event.key !== "Enter" || !event.shiftKey) return;
  event.preventDefault();
  goAndFind();
});
by("find").addEventListener("click", goAndFind);
by("stop").addEventListener("click", () =>
  act(by("stop"), () => send("DELETE", `/v1/searches/${state.search.id}`)),
);
by("heat").addEventListener("click", () => {
  if (!asked) dismissed = state.search?.target ?? "";
  clearAnswer();
});
by("zoom-in").addEventListener("click", () => map.zoom(1.4));
by("zoom-out").addEventListener("click", () => map.zoom(1 / 1.4));
by("zoom-fit").addEventListener("click", () => map.fit());
document.addEventListener("keydown", (event) => {
  if (event.key !== "/" || event.target instanceof HTMLInputElement) return;
  event.preventDefault();
  by("text").focus();
});
