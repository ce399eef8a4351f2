// The saved maps: save, load, merge, delete one; clear the map in use.

import { read, send } from "./api.js";
import { bytes, clockTime } from "./format.js";
import { by, element, refill, reveal } from "./panels.js";

const FILE_MS = 25000; // the gateway waits 20 s for a large map
const NAME = /^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$/;
const NAMED = "Name the map with at most 64 letters A-Z and a-z, digits, '.', '_' or '-', a letter or a digit first.";

export class Maps {
  // act(button, task, show): runs what a button does; lost(): what a map that goes takes with it
  constructor(act, lost) {
    this.act = act;
    this.lost = lost;
    this.maps = [];
    this.asked = null; // { button, verb, task }: what waits for a second answer
    by("maps-card").addEventListener("toggle", () => {
      if (by("maps-card").open) this.run(by("map-clear"), () => this.refresh());
    });
    by("map-save").addEventListener("submit", (event) => {
      event.preventDefault();
      this.save(by("map-name").value.trim());
    });
    by("map-clear").addEventListener("click", (event) =>
      this.ask(event.target, "Clear", `Clear the map? ${this.lost()} Saved maps stay.`, async () => {
        await send("POST", "/v1/map/clear");
        return "The map was cleared: it grows again from what the camera sees.";
      }),
    );
    by("map-no").addEventListener("click", () => this.answer(false));
    by("map-yes").addEventListener("click", () => this.answer(true));
  }

  // Who may not change maps sees no button for it.
  allow(role) {
    by("maps-card").classList.toggle("locked", role !== "administer");
    by("maps-refused").hidden = role === "administer";
  }

  async refresh() {
    const { maps, left_out: leftOut } = await read("/v1/maps");
    this.maps = maps;
    by("maps-none").hidden = maps.length > 0;
    by("maps-left-out").hidden = !leftOut;
    by("maps-left-out").textContent = `${leftOut} older ones are not shown.`;
    refill(by("maps"), maps, () => maps.map((map) => this.row(map)));
  }

  row({ name, file_bytes: size, saved_at: saved, problem }) {
    const facts = `${bytes(size)}, ${clockTime(saved)}`;
    const summary = element("summary", { text: name }, [element("small", { text: facts })]);
    if (problem) summary.append(element("small", { className: "problem", text: problem }));
    const path = `/v1/maps/${name}`;
    const load = () => `Load ${name} in place of the map in use? ${this.lost()}`;
    const merge = () => `Merge ${name} into the map in use? It must have the same frame, and cannot be taken out again.`;
    const remove = () => `Delete the file of ${name} (${facts})? The map in use stays.`;
    const actions = element("div", { className: "row changes" }, [
      this.button("Load", name, load, () => send("POST", `${path}/load`, undefined, FILE_MS), `${name} is the map in use.`),
      this.button("Merge", name, merge, () => send("POST", `${path}/merge`, undefined, FILE_MS), `${name} is merged.`),
      this.button("Delete", name, remove, () => send("DELETE", path), `${name} is deleted.`),
    ]);
    return element("li", {}, [element("details", {}, [summary, actions])]);
  }

  // A button that asks before it does something to a saved map.
  button(verb, name, question, task, done) {
    const button = element("button", { text: `${verb}…` });
    button.type = "button";
    button.setAttribute("aria-label", `${verb} ${name}`);
    button.addEventListener("click", () =>
      this.ask(button, verb, question(), async () => {
        await task();
        return done;
      }),
    );
    return button;
  }

  save(name) {
    const button = by("map-save-button");
    const known = this.maps.find((map) => map.name === name);
    const task = async () => {
      const { file_bytes: size } = await send("PUT", `/v1/maps/${name}`, undefined, FILE_MS);
      by("map-name").value = "";
      return `${name} is saved, ${bytes(size)}.`;
    };
    by("map-name").setAttribute("aria-invalid", String(!NAME.test(name)));
    if (!NAME.test(name)) this.show(NAMED);
    else if (known) this.ask(button, "Replace", `${name} is there, of ${clockTime(known.saved_at)}: replace it?`, task);
    else this.run(button, task);
  }

  // Ask before something is lost; the focus goes to the answer that changes nothing.
  ask(button, verb, question, task) {
    this.asked = { button, task };
    this.show("");
    by("map-done").textContent = "";
    by("map-question").textContent = question;
    by("map-yes").textContent = verb;
    by("map-confirm").hidden = false;
    by("map-no").focus();
    reveal(by("map-confirm"));
  }

  answer(yes) {
    const { button, task } = this.asked;
    by("map-confirm").hidden = true;
    button.focus();
    if (yes) this.run(button, task);
  }

  // Run a task; show the sentence that it returns, and the list as it is then.
  run(button, task) {
    by("map-done").textContent = "";
    const whole = async () => {
      const done = await task();
      if (!done) return;
      by("map-done").textContent = done;
      await this.refresh();
    };
    return this.act(button, whole, (text) => this.show(text));
  }

  show(text) {
    by("maps-error").hidden = !text;
    by("maps-error").textContent = text;
  }
}
