// A notification of the system when a search has found something, if the user allows it.

import { thing } from "./format.js";
import { by } from "./panels.js";

// Chrome on Android has the class, but its constructor throws. Nothing is shown without permission.
function works() {
  try {
    new Notification("");
    return true;
  } catch {
    return false;
  }
}

export class Notifier {
  constructor() {
    this.works = null; // tried when it would be offered
    this.told = null; // the search whose finds were told, and how many
    by("notify").addEventListener("click", () => this.ask());
  }

  // Offered while a search runs, where the browser has it and nobody has chosen yet.
  get undecided() {
    return "Notification" in window && isSecureContext && Notification.permission === "default";
  }

  async ask() {
    await Notification.requestPermission();
    by("notify").hidden = !this.undecided;
  }

  refresh(search) {
    const wanted = this.undecided && search?.active && search.kind === "find";
    by("notify").hidden = !wanted || !(this.works ??= works());
    const found = search?.results.filter(({ outcome }) => outcome === "found").length ?? 0;
    const news = this.told?.id === search?.id && found > this.told?.found;
    this.told = search && { id: search.id, found };
    if (!news || !("Notification" in window) || Notification.permission !== "granted") return;
    const index = search.results.findLastIndex(({ outcome }) => outcome === "found");
    try {
      new Notification(`Found ${thing(search.requests[index])}`, { body: search.results[index].reason, tag: search.id });
    } catch {} // allowed before, by a browser whose constructor throws: the page shows the find
  }
}
