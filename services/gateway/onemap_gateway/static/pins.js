// Finds on the map: pins whose head shows the photograph of what was found.

import { paintThumbnail } from "./thumbnail.js";

export const PIN_PX = 23; // from a pin's tip to the middle of its head
const HEAD_PX = 15; // radius of the head
const RING_PX = 2.5; // of the pin's colour around the photograph
const PICTURE_PX = 64; // on a side; shown at 25, sharp on a screen of 2.5 pixels for one

export class Pins {
  // onPicture(): one has come
  constructor(onPicture) {
    this.onPicture = onPicture;
    this.pictures = new Map(); // id and time of a find -> canvas, null until it is there
  }

  // Fetch the photographs of these finds, one after the other.
  async load(finds) {
    const wanted = new Map(finds.filter(({ picture }) => picture).map((find) => [keyOf(find), find]));
    for (const key of this.pictures.keys()) if (!wanted.has(key)) this.pictures.delete(key);
    for (const [key, find] of wanted) {
      if (this.pictures.has(key)) continue;
      this.pictures.set(key, null);
      const canvas = document.createElement("canvas");
      canvas.width = canvas.height = PICTURE_PX;
      if (!(await paintThumbnail(canvas, find)) || !this.pictures.has(key)) continue;
      this.pictures.set(key, canvas);
      this.onPicture();
    }
  }

  // The tip is the place. Without a photograph the head shows the first letter of the name.
  draw(context, find, column, row, { find: colour, unknown: ground }) {
    const middle = row - PIN_PX;
    context.beginPath();
    context.arc(column, middle, HEAD_PX, Math.PI * 0.8, Math.PI * 0.2);
    context.lineTo(column, row);
    context.closePath();
    context.lineWidth = 2;
    context.lineJoin = "round";
    context.strokeStyle = ground;
    context.fillStyle = colour;
    context.stroke();
    context.fill();
    const picture = this.pictures.get(keyOf(find));
    const inner = HEAD_PX - RING_PX;
    if (picture) {
      context.save();
      context.beginPath();
      context.arc(column, middle, inner, 0, 2 * Math.PI);
      context.clip();
      context.imageSmoothingQuality = "high";
      context.drawImage(picture, column - inner, middle - inner, 2 * inner, 2 * inner);
      context.restore();
      return;
    }
    context.font = "600 15px system-ui, 'DejaVu Sans', sans-serif";
    context.textAlign = "center";
    context.fillStyle = ground;
    context.fillText(find.name[0].toUpperCase(), column, middle + 5);
    context.textAlign = "start";
  }
}

function keyOf({ id, last_seen_ns: seen }) {
  return `${id}/${seen}`;
}
