// The live page: passes states to the views and the user's requests to the gateway.

import { fetchImage, read, send, stop } from "./api.js";
import { CameraView } from "./camera.js";
import { showChoice } from "./choice.js";
import { follow } from "./live.js";
import { FindCard } from "./find_card.js";
import { Finds } from "./finds.js";
import { Fleet } from "./fleet.js";
import { History } from "./history.js";
import { MapView } from "./map.js";
import { Notifier } from "./notifier.js";
import { Maps } from "./maps.js";
import { activity, by, reveal, showAnswers, showError, showFacts, showNotices, showSearch, showServices } from "./panels.js";
import { listenForPictures } from "./pictures.js";
import { PlaceMenu } from "./place_menu.js";
import { Places } from "./places.js";
import { Replay } from "./replay.js";
import { Suggestions } from "./suggestions.js";

const MAP_MS = 600; // between two images of the map
const MOVED_MS = 1000; // after which a robot that moves without a search is moved by another program
const UNSTOPPED = "No search moves the robot: another program drives it, and has to stop it.";
const FINDS_MS = 500; // between two looks whether there are others
const SCALE = 4; // pixels per cell
const EDGE_PX = 14; // around what lies over the map, as in style.css
const TAGS_PX = 48; // the age of the map at its top
const NOTHING_TYPED = "Type what you are looking for, for example: sofa, kettle.";
const DESCRIPTION = /(^|[\s,])(something|anything|somewhere|(a |the )?(thing|things|place|furniture)) (to|for|that) \S/i;
const TYPED_MS = 400; // after the last key
const REFUSED = [409, 422]; // answers that concern one name, not all of them

const map = new MapView(by("map"), {
  onFind: (find) => card.show(find),
  onPlace: (place) => (places.corner ? endZone(place) : menu.show(place)),
  onMove: () => [menu, card].forEach((popup) => popup.follow()),
});
const places = new Places(map);
map.places = places;
const menu = new PlaceMenu(map, places);
const maps = new Maps(act, lostWithMap);
const suggestions = new Suggestions((name, button) => act(button, () => beginSearch(searchFor(name))));
const replay = new Replay(map, onReplay);
const history = new History(openReplay);
const fleet = new Fleet((robots) => {
  map.showRobots(robots);
  finds.showRows(); // the robots' names may have come after the finds
}, (role) => maps.allow(role));
const finder = (namespace) => fleet.finder(namespace);
const where = (place) => finds.words(place) || places.words(place);
const card = new FindCard(map, finder, where);
const finds = new Finds((find) => showFind(find), finder, where);
const phone = matchMedia("(max-width: 860px)"); // as in style.css
const light = matchMedia("(prefers-color-scheme: light)");
const camera = new CameraView(by("camera"), by("camera-numbers"));
let state = null;
let connected = false;
let queried = ""; // text whose similarity is shown; empty: the current target
let pictured = null; // the picture whose similarity is shown instead, as a data URL
const notifier = new Notifier();
let movedSince = Infinity; // when the robot began to move without a search
let dismissed = ""; // the target whose heatmap the user removed

fold();
phone.addEventListener("change", fold);
by("legend").addEventListener("toggle", leaveFree);
light.addEventListener("change", () => map.showTheme());
listenForPictures(queryPicture, act);
follow(onState, onConnection);
repeat(refreshMap, MAP_MS);
repeat(refreshFinds, FINDS_MS);
repeat(refreshCamera, 100);
repeat(async () => (await places.refresh(state.map ?? {})) && finds.showRows(), FINDS_MS);
repeat(() => history.refresh(state.search, finds.objects), FINDS_MS);

// A phone begins with the details folded; what the user unfolds stays.
function fold() {
  for (const details of document.querySelectorAll(".fold:not(.shut), #health")) details.open = !phone.matches;
  leaveFree();
}

// All of the map is shown between what lies over it.
function leaveFree() {
  const right = document.querySelector(".zoom").offsetWidth + 2 * EDGE_PX;
  const below = by(replay.isOpen && !phone.matches ? "replay" : "legend").offsetHeight;
  map.leaveFree({ top: TAGS_PX, right, bottom: below + 2 * EDGE_PX });
}

function onState(next) {
  state = next;
  map.show(state);
  showServices(state.services);
  showNotices(state);
  showTask();
  notifier.refresh(state.search);
  suggestions.refresh(state.search);
  showChoice(state.search);
  showFacts(state.map, state.latencies);
  by("map-hint").hidden = state.map?.frames_fused > 0;
  if (state.camera) camera.show(state.camera);
  showHeatmapText();
}

function showTask() {
  if (state) showSearch(state.search, movesByItself(), starting > 0, where);
}

// Whether another program moves the robot; for a moment it moves after each search, too.
function movesByItself() {
  if (state.search?.active || !state.robot?.moves) movedSince = Infinity;
  else movedSince = Math.min(movedSince, performance.now());
  return performance.now() - movedSince >= MOVED_MS;
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
  const theme = light.matches ? "light" : "dark";
  const wanted = [state.map?.revision, theme, pictured ?? text].join("/");
  if (!state.map || wanted === shownMap) return;
  const path = `/v1/map.png?marks=false&scale=${SCALE}&theme=${theme}`;
  // without perception there is no heatmap, but still a map
  const { bitmap, headers } = await heated(path, text).catch(() => fetchImage(path));
  map.showImage(bitmap, headers.get("X-OneMap-Bounds").split(",").map(Number));
  shownMap = wanted;
}

function heated(path, text) {
  if (pictured) return fetchImage(path, { image: pictured });
  return fetchImage(text ? `${path}&text=${encodeURIComponent(text)}` : path);
}

async function refreshFinds() {
  if (!(await finds.refresh(state.map?.objects_version))) return;
  map.showFinds(finds.objects);
  card.update(finds.objects);
}

function showFind(find) {
  replay.close();
  map.lookAt(...find.position_m);
  card.show(find);
}

let shownFrame = -1;
async function refreshCamera() {
  if (!state.camera || state.camera.sequence === shownFrame) return;
  shownFrame = state.camera.sequence;
  const { bitmap } = await fetchImage("/v1/camera.jpg?detections=false");
  camera.showImage(bitmap);
  camera.show(state.camera);
}

// Show how a past search went; the page shows the present again with one press.
function openReplay(search, button) {
  return act(button, () => replay.open(search, button), (text) => history.showError(text));
}

function onReplay() {
  if (replay.isOpen) [menu, card].forEach((popup) => popup.close());
  leaveFree();
}

// What is lost with the map in use, and what that means for a search.
function lostWithMap() {
  const cells = (state?.map?.cells_observed ?? 0).toLocaleString("en");
  const count = finds.version === null ? "all" : finds.objects.length; // null: not known yet
  const kept = `Its ${cells} cells and ${count} found ${count === 1 ? "object" : "objects"}, with the pictures, are lost unless they were saved.`;
  return state?.search?.active ? `${kept} The search goes on and looks around anew.` : kept;
}

function heatmapText() {
  if (replay.isOpen) return ""; // what is sought now has no place in it
  const target = state?.search?.target ?? "";
  return queried || (target === dismissed ? "" : target);
}

function showHeatmapText() {
  const text = pictured ? "the picture" : heatmapText();
  by("heat").hidden = !text;
  by("heat").textContent = text;
}

const typedText = () => by("text").value.replace(/^[\s,]+|[\s,]+$/g, "");

// How the gateway understands what is typed; a refusal is told when it is asked for.
async function understood() {
  const text = typedText();
  const nothing = { texts: [text], stands_for: [] };
  return text ? read(`/v1/words?text=${encodeURIComponent(text)}`).catch(() => nothing) : nothing;
}

// Run the task of a button; show the error if it fails.
async function act(button, task, show = showError) {
  show("");
  button.disabled = true;
  try {
    await task();
  } catch (problem) {
    show(sentenceOf(problem));
  } finally {
    button.disabled = false;
  }
}

// What to tell the user; the gateway's own sentence names the request that ends a search.
function sentenceOf(problem) {
  if (!problem.problem?.search_id) return problem.message;
  const search = state?.search?.id === problem.problem.search_id ? state.search : null;
  return `The robot is ${activity(search)}: wait until it is done, or press Stop.`;
}

// The typed text; asks for one if there is none.
function requiredText() {
  const typed = typedText();
  by("text").setAttribute("aria-invalid", String(!typed));
  if (typed) return typed;
  by("text").focus();
  throw new Error(NOTHING_TYPED);
}

function query() {
  return act(by("where"), async () => {
    const answers = [];
    requiredText();
    // One after the other: at most one asks for the token.
    for (const text of (await understood()).texts) answers.push(await ask(text));
    showQueried(answers, answers.find((answer) => answer.regions.length) ?? answers[0]);
    reveal(by("regions-card"));
  });
}

// The answer to one name; a refusal of this name is an answer, too.
async function ask(text) {
  try {
    return await send("POST", "/v1/queries", { text });
  } catch (problem) {
    if (!REFUSED.includes(problem.status)) throw problem;
    const near = problem.problem?.words?.[0]?.did_you_mean ?? [];
    return { text, regions: [], message: problem.message, near, refused: true };
  }
}

function queryPicture(image) {
  return act(by("image-choose"), async () => {
    const answer = await send("POST", "/v1/queries", { image });
    showQueried([{ ...answer, image }], { ...answer, image });
    reveal(by("regions-card"));
  });
}

// The found object that a region of an answer is; undefined if none is.
function findAt({ picture }) {
  return finds.objects.find((find) => find.picture && find.picture === picture);
}

// Show the answers, and the heatmap of one of them.
function showQueried(answers, shown) {
  replay.close();
  pictured = shown.image ?? null;
  queried = shown.refused || pictured ? "" : shown.text;
  showAnswers(answers, queried, {
    find: findAt,
    onRegion: (region) => (findAt(region) ? showFind(findAt(region)) : map.lookAt(...region.centre_m)),
    onAnswer: (answer) => showQueried(answers, answer),
    onWord: queryInstead,
  });
  map.showAnswers(answers);
  showHeatmapText();
}

// Ask once more, with `word` in the place of `text`.
function queryInstead(text, word) {
  by("text").value = typedText().replace(text, word);
  return query();
}

// Offer the names that a typed description may mean.
async function offerNames() {
  suggestions.offer(DESCRIPTION.test(typedText()) ? (await understood()).stands_for : []);
}

function searchFor(text) {
  return { objects: [text], after: by("return").checked ? "return" : "stay" };
}

function startSearch() {
  return act(by("find"), async () => {
    await beginSearch(searchFor(requiredText()));
  });
}

let starting = 0; // searches that were asked for and not answered yet: Stop ends them too

async function beginSearch(request, path = "/v1/searches") {
  starting += 1;
  showTask();
  try {
    await send("POST", path, request);
  } finally {
    starting -= 1;
    showTask();
  }
  replay.close();
  clearResult();
  dismissed = "";
}

// What an interrupted search has not found, or its place.
function searchAgain({ id }) {
  return beginSearch(undefined, `/v1/searches/${id}/again`);
}

// Send the robot to the place of a popup; key: go_to_m or look_at_m.
function drive(button, popup, key) {
  return inPopup(button, popup, () => beginSearch({ [key]: popup.place.map(millimetres) }));
}

function endZone(place) {
  return act(by("place-zone"), () => places.end(place.map(millimetres)));
}

function inPopup(button, popup, task) {
  const shown = popup.place;
  const run = async () => {
    await task();
    if (popup.place === shown) popup.close(); // it may have been opened elsewhere meanwhile
  };
  return act(button, run, (text) => popup.showError(text));
}

const millimetres = (metres) => Math.round(metres * 1000) / 1000;

function clearResult() {
  queried = "";
  pictured = null;
  showAnswers([]);
  map.showAnswers([]);
  showHeatmapText();
}

by("ask").addEventListener("submit", (event) => {
  event.preventDefault();
  query();
});
let typing = null;
by("text").addEventListener("input", () => {
  clearTimeout(typing);
  typing = setTimeout(offerNames, TYPED_MS);
});
by("text").addEventListener("keydown", (event) => {
  if (event.key !== "Enter" || !event.shiftKey) return;
  event.preventDefault();
  startSearch();
});
by("find").addEventListener("click", startSearch);
by("stop").addEventListener("click", () =>
  act(by("stop"), async () => {
    // whichever runs now: the state that is shown may be of a search before
    const { id: known, active } = state.search ?? {};
    const asked = starting > 0;
    const newest = await stop("current").catch((problem) => {
      if (active || problem.status !== 404) throw problem; // 404: there is no search
    });
    if (!active && !asked && newest?.id === known) throw new Error(UNSTOPPED); // else one had begun since the last message
  }),
);
by("again").addEventListener("click", () => act(by("again"), () => searchAgain(state.search)));
by("back").addEventListener("click", () => act(by("back"), () => beginSearch({ go_to: "back" })));
by("heat").addEventListener("click", () => {
  if (!queried && !pictured) dismissed = state.search?.target ?? "";
  clearResult();
});
by("place-go").addEventListener("click", (event) => drive(event.target, menu, "go_to_m"));
by("place-look").addEventListener("click", (event) => drive(event.target, menu, "look_at_m"));
by("place-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const name = by("place-name").value.trim();
  if (!name) menu.showError("Type a name for it, for example: kitchen.");
  else inPopup(by("place-save"), menu, () => places.name(name, menu.place.map(millimetres)));
});
by("place-zone").addEventListener("click", () => {
  places.begin(menu.place.map(millimetres), by("place-name").value.trim());
  menu.close();
});
by("place-forget").addEventListener("click", (event) =>
  inPopup(event.target, menu, () => places.forget(menu.named)),
);
by("find-go").addEventListener("click", (event) => drive(event.target, card, "go_to_m"));
by("find-look").addEventListener("click", (event) => drive(event.target, card, "look_at_m"));
by("forget-yes").addEventListener("click", (event) =>
  inPopup(event.target, card, () => send("DELETE", `/v1/objects/${card.object.id}`)),
);
by("zoom-in").addEventListener("click", () => map.zoom(1.4));
by("zoom-out").addEventListener("click", () => map.zoom(1 / 1.4));
by("zoom-fit").addEventListener("click", () => map.fit());
document.addEventListener("keydown", (event) => {
  if (event.key !== "/" || event.target instanceof HTMLInputElement) return;
  event.preventDefault();
  by("text").focus();
});
