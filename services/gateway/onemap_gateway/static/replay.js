// The replay of a past search: where the robot was, its goals and reasons, in place of what is live.

import { read } from "./api.js";
import { capital, clockTime, duration, place } from "./format.js";
import { by, reveal, searchTitle } from "./panels.js";

const WHOLE_S = 30; // in which a whole search is played at the latest
const FRAME_MS = 200; // a hidden page draws no frames: it goes on from where it was
const TURN_M = 0.1; // of way from which the robot's heading is told

export class Replay {
  // onChange(): it was opened or closed
  constructor(map, onChange) {
    this.map = map;
    this.onChange = onChange;
    this.record = null; // of /v1/searches/{id}/replay
    this.playing = false;
    by("replay-live").addEventListener("click", () => this.close());
    by("replay-tag").addEventListener("click", () => this.close());
    by("replay-play").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    by("replay-before").addEventListener("click", () => this.turn(-1));
    by("replay-after").addEventListener("click", () => this.turn(1));
    by("replay-time").addEventListener("input", (event) => {
      this.pause();
      this.seek(Number(event.target.value));
    });
    by("replay").addEventListener("keydown", (event) => event.key === "Escape" && this.close());
  }

  get isOpen() {
    return Boolean(this.record);
  }

  // search: of /v1/searches; opener: what gets the focus back
  async open(search, opener) {
    const record = await read(`/v1/searches/${search.id}/replay`);
    this.pause(); // another one may be shown
    this.record = record;
    this.opener = opener;
    const ends = [record.path_m.at(-1)?.[0], record.steps.at(-1)?.elapsed_s];
    this.whole = Math.max(...ends.map((end) => end ?? 0), 0.1);
    const began = clockTime(record.search.started_at);
    by("replay-title").textContent = `${searchTitle(record.search)}, ${began}`;
    by("replay-tag").textContent = `Replay of ${began}`;
    by("replay-time").max = this.whole;
    by("replay-left-out").hidden = !record.left_out;
    by("replay-left-out").textContent = ` ${record.left_out} of its steps are left out.`;
    this.show(true);
    this.seek(0);
    reveal(this.map.canvas);
    by("replay-play").focus({ preventScroll: true });
  }

  close() {
    if (!this.record) return;
    this.pause();
    const focused = document.activeElement?.closest("#replay, #replay-tag");
    this.record = null;
    this.show(false);
    if (focused) this.opener.focus({ preventScroll: true });
  }

  show(open) {
    by("replay").hidden = !open;
    by("replay-tag").hidden = !open;
    document.body.classList.toggle("replaying", open);
    this.map.showInstead(open ? this : null);
    this.onChange();
  }

  // Of the newest step at this time; -1: there was none yet.
  get index() {
    const { steps } = this.record;
    return steps.findLastIndex(({ elapsed_s: at }) => at <= this.time);
  }

  // Go to the step before or after the present one.
  turn(count) {
    this.pause();
    const { steps } = this.record;
    const index = Math.min(Math.max(this.index + count, 0), steps.length - 1);
    if (steps.length) this.seek(steps[index].elapsed_s);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.whole);
    this.map.dirty = true;
    const step = this.record.steps[Math.max(this.index, 0)];
    const state = (step?.state ?? "").replaceAll("_", " ");
    const range = by("replay-time");
    range.value = this.time;
    const clock = `${duration(this.time)} of ${duration(this.whole)}`;
    range.setAttribute("aria-valuetext", `${clock}, ${state}`);
    by("replay-clock").textContent = clock;
    by("replay-state").textContent = state;
    by("replay-state").className = `state ${step?.state ?? ""}`;
    by("replay-reason").textContent = step ? `${capital(step.reason)}.` : "No step was recorded.";
    by("replay-goal").textContent = step?.goal_m
      ? `Goal: ${step.goal_kind.replaceAll("_", " ")} at ${place(step.goal_m)} m.`
      : "";
  }

  play() {
    if (this.time >= this.whole) this.seek(0);
    this.showPlaying(true);
    let last = performance.now();
    const speed = Math.max(1, this.whole / WHOLE_S);
    const tick = (now) => {
      if (!this.playing) return;
      this.seek(this.time + (Math.min(Math.max(now - last, 0), FRAME_MS) / 1000) * speed);
      last = now;
      if (this.time >= this.whole) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.showPlaying(false);
  }

  // A screen reader is told the reasons while it does not play.
  showPlaying(playing) {
    this.playing = playing;
    by("replay-play").textContent = playing ? "Pause" : "Play";
    by("replay-words").setAttribute("aria-live", playing ? "off" : "polite");
  }

  // What the map draws in place of what is live; also the places that it fits.
  get places() {
    return this.record.path_m.map(([, x, y]) => [x, y]);
  }

  draw(map) {
    const { path_m: path, steps, search } = this.record;
    const { colours } = map;
    const passed = path.filter(([at]) => at <= this.time).map(([, x, y]) => [x, y]);
    const robot = this.robotAt(this.time);
    if (robot) passed.push([robot.x, robot.y]);
    map.line(this.places, colours.trail, 2, 0.35);
    map.line(passed, colours.trail, 3, 1);
    for (const result of search.results) {
      const kept = map.finds.find((find) => find.search_id === search.id && find.name === result.name);
      if (result.position_m) map.drawFind(kept ?? result); // kept: with its photograph
    }
    const goal = steps[this.index]?.goal_m;
    if (goal && robot) map.line([[robot.x, robot.y], goal], colours.path, 1.5, 0.6);
    if (goal) map.ring(...goal, 7, colours.path);
    if (robot) map.drawRobot(robot, false, "robot", "");
  }

  // Where the robot was, between the places that were recorded.
  robotAt(time) {
    const { path_m: path } = this.record;
    if (!path.length) return null;
    const after = path.findIndex(([at]) => at > time);
    const next = path[after < 0 ? path.length - 1 : after];
    const before = path[after < 0 ? path.length - 1 : Math.max(after - 1, 0)];
    const span = next[0] - before[0];
    const share = span > 0 ? Math.min(Math.max((time - before[0]) / span, 0), 1) : 0;
    const [x, y] = [1, 2].map((axis) => before[axis] + (next[axis] - before[axis]) * share);
    return { x, y, yaw: this.yawAt(after < 0 ? path.length - 1 : after) };
  }

  // The direction of the way that leads to this place of the path.
  yawAt(index) {
    const { path_m: path } = this.record;
    const [, x, y] = path[index];
    const far = ([, a, b]) => Math.hypot(x - a, y - b) > TURN_M;
    const from = path.slice(0, index).findLast(far);
    const to = from ? null : path.slice(index).find(far);
    if (from) return Math.atan2(y - from[2], x - from[1]);
    return to ? Math.atan2(to[2] - y, to[1] - x) : 0;
  }
}
