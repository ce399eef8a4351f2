// Several robots behind one gateway: a link to each, and those of the same map, live.

import { BASE, readAll } from "./api.js";
import { follow } from "./live.js";
import { by, element, refill } from "./panels.js";

const COLOURS = 4; // --map-robot-0 and so on of style.css
const PAUSE_MS = 5000;

export class Fleet {
  // onChange(robots): those of this map, each { name, colour, own, state }; onRole(role): of the token
  constructor(onChange, onRole) {
    this.onChange = onChange;
    this.onRole = onRole;
    this.robots = [];
    this.followed = new Map(); // address -> the newest state
    this.refresh();
  }

  async refresh() {
    const { robots, role } = await readAll("/v1/robots").catch(() => ({ robots: this.robots }));
    this.robots = robots;
    if (role) this.onRole(role);
    this.showLinks();
    const own = robots.find(({ address }) => address === BASE);
    for (const { name, address } of robots) {
      if (own?.shares_map_with.includes(name)) this.follow(address);
    }
    setTimeout(() => this.refresh(), PAUSE_MS);
  }

  follow(address) {
    if (this.followed.has(address)) return;
    this.followed.set(address, null);
    const keep = (state) => {
      this.followed.set(address, state);
      this.onChange(this.shown());
    };
    follow(keep, (up) => up || keep(null), address);
  }

  shown() {
    const own = this.robots.find(({ address }) => address === BASE);
    return this.robots.flatMap(({ name, address }, index) => {
      const shares = address === BASE || own?.shares_map_with.includes(name);
      if (!shares) return [];
      const state = this.followed.get(address) ?? null;
      return [{ name, colour: `robot-${index % COLOURS}`, own: address === BASE, state }];
    });
  }

  // Name and colour of the robot that found something, by its namespace; null where it says nothing:
  // one robot alone, or a find of an older map.
  finder(namespace) {
    if (!namespace || !this.robots.length) return null;
    const index = this.robots.findIndex((robot) => robot.namespace === namespace);
    if (index < 0) return { name: namespace, colour: "quiet" };
    return { name: this.robots[index].name, colour: `map-robot-${index % COLOURS}` };
  }

  showLinks() {
    by("robots").hidden = !this.robots.length;
    const rows = this.robots.map(({ name, address, ready, problem }) => [name, address, ready, problem]);
    refill(by("robots"), rows, () => rows.map((row, index) => link(row, index)));
    this.onChange(this.shown());
  }
}

function link([name, address, ready, problem], index) {
  const node = element("a", { text: name, title: problem || "It is ready.", className: ready ? "" : "degraded" });
  node.href = `${address}/`;
  node.style.setProperty("--robot", `var(--map-robot-${index % COLOURS})`);
  if (address === BASE) node.setAttribute("aria-current", "page");
  return node;
}
