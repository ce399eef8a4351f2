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
    this.open(goal);
    this.map.mark(goal);
  }
}
