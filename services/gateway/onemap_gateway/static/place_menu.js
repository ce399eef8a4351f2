// The menu of a place that was chosen on the map.

import { place } from "./format.js";
import { by } from "./panels.js";
import { Popup } from "./popup.js";

export class PlaceMenu extends Popup {
  constructor(map) {
    super(by("place-menu"), map);
  }

  // goal: [x, y] in metres
  show(goal) {
    by("place-title").textContent = `(${place(goal)}) m`;
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
