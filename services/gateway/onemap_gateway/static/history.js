// The list of past searches: what, when, how it ended, and the photograph of what was found.

import { read } from "./api.js";
import { capital, clockTime, duration } from "./format.js";
import { by, element, refill, searchTitle } from "./panels.js";
import { blankThumbnail, paintThumbnail } from "./thumbnail.js";

export class History {
  // onOpen(search, button): one was chosen
  constructor(onOpen) {
    this.onOpen = onOpen;
    this.shown = ""; // newest search and finds of the list
    by("history-card").addEventListener("toggle", () => (this.shown = ""));
    // photographs are fetched when their row comes into sight
    this.sight = new IntersectionObserver((entries) => {
      for (const { isIntersecting, target } of entries) if (isIntersecting) this.picture(target);
    });
  }

  // Fetch the list if it is open and older than this.
  async refresh(search, objects) {
    const wanted = JSON.stringify([search?.id, search?.active, objects.map(({ id, search_id: by }) => [id, by])]);
    if (!by("history-card").open || wanted === this.shown) return;
    this.shown = wanted;
    const { searches } = await read("/v1/searches").catch((problem) => {
      this.shown = ""; // and again
      this.showError(problem.message);
      throw problem;
    });
    this.showError("");
    const past = searches.filter(({ active }) => !active);
    by("history-none").hidden = past.length > 0;
    const rows = past.map((each) => [each, findsOf(each, objects)]);
    refill(by("history"), rows, () => rows.map(([each, finds]) => this.row(each, finds)));
  }

  row(search, finds) {
    const { state, reason, started_at: began, elapsed_s: took, path_length_m: way } = search;
    const button = element("button", { title: "Show how it went on the map" }, [
      element("span", { className: "cut", text: searchTitle(search), title: searchTitle(search) }),
      element("span", { className: `state ${state}`, text: state.replaceAll("_", " ") }),
      element("small", { text: `${clockTime(began)} · ${duration(took)} · ${way.toFixed(1)} m` }),
      element("small", { className: "again", text: "▶ Play" }),
      element("small", { className: "why cut", text: capital(reason), title: reason }),
    ]);
    button.type = "button";
    button.addEventListener("click", () => this.onOpen(search, button));
    if (finds.length) button.append(element("span", { className: "thumbs" }, finds.map((find) => this.thumb(find))));
    return element("li", {}, [button]);
  }

  thumb(find) {
    const canvas = blankThumbnail(find);
    canvas.find = find;
    this.sight.observe(canvas);
    return canvas;
  }

  showError(text) {
    by("history-error").hidden = !text;
    by("history-error").textContent = text;
  }

  // Draw what the find's box holds.
  async picture(canvas) {
    this.sight.unobserve(canvas);
    if (!(await paintThumbnail(canvas, canvas.find))) canvas.remove();
  }
}

// What the search was the last to find, as far as there are photographs.
function findsOf({ id }, objects) {
  return objects.filter(({ search_id: last, picture }) => last === id && picture);
}
