// The live page: passes states to the views and the user's requests to the gateway.

import { fetchImage, send } from "./api.js";
import { CameraView } from "./camera.js";
import { follow } from "./live.js";
import { MapView } from "./map.js";
import { by, showError, showFacts, showNotices, showRegions, showSearch, showServices } from "./panels.js";

const MAP_MS = 600; // between two images of the map
const SCALE = 4; // pixels per cell

const map = new MapView(by("map"));
const camera = new CameraView(by("camera"), by("camera-numbers"));
let state = null;
let connected = false;
let queried = ""; // text whose similarity is shown; empty: the current target
let dismissed = ""; // the target whose heatmap the user removed

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
  showHeatmapText();
}

function onConnection(up) {
  connected = up;
  by("lost").hidden = up;
  document.body.classList.toggle("stale", !up);
}

// Repeat a task, one run at a time, while the page is visible.
async function repeat(task, pauseMs) {
  for (;;) {
    if (connected && !document.hidden) await task().catch(() => {}); // the notices say what is wrong
    await new Promise((resolve) => setTimeout(resolve, pauseMs));
  }
}

let shownMap = "";
async function refreshMap() {
  const text = heatmapText();
  const wanted = `${state.map?.revision}/${text}`;
  if (!state.map || wanted === shownMap) return;
  const path = `/v1/map.png?marks=false&scale=${SCALE}`;
  const heated = `${path}&text=${encodeURIComponent(text)}`;
  // without perception there is no heatmap, but still a map
  const { bitmap, headers } = await (text ? fetchImage(heated).catch(() => fetchImage(path)) : fetchImage(path));
  map.showImage(bitmap, headers.get("X-OneMap-Bounds").split(",").map(Number));
  shownMap = wanted;
}

let shownFrame = -1;
async function refreshCamera() {
  if (!state.camera || state.camera.sequence === shownFrame) return;
  shownFrame = state.camera.sequence;
  const { bitmap } = await fetchImage("/v1/camera.jpg?detections=false");
  camera.showImage(bitmap);
  camera.show(state.camera);
}

function heatmapText() {
  const target = state?.search?.target ?? "";
  return queried || (target === dismissed ? "" : target);
}

function showHeatmapText() {
  const text = heatmapText();
  by("heat").hidden = !text;
  by("heat").textContent = text;
}

function names() {
  return by("text").value.split(",").map((name) => name.trim()).filter(Boolean);
}

// Run the task of a button; show the error if it fails.
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

function query() {
  return act(by("where"), async () => {
    const reply = await send("POST", "/v1/queries", { text: names()[0] ?? "" });
    queried = reply.text;
    showRegions(reply, (region) => map.lookAt(...region.centre_m), queryInstead);
    map.showRegions(reply.regions);
    showHeatmapText();
  });
}

function queryInstead(word) {
  by("text").value = word;
  return query();
}

function startSearch() {
  return act(by("find"), async () => {
    await send("POST", "/v1/searches", { objects: names() });
    clearResult();
    dismissed = "";
  });
}

function clearResult() {
  queried = "";
  showRegions(null);
  map.showRegions([]);
  showHeatmapText();
}

by("ask").addEventListener("submit", (event) => {
  event.preventDefault();
  query();
});
by("text").addEventListener("keydown", (event) => {
  if (event.key !== "Enter" || !event.shiftKey) return;
  event.preventDefault();
  startSearch();
});
by("find").addEventListener("click", startSearch);
by("stop").addEventListener("click", () =>
  act(by("stop"), () => send("DELETE", `/v1/searches/${state.search.id}`)),
);
by("heat").addEventListener("click", () => {
  if (!queried) dismissed = state.search?.target ?? "";
  clearResult();
});
by("zoom-in").addEventListener("click", () => map.zoom(1.4));
by("zoom-out").addEventListener("click", () => map.zoom(1 / 1.4));
by("zoom-fit").addEventListener("click", () => map.fit());
document.addEventListener("keydown", (event) => {
  if (event.key !== "/" || event.target instanceof HTMLInputElement) return;
  event.preventDefault();
  by("text").focus();
});
