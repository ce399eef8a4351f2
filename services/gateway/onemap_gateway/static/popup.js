// A small window at a place of the map; one is open at a time.

const GAP_PX = 14; // between the place and the window
const MARGIN_PX = 8; // between the window and the border of the map

let opened = null;

export class Popup {
  constructor(dialog, map) {
    this.dialog = dialog;
    this.map = map;
    this.error = dialog.querySelector(".error");
    dialog.querySelector(".close").addEventListener("click", () => this.close());
  }

  get isOpen() {
    return this.dialog.open;
  }

  // place: [x, y] in metres
  open(place) {
    opened?.close();
    opened = this;
    this.place = place;
    this.showError("");
    this.dialog.show();
    this.follow();
  }

  close() {
    if (!this.isOpen) return;
    this.dialog.close(); // the focus returns to where it was
    this.map.mark(null);
  }

  // Stay at the place when the map has moved.
  follow() {
    if (!this.isOpen) return;
    const [column, row] = this.map.pixels(...this.place);
    const { clientWidth: width, clientHeight: height } = this.map.canvas;
    const { offsetWidth: across, offsetHeight: down } = this.dialog;
    const beside = column + GAP_PX + across + MARGIN_PX <= width ? column + GAP_PX : column - GAP_PX - across;
    const left = Math.max(Math.min(beside, width - across - MARGIN_PX), MARGIN_PX);
    const top = Math.max(Math.min(row - GAP_PX, height - down - MARGIN_PX), MARGIN_PX);
    this.dialog.style.setProperty("--left", `${left}px`);
    this.dialog.style.setProperty("--top", `${top}px`);
  }

  showError(text) {
    this.error.hidden = !text;
    this.error.textContent = text;
  }
}

document.addEventListener("keydown", (event) => {
  if (event.key === "Escape" && !document.querySelector("dialog:modal")) opened?.close();
});
document.addEventListener("pointerdown", (event) => {
  if (!event.target.closest("dialog")) opened?.close();
});
