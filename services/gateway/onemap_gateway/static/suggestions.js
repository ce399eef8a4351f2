// Names that one press searches for: those that were sought here last, then some of a home.

import { read } from "./api.js";
import { by, element, refill } from "./panels.js";

const EXAMPLES = ["bed", "sofa", "television"];
const MOST = 4;
const LONGEST = 20; // characters of a name that fits a line of a phone

export class Suggestions {
  // onChoose(name, button): one was pressed
  constructor(onChoose) {
    this.onChoose = onChoose;
    this.shown = null; // the newest search when the names were fetched
    this.offered = []; // for what is typed now
    this.show([]);
  }

  // search: the newest one, null if there was none; while it runs nothing else can begin
  async refresh(search) {
    by("suggestions").hidden = Boolean(search?.active);
    if (!search || search.id === this.shown) return;
    this.shown = search.id;
    const { searches } = await read("/v1/searches").catch(() => ({ searches: [] }));
    this.show(searches.flatMap(({ objects }) => objects));
  }

  // The names that a description may mean come first.
  offer(names) {
    this.offered = names;
    this.show(this.sought);
  }

  show(sought) {
    this.sought = sought;
    const short = sought.filter((name) => name.length <= LONGEST);
    const names = [...new Set([...this.offered, ...short, ...EXAMPLES])].slice(0, MOST);
    refill(by("suggestions"), names, () => names.map((name) => this.button(name)));
  }

  button(name) {
    const button = element("button", { text: name, title: `Go and find: ${name}` });
    button.type = "button";
    button.setAttribute("aria-label", button.title);
    button.addEventListener("click", () => this.onChoose(name, button));
    return button;
  }
}
