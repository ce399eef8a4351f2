// A small square picture of a find: the part of its photograph that shows it.

import { fetchImage } from "./api.js";
import { thing } from "./format.js";

const MARGIN = 0.15; // of the object's size, around it

const SIDE_PX = 96; // shown at half of it

export function blankThumbnail({ name }) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIDE_PX;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `Photograph of ${thing(name)}`);
  return canvas;
}

// Draw what the find's box holds over the whole square canvas; whether there is a photograph.
export async function paintThumbnail(canvas, { picture, last_seen_ns: seen, box_px: box }) {
  const { bitmap } = await fetchImage(seen ? `${picture}?seen=${seen}` : picture).catch(() => ({}));
  if (!bitmap) return false;
  const [x0, y0, x1, y1] = box ?? [0, 0, bitmap.width, bitmap.height];
  const side = Math.min(Math.max(x1 - x0, y1 - y0) * (1 + 2 * MARGIN), bitmap.width, bitmap.height);
  const left = Math.min(Math.max((x0 + x1 - side) / 2, 0), bitmap.width - side);
  const top = Math.min(Math.max((y0 + y1 - side) / 2, 0), bitmap.height - side);
  const context = canvas.getContext("2d");
  context.imageSmoothingQuality = "high";
  context.drawImage(bitmap, left, top, side, side, 0, 0, canvas.width, canvas.height);
  bitmap.close();
  return true;
}
