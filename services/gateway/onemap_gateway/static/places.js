// Rooms with a name and keep-out zones: drawn on the map, named and forgotten at a place of it.

import { read, send } from "./api.js";
import { short, thing } from "./format.js";
import { by } from "./panels.js";

const PAUSE_MS = 5000; // between two looks at rooms that grow with the map
const ZONE = "keep_out";

export class Places {
  constructor(map) {
    this.map = map;
    this.list = [];
    this.known = {}; // version and revision that the list is of
    this.fetched = -Infinity;
    this.corner = null; // [x, y] of a zone whose other corner is awaited
    by("zone-cancel").addEventListener("click", () => this.begin(null));
    document.addEventListener("keydown", (event) => event.key === "Escape" && this.begin(null));
  }

  // Fetch the places if people changed some, or, now and then, if the map grew; whether it did.
  async refresh({ places_version: version, revision }) {
    const grew = revision !== this.known.revision && performance.now() - this.fetched > PAUSE_MS;
    if (version === this.known.version && !grew) return false;
    this.fetched = performance.now();
    this.list = (await read("/v1/places")).places;
    this.known = { version, revision };
    this.map.dirty = true;
    return true;
  }

  // The place at [x, y] in metres: a zone before the room that it lies in.
  at([x, y]) {
    const here = this.list.filter(({ outlines_m: outlines }) => outlines.some((each) => holds(each, x, y)));
    return here.find(({ kind }) => kind === ZONE) ?? here[0];
  }

  // The room with a name that holds a place, as "in the kitchen"; empty without one.
  words([x, y]) {
    const room = this.list.find(({ name, kind, outlines_m: outlines }) =>
      name && kind !== ZONE && outlines.some((each) => holds(each, x, y)));
    return room ? `in ${thing(room.name)}` : "";
  }

  name(name, place) {
    return this.change("PUT", name, { inside_m: place });
  }

  forget({ name }) {
    return this.change("DELETE", name);
  }

  async change(method, name, body) {
    await send(method, `/v1/places/${encodeURIComponent(name)}`, body);
    this.known = {}; // to be fetched at once
  }

  // Wait for the corner opposite to this one; null: not any more.
  begin(corner, name = "") {
    this.corner = corner;
    this.zone = name;
    by("zone-hint").hidden = !corner;
    this.map.dirty = true;
  }

  // Keep the robot out of the rectangle from the first corner to this one.
  end([x, y]) {
    const [x0, y0] = this.corner;
    const name = this.zone || this.freeName();
    this.begin(null);
    return this.change("PUT", name, { kind: ZONE, corners_m: [[x0, y0], [x, y0], [x, y], [x0, y]] });
  }

  freeName() {
    const taken = this.list.map(({ name }) => name.toLowerCase());
    for (let count = 1; ; count += 1) if (!taken.includes(`zone ${count}`)) return `zone ${count}`;
  }

  draw(map) {
    for (const { kind, outlines_m: outlines } of this.list) {
      for (const outline of outlines) this.drawOutline(map, outline, kind === ZONE);
    }
    if (this.corner && map.pointed) {
      const [[x0, y0], [x1, y1]] = [this.corner, map.metres(...map.pointed)];
      this.drawOutline(map, [[x0, y0], [x1, y0], [x1, y1], [x0, y1]], true);
    }
  }

  drawOutline(map, corners, isZone) {
    const { context, colours } = map;
    context.strokeStyle = context.fillStyle = isZone ? colours.collided : colours.ink;
    context.lineWidth = isZone ? 2 : 1;
    context.setLineDash(isZone ? [] : [2, 4]);
    context.beginPath();
    for (const [x, y] of corners) context.lineTo(...map.pixels(x, y));
    context.closePath();
    context.stroke();
    context.setLineDash([]);
    if (!isZone) return;
    context.globalAlpha = 0.25;
    context.fill();
    context.globalAlpha = 1;
  }

  // Suggested names have a question mark.
  nameAll(map) {
    for (const { name, kind, suggested, inside_m: inside, corners_m: corners } of this.list.filter((each) => each.name)) {
      const [column, row] = map.pixels(...(inside ?? middle(corners)));
      const text = suggested ? `${short(name)}?` : short(name);
      map.context.font = "13px system-ui, 'DejaVu Sans', sans-serif";
      map.label(text, column - map.context.measureText(text).width / 2, row, map.colours[kind === ZONE ? "collided" : "ink"]);
    }
  }
}

const middle = (corners) => [0, 1].map((axis) => corners.reduce((sum, corner) => sum + corner[axis] / corners.length, 0));

// Whether [x, y] lies in a polygon: a ray from it crosses the edges an odd number of times.
function holds(corners, x, y) {
  let inside = false;
  corners.forEach(([x1, y1], index) => {
    const [x0, y0] = corners.at(index - 1);
    if (y0 > y !== y1 > y && x < x0 + ((y - y0) * (x1 - x0)) / (y1 - y0)) inside = !inside;
  });
  return inside;
}
