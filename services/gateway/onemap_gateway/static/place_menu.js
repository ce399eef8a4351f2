// The menu of a place that was chosen on the map.

import { place } from "./format.js";
import { by } from "./panels.js";
import { Popup } from "./popup.js";

export class PlaceMenu extends Popup {
  constructor(map, places) {
    super(by("place-menu"), map);
    this.places = places;
  }

  // goal: [x, y] in metres
  show(goal) {
    this.named = this.places.at(goal);
    by("place-title").textContent = [this.named?.name, `(${place(goal)}) m`].filter(Boolean).join(" ");
    by("place-name").value = this.named?.suggested ? this.named.name : "";
    by("place-forget").hidden = !this.named?.name || this.named.suggested;
    by("place-forget").textContent = by("place-forget").title = `Forget ${this.named?.name}`;
    this.showHeight(goal);
    this.open(goal);
    this.map.mark(goal);
    this.map.askHeights().then((newer) => newer && this.place === goal && this.showHeight(goal));
  }

  showHeight(goal) {
    const height = this.map.heights.text(goal);
    by("place-height").hidden = !height;
    by("place-height").textContent = `What stands there is ${height}.`;
  }
}
