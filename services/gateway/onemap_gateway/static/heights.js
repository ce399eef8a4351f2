// How high things on the map reach: from a small image, fetched only while somebody asks.

import { fetchImage } from "./api.js";

const PAUSE_MS = 2000; // between two images of a map that changes

export class Heights {
  constructor() {
    this.image = null; // { data: RGBA, width, height, bounds: [x_min, y_min, x_max, y_max] }
    this.revision = null; // of the map that it shows
    this.fetched = -Infinity;
  }

  // Fetch the image if the map has changed since; resolves to whether there is another.
  async refresh(revision) {
    const now = performance.now();
    if (revision === undefined || revision === this.revision || now - this.fetched < PAUSE_MS) return false;
    this.fetched = now;
    const { bitmap, headers } = await fetchImage("/v1/map/heights.png").catch(() => ({}));
    if (!bitmap) return false;
    const { width, height } = bitmap;
    const context = new OffscreenCanvas(width, height).getContext("2d");
    context.drawImage(bitmap, 0, 0);
    bitmap.close();
    const bounds = headers.get("X-OneMap-Bounds").split(",").map(Number);
    this.image = { data: context.getImageData(0, 0, width, height).data, width, height, bounds };
    this.revision = revision;
    return true;
  }

  // What to say of a place in metres of the map; empty where nothing stands, or it is not known.
  text([x, y]) {
    if (!this.image) return "";
    const { data, width, height, bounds: [x0, y0, x1, y1] } = this.image;
    const column = Math.floor(((x - x0) / (x1 - x0)) * width);
    const row = Math.floor(((y1 - y) / (y1 - y0)) * height);
    if (column < 0 || row < 0 || column >= width || row >= height) return "";
    const decimetres = data[4 * (row * width + column)];
    if (!decimetres) return "";
    return decimetres >= HIGHEST_DM ? "2.1 m high or more" : `about ${(decimetres / 10).toFixed(1)} m high`;
  }
}

const HIGHEST_DM = 22; // of SearchView.tops_dm: what is higher has this, too
