// Cutting one thing out of a picture: the frame is drawn with the pointer or moved by keys.

import { by } from "./panels.js";

const LEAST_PX = 16; // of each side of what the gateway takes
const SENT_PX = 640; // longest side of what is sent: encoders take less, and it stays below 512 kB
const SHOWN_PX = 560; // longest side of the picture in the window
const STEPS = 32; // of a key, across the picture
const QUALITY = 0.9;
const FRAME = "#ffbe5c"; // as around a detection
const SHADE = "#0009";

export class CropDialog {
  // onAsk(image): a crop was asked for, a JPEG as a data URL
  constructor(onAsk) {
    this.dialog = by("crop-dialog");
    this.canvas = by("crop");
    this.picture = null;
    this.anchor = null; // [x, y] in pixels of the picture: where a frame begins to be drawn
    this.listen();
    this.dialog.addEventListener("close", () => {
      const image = this.dialog.returnValue === "ask" ? this.cut() : null;
      this.picture.close();
      if (image) onAsk(image);
    });
  }

  // picture: an ImageBitmap, closed with the window; part: of its sides that is framed, 0 to 1
  show(picture, part) {
    if (this.dialog.open) this.picture.close(); // another one was dropped on it
    const { width, height } = picture;
    const zoom = SHOWN_PX / Math.max(width, height);
    this.picture = picture;
    [this.canvas.width, this.canvas.height] = [width, height].map((side) => Math.max(side * zoom, 1));
    const rest = (1 - part) / 2;
    this.setFrame([rest * width, rest * height, (1 - rest) * width, (1 - rest) * height]);
    this.dialog.returnValue = "";
    if (!this.dialog.open) this.dialog.showModal();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      this.anchor = this.place(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!this.anchor) return;
      const [[x0, y0], [x1, y1]] = [this.anchor, this.place(event)];
      if (Math.abs(x1 - x0) < 2 && Math.abs(y1 - y0) < 2) return; // a press is no frame
      this.setFrame([Math.min(x0, x1), Math.min(y0, y1), Math.max(x0, x1), Math.max(y0, y1)]);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, () => (this.anchor = null));
    }
    canvas.addEventListener("keydown", (event) => {
      const move = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!move || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      this.moveFrame(move, event.shiftKey);
    });
  }

  // Where an event is in the picture, in its pixels.
  place({ offsetX, offsetY }) {
    const { clientWidth, clientHeight } = this.canvas;
    const { width, height } = this.picture;
    return [(offsetX / clientWidth) * width, (offsetY / clientHeight) * height];
  }

  // Move the frame by a step, or with `corner` only its lower right corner.
  moveFrame([right, down], corner) {
    const { width, height } = this.picture;
    const [x0, y0, x1, y1] = this.frame;
    const dx = corner ? (right * width) / STEPS : limited((right * width) / STEPS, -x0, width - x1);
    const dy = corner ? (down * height) / STEPS : limited((down * height) / STEPS, -y0, height - y1);
    const [left, top] = corner ? [x0, y0] : [x0 + dx, y0 + dy];
    this.setFrame([left, top, Math.max(x1 + dx, left), Math.max(y1 + dy, top)]);
  }

  // Frame these pixels of the picture, but at least LEAST_PX of it, and none beside it.
  setFrame([x0, y0, x1, y1]) {
    const { width, height } = this.picture;
    const [left, right] = span(x0, x1, width);
    const [top, bottom] = span(y0, y1, height);
    this.frame = [left, top, right, bottom];
    const size = `${right - left} × ${bottom - top} pixels of ${width} × ${height}`;
    by("crop-size").textContent = `Frame: ${size}, ${left} from the left, ${top} from the top.`;
    this.draw();
  }

  draw() {
    const { canvas, picture } = this;
    const context = canvas.getContext("2d");
    const zoom = canvas.width / picture.width;
    const [x0, y0, x1, y1] = this.frame.map((value) => value * zoom);
    context.drawImage(picture, 0, 0, canvas.width, canvas.height);
    context.beginPath();
    context.rect(0, 0, canvas.width, canvas.height);
    context.rect(x0, y0, x1 - x0, y1 - y0);
    context.fillStyle = SHADE;
    context.fill("evenodd");
    for (const [colour, width] of [["#0009", 5], [FRAME, 3]]) {
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.strokeRect(x0 + 1.5, y0 + 1.5, Math.max(x1 - x0 - 3, 1), Math.max(y1 - y0 - 3, 1));
    }
  }

  // What is framed, as a JPEG, small enough to be sent; what is transparent becomes white.
  cut() {
    const [x0, y0, x1, y1] = this.frame;
    const [across, down] = [x1 - x0, y1 - y0];
    const fitting = Math.min(SENT_PX / Math.max(across, down), 1);
    const scale = Math.max(fitting, Math.min(LEAST_PX / Math.min(across, down), 1));
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [across, down].map((side) => Math.round(side * scale));
    const context = canvas.getContext("2d");
    context.fillStyle = "#fff";
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.imageSmoothingQuality = "high";
    context.drawImage(this.picture, x0, y0, across, down, 0, 0, canvas.width, canvas.height);
    return canvas.toDataURL("image/jpeg", QUALITY);
  }
}

const limited = (value, least, most) => Math.min(Math.max(value, least), most);

// Whole pixels from `low` to `high`, at least LEAST_PX of them if the side has so many.
function span(low, high, side) {
  const length = Math.max(Math.round(high - low), Math.min(LEAST_PX, side));
  const first = limited(Math.round(low), 0, side - Math.min(length, side));
  return [first, Math.min(first + length, side)];
}
