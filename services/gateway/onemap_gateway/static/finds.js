// The finds of all searches since the page was opened; they stay when their search has ended.

const SAME_PLACE_M = 0.5; // two finds of one name that are nearer are one object, seen twice

export class Finds {
  constructor() {
    this.byResult = new Map(); // "search/index" -> { name, x, y }
    this.frames = 0;
  }

  // Take the finds of a state; forget all when the map was cleared or replaced.
  update(state) {
    const frames = state.map?.frames_fused ?? this.frames;
    if (frames < this.frames) this.byResult.clear();
    this.frames = frames;
    const { search } = state;
    (search?.results ?? []).forEach((result, index) => {
      const key = `${search.id}/${index}`;
      if (result.outcome !== "found" || !result.position_m || this.byResult.has(key)) return;
      this.add(key, { name: result.name, x: result.position_m[0], y: result.position_m[1] });
    });
  }

  add(key, find) {
    for (const [other, { name, x, y }] of this.byResult) {
      if (name === find.name && Math.hypot(x - find.x, y - find.y) < SAME_PLACE_M) {
        this.byResult.delete(other);
      }
    }
    this.byResult.set(key, find);
  }

  list() {
    return [...this.byResult.values()];
  }
}
