// The card of a find: its photograph, what is known of it, and what can be done.

import { fetchBlob } from "./api.js";
import { capital, clockTime, height, place, thing } from "./format.js";
import { by, robotName } from "./panels.js";
import { Popup } from "./popup.js";

export class FindCard extends Popup {
  // finder(namespace): see Fleet; where(place): the room that holds it, in words
  constructor(map, finder, where) {
    super(by("find-card"), map);
    this.finder = finder;
    this.where = where;
    this.object = null;
    this.photo = by("find-photo");
    this.photo.addEventListener("load", () => this.showBox());
    this.photo.addEventListener("error", () => this.showPhoto(false));
    by("find-forget").addEventListener("click", () => this.askForget());
    by("forget-no").addEventListener("click", () => this.keep());
  }

  show(object) {
    this.fill(object);
    this.showQuestion(false);
    this.open(object.position_m.slice(0, 2));
  }

  fill(object) {
    const pictured = this.object?.id === object.id && this.object.last_seen_ns === object.last_seen_ns;
    this.object = object;
    by("find-name").textContent = object.name;
    const finder = this.finder(object.robot);
    by("find-facts").replaceChildren(
      capital([this.where(object.position_m), `seen ${clockTime(object.last_seen_at)}`].filter(Boolean).join(" · ")),
      ...(finder ? [" by ", robotName(finder)] : []),
      ` · at ${place(object.position_m)} m${height(object.height_m)} · score ${object.score.toFixed(2)}`,
    );
    if (pictured) return;
    by("find-box").hidden = true; // until the size of the photograph is known
    this.showPhoto(Boolean(object.picture));
    this.photo.alt = `Photograph of ${thing(object.name)}`;
    // A find that was seen again has another photograph at the same address.
    if (object.picture) this.loadPhoto(`${object.picture}?seen=${object.last_seen_ns}`);
  }

  async loadPhoto(path) {
    this.wanted = path;
    try {
      const photo = await fetchBlob(path);
      if (this.wanted !== path) return; // another find is shown by now
      URL.revokeObjectURL(this.photo.src);
      this.photo.src = URL.createObjectURL(photo);
    } catch {
      if (this.wanted === path) this.showPhoto(false);
    }
  }

  // The finds have changed: show the new state of this one, or close.
  update(objects) {
    if (!this.isOpen) return;
    const object = objects.find(({ id }) => id === this.object.id);
    if (object) this.fill(object);
    else this.close();
  }

  // Ask before the object is forgotten; the focus goes to the answer that changes nothing.
  askForget() {
    by("find-question").textContent = `Forget ${thing(this.object.name)}?`;
    this.showQuestion(true);
    by("forget-no").focus();
  }

  keep() {
    this.showQuestion(false);
    by("find-forget").focus();
  }

  showQuestion(asked) {
    by("find-confirm").hidden = !asked;
    by("find-actions").hidden = asked;
    this.showError("");
    this.follow(); // its height may have changed
  }

  showPhoto(there) {
    by("find-picture").hidden = !there;
    by("find-no-photo").hidden = there;
  }

  // The box around the object, in parts of the photograph.
  showBox() {
    const { naturalWidth: width, naturalHeight: height } = this.photo;
    const { box_px: box } = this.object;
    const frame = by("find-box");
    frame.hidden = !box;
    if (box) {
      const [left, top, right, bottom] = box;
      const parts = [top / height, 1 - right / width, 1 - bottom / height, left / width];
      frame.style.inset = parts.map((part) => `${Math.max(part, 0) * 100}%`).join(" ");
    }
    this.follow();
  }
}
