// The objects found so far, which the robot keeps with its map, and the list of them.

import { read } from "./api.js";
import { clockTime, place } from "./format.js";
import { by, element, refill } from "./panels.js";

export class Finds {
  // onOpen(object): one was chosen in the list
  constructor(onOpen) {
    this.objects = [];
    this.version = null;
    this.onOpen = onOpen;
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

  showList(leftOut) {
    by("finds-card").hidden = !this.objects.length;
    by("finds-left-out").hidden = !leftOut;
    by("finds-left-out").textContent = `Not kept any more, for want of room: ${leftOut}.`;
    refill(by("finds"), this.objects, () => this.objects.map((object) => this.row(object)));
  }

  row(object) {
    const button = element("button", { title: "Show it on the map" }, [
      element("span", { text: object.name }),
      element("small", { text: `${place(object.position_m)} m, seen ${clockTime(object.last_seen_at)}` }),
    ]);
    button.type = "button";
    button.addEventListener("click", () => this.onOpen(object));
    return element("li", {}, [button]);
  }
}
