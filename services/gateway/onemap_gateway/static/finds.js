// The objects found so far, which the robot keeps with its map, and the list of them.

import { read } from "./api.js";
import { capital, clockTime, place } from "./format.js";
import { by, element, refill, robotName } from "./panels.js";

const HERE_M = 0.2; // a find stands where the search says that it was found

export class Finds {
  // onOpen(object): one was chosen in the list; finder(namespace): see Fleet; where(place): the room
  constructor(onOpen, finder, where) {
    this.objects = [];
    this.version = null;
    this.onOpen = onOpen;
    this.finder = finder;
    this.where = where;
  }

  // Fetch the objects if the robot has others than are shown; whether it had.
  async refresh(version) {
    if (version === undefined || version === this.version) return false;
    const { objects, left_out: leftOut } = await read("/v1/objects");
    this.version = version;
    this.objects = objects;
    this.showList(leftOut);
    return true;
  }

  // Where the find at a place is, by room and landmark; empty: none is there, or it is not known.
  words([x, y]) {
    const here = this.objects.find(({ position_m: at }) => Math.hypot(at[0] - x, at[1] - y) < HERE_M);
    return here?.where ?? "";
  }

  showList(leftOut) {
    by("finds-card").hidden = !this.objects.length;
    by("finds-left-out").hidden = !leftOut;
    by("finds-left-out").textContent = `No longer kept, for lack of space: ${leftOut}.`;
    this.showRows();
  }

  showRows() {
    const rows = this.objects.map((object) => [object, this.finder(object.robot), this.where(object.position_m)]);
    refill(by("finds"), rows, () => rows.map((row) => this.row(...row)));
  }

  row(object, finder) {
    const facts = [this.where(object.position_m), `at ${place(object.position_m)} m`, `seen ${clockTime(object.last_seen_at)}`];
    const seen = capital(facts.filter(Boolean).join(", "));
    const button = element("button", { title: "Show it on the map" }, [
      element("span", { text: object.name }),
      element("small", { text: seen }, finder ? [" by ", robotName(finder)] : []),
    ]);
    button.type = "button";
    button.addEventListener("click", () => this.onOpen(object));
    return element("li", {}, [button]);
  }
}
