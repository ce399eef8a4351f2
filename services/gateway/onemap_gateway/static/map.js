// The map on a canvas: the gateway's image of the floor, and over it what moves.

import { letter } from "./choice.js";
import { short } from "./format.js";
import { listen } from "./gestures.js";
import { Heights } from "./heights.js";
import { PIN_PX, Pins } from "./pins.js";

// Custom properties of style.css, which has them for light and for dark pages.
const COLOURS = [
  "unknown", "trail", "path", "frontier", "region", "robot", "collided", "find", "ink",
  "robot-0", "robot-1", "robot-2", "robot-3",
];
const TRAIL_STEP_M = 0.05;
const TRAIL_JUMP_M = 1.0;
const ROBOT_MARGIN_M = 0.7; // around the robot when all of the map is shown
const GLIDE_S = 0.15; // states come every 0.2 s: the robot reaches one about when the next is here
const LABEL_PX = 16; // height of a label
const LABEL_GAP_PX = 7; // between two labels beside each other: their outlines, and a space
const PIN_LABEL_PX = 12; // to each side of a pin, where no label goes
const VIEW_S = 2; // an older view is not drawn
const VIEW_M = 2.5; // in which the drawn view of the camera fades
const TRAIL_PARTS = 24; // of the way driven, each fainter than the next
const FAINTEST = 0.12; // opacity of where the way began
const REACH_PX = 17; // around a pin's head in which a click is meant for it
const TOUCH_REACH_PX = 24; // the same for a finger
const FONT = "13px system-ui, 'DejaVu Sans', sans-serif";

export class MapView {
  // actions: onFind(find), onPlace([x, y] in metres), onMove()
  constructor(canvas, actions) {
    this.canvas = canvas;
    this.actions = actions;
    this.context = canvas.getContext("2d");
    this.image = null; // { bitmap, bounds: [x_min, y_min, x_max, y_max] }
    this.camera = { x: 0, y: 0, pixelsPerM: 60 };
    this.fitted = true; // follows the map as it grows, until the user moves it
    this.free = { top: 0, right: 0, bottom: 0 };
    this.state = null;
    this.answers = [];
    this.finds = [];
    this.pins = new Pins(() => (this.dirty = true));
    this.heights = new Heights();
    this.pointed = null; // [column, row] of the mouse
    this.places = null; // see places.js
    this.instead = null; // drawn in place of what is live: { places, draw(map) }
    this.marked = null; // [x, y]: the place that a window stands at
    this.robot = null;
    this.robots = []; // of this map, where there are several: { name, colour, own, state }
    this.trail = []; // of the newest search
    this.dirty = true;
    this.last = performance.now();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.showTheme();
    listen(this, (column, row, byTouch) => this.choose(column, row, byTouch));
    canvas.addEventListener("pointermove", (event) => this.hover(event));
    canvas.addEventListener("pointerleave", () => this.point(null));
    for (const name of ["focus", "blur"]) canvas.addEventListener(name, () => (this.dirty = true));
    requestAnimationFrame((now) => this.tick(now));
  }

  // Read the colours of the page, light or dark.
  showTheme() {
    const style = getComputedStyle(document.documentElement);
    this.colours = Object.fromEntries(
      COLOURS.map((name) => [name, style.getPropertyValue(`--map-${name}`).trim()]),
    );
    this.dirty = true;
  }

  show(state) {
    this.state = state;
    if (state.trail_m) this.trail = state.trail_m;
    else if (state.search?.id !== this.search) this.trail = [];
    this.search = state.search?.id;
    const robot = state.robot;
    if (robot && !this.robot) this.robot = { x: robot.x_m, y: robot.y_m, yaw: robot.yaw_rad };
    this.dirty = true;
  }

  showImage(bitmap, bounds) {
    this.image?.bitmap.close();
    this.image = { bitmap, bounds };
    if (this.fitted) this.fit();
    this.dirty = true;
  }

  showAnswers(answers) {
    this.answers = answers;
    this.dirty = true;
  }

  // finds: objects of /v1/objects, newest first
  showFinds(finds) {
    this.finds = [...finds].reverse(); // the newest is drawn last, over the others
    this.pins.load(finds);
    this.dirty = true;
  }

  showRobots(robots) {
    this.robots = robots;
    this.dirty = true;
  }

  // Draw a past search, or, with null, again what is live.
  showInstead(instead) {
    this.instead = instead;
    if (this.fitted) this.fit();
    this.dirty = true;
  }

  mark(place) {
    this.marked = place;
    this.dirty = true;
  }

  // Pixels at the edges of the canvas under which nothing lies when all of the map is shown.
  leaveFree(edges) {
    this.free = edges;
    if (this.fitted) this.fit();
  }

  fit() {
    this.fitted = true;
    this.dirty = true;
    if (!this.image) return;
    let [x0, y0, x1, y1] = this.image.bounds;
    const places = this.instead?.places ?? (this.robot ? [[this.robot.x, this.robot.y]] : []);
    for (const [x, y] of places) {
      [x0, y0] = [Math.min(x0, x - ROBOT_MARGIN_M), Math.min(y0, y - ROBOT_MARGIN_M)];
      [x1, y1] = [Math.max(x1, x + ROBOT_MARGIN_M), Math.max(y1, y + ROBOT_MARGIN_M)];
    }
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { top, right, bottom } = this.free;
    const columns = Math.max(width - right, 1);
    const rows = Math.max(height - top - bottom, 1);
    const pixelsPerM = Math.min((columns / (x1 - x0)) * 0.97, rows / (y1 - y0), 160);
    const x = (x0 + x1) / 2 + right / 2 / pixelsPerM;
    this.camera = { x, y: (y0 + y1) / 2 + (top - bottom) / 2 / pixelsPerM, pixelsPerM };
  }

  lookAt(x, y) {
    this.fitted = false;
    this.camera = { x, y, pixelsPerM: Math.max(this.camera.pixelsPerM, 90) };
    this.dirty = true;
  }

  zoom(factor, column = this.canvas.clientWidth / 2, row = this.canvas.clientHeight / 2) {
    this.fitted = false;
    const [x, y] = this.metres(column, row);
    const scale = Math.min(Math.max(this.camera.pixelsPerM * factor, 2), 600);
    const ratio = this.camera.pixelsPerM / scale;
    this.camera = {
      x: x + (this.camera.x - x) * ratio,
      y: y + (this.camera.y - y) * ratio,
      pixelsPerM: scale,
    };
    this.dirty = true;
  }

  pan(columns, rows) {
    this.fitted = false;
    this.camera.x -= columns / this.camera.pixelsPerM;
    this.camera.y += rows / this.camera.pixelsPerM;
    this.dirty = true;
  }

  // Canvas pixels of a point in map metres: x to the right, y up.
  pixels(x, y) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { x: cx, y: cy, pixelsPerM } = this.camera;
    return [width / 2 + (x - cx) * pixelsPerM, height / 2 - (y - cy) * pixelsPerM];
  }

  metres(column, row) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { x, y, pixelsPerM } = this.camera;
    return [x + (column - width / 2) / pixelsPerM, y - (row - height / 2) / pixelsPerM];
  }

  choose(column, row, byTouch) {
    if (this.instead) return; // the robot is not where it is shown
    const find = this.findAt(column, row, byTouch ? TOUCH_REACH_PX : REACH_PX);
    if (find) this.actions.onFind(find);
    else if (this.image) this.actions.onPlace(this.metres(column, row));
  }

  // The find whose pin is there; undefined if none is.
  findAt(column, row, reach) {
    return this.instead ? undefined : this.finds.findLast(({ position_m: [x, y] }) => {
      const [tip, base] = this.pixels(x, y);
      return Math.hypot(column - tip, row - base + PIN_PX) < reach;
    });
  }

  hover({ offsetX, offsetY, pointerType, buttons }) {
    const find = this.findAt(offsetX, offsetY, REACH_PX);
    this.canvas.style.cursor = find ? "pointer" : "";
    this.point(find || buttons || pointerType === "touch" ? null : [offsetX, offsetY]);
  }

  point(place) {
    this.pointed = place;
    this.dirty = true;
    if (place) this.askHeights();
  }

  // Have newer heights fetched, if there are; resolves to whether there are now.
  async askHeights() {
    const newer = await this.heights.refresh(this.state?.map?.revision);
    if (newer) this.dirty = true;
    return newer;
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(this.canvas.clientWidth * ratio);
    this.canvas.height = Math.round(this.canvas.clientHeight * ratio);
    if (this.fitted) this.fit();
    this.dirty = true;
  }

  tick(now) {
    const passed = Math.min((now - this.last) / 1000, 0.5);
    this.last = now;
    if (this.glide(passed) || this.dirty) {
      this.dirty = false;
      this.draw();
      this.actions.onMove();
    }
    requestAnimationFrame((next) => this.tick(next));
  }

  // Move the shown robot towards the reported one; returns whether it moved.
  glide(passed) {
    const target = this.state?.robot;
    if (!target || !this.robot) return false;
    const robot = this.robot;
    const dx = target.x_m - robot.x;
    const dy = target.y_m - robot.y;
    const turn = Math.atan2(Math.sin(target.yaw_rad - robot.yaw), Math.cos(target.yaw_rad - robot.yaw));
    if (Math.abs(dx) + Math.abs(dy) < 1e-3 && Math.abs(turn) < 1e-3) return false;
    const jumps = Math.hypot(dx, dy) > TRAIL_JUMP_M;
    const share = jumps ? 1 : 1 - Math.exp(-passed / GLIDE_S);
    robot.x += dx * share;
    robot.y += dy * share;
    robot.yaw += turn * share;
    if (jumps) this.trail = [];
    const end = this.trail[this.trail.length - 1];
    if (!end || Math.hypot(robot.x - end[0], robot.y - end[1]) > TRAIL_STEP_M) {
      this.trail.push([robot.x, robot.y]);
      if (this.trail.length > 4000) this.trail.shift();
    }
    return true;
  }

  draw() {
    const { context, canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    this.labels = []; // drawn so far: { column, right, row }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = this.colours.unknown;
    context.fillRect(0, 0, canvas.clientWidth, canvas.clientHeight);
    if (this.image) this.drawImage();
    if (this.instead) this.instead.draw(this);
    else if (this.state) this.drawLive();
    else return;
    const middle = [canvas.clientWidth / 2, canvas.clientHeight / 2];
    if (this.marked) this.drawCross(...this.pixels(...this.marked));
    else if (!this.instead && canvas.matches(":focus-visible")) this.drawCross(...middle);
    if (this.pointed) this.label(this.heights.text(this.metres(...this.pointed)), this.pointed[0] + 12, this.pointed[1] - 8, this.colours.ink);
    this.drawScaleBar();
  }

  drawLive() {
    const path = this.state.path;
    if (this.image) this.places?.draw(this);
    this.drawTrail(this.state.search?.active ? 1 : 0.8);
    if (path) this.drawPlan(path);
    for (const { own, colour, state } of this.robots) {
      if (!own && state?.camera?.age_s < VIEW_S) this.drawView(state.camera.view, colour);
    }
    if (this.state.camera?.age_s < VIEW_S) this.drawView(this.state.camera.view, this.own.colour);
    this.drawOptions(this.state.search);
    for (const { text, regions } of this.answers) {
      const prefix = this.answers.length > 1 ? `${text} ` : "";
      for (const region of regions) this.drawRegion(region, prefix);
    }
    for (const find of this.finds) this.drawPin(find);
    for (const find of this.finds) this.nameFind(find);
    if (this.image) this.places?.nameAll(this);
    this.drawRobots();
  }

  drawImage() {
    const [x0, y0, x1, y1] = this.image.bounds;
    const [left, top] = this.pixels(x0, y1);
    const [right, bottom] = this.pixels(x1, y0);
    this.context.imageSmoothingEnabled = true;
    this.context.imageSmoothingQuality = "high";
    this.context.drawImage(this.image.bitmap, left, top, right - left, bottom - top);
  }

  // The way driven, fainter the longer ago.
  drawTrail(opacity) {
    const { trail } = this;
    const parts = Math.min(TRAIL_PARTS, trail.length - 1);
    for (let part = 0; part < parts; part += 1) {
      const [first, last] = [part, part + 1].map((count) => Math.round((count * (trail.length - 1)) / parts));
      const share = FAINTEST + (1 - FAINTEST) * ((part + 1) / parts);
      this.line(trail.slice(first, last + 1), this.colours.trail, 2.5, opacity * share, "butt");
    }
  }

  drawPlan(path) {
    path.frontiers_m.forEach(([x, y], i) => {
      const score = Math.min(Math.max(path.frontier_scores[i] ?? 0, 0), 1);
      this.dot(x, y, 2.5 + 4.5 * score, this.colours.frontier, 0.55 + 0.45 * score);
    });
    for (const [x, y] of path.regions_m) this.ring(x, y, 10, this.colours.region);
    this.line(path.points_m, this.colours.path, 2.5, 0.95);
    for (const [x, y] of path.goal_m) this.ring(x, y, 6, this.colours.path);
  }

  // What the camera saw last, from above.
  drawView({ x_m: x, y_m: y, left_rad: left, right_rad: right }, colour) {
    const { context } = this;
    const [column, row] = this.pixels(x, y);
    const radius = VIEW_M * this.camera.pixelsPerM;
    const light = context.createRadialGradient(column, row, 0, column, row, radius);
    light.addColorStop(0, this.colours[colour]);
    light.addColorStop(1, "transparent");
    context.globalAlpha = 0.3;
    context.fillStyle = light;
    context.beginPath();
    context.moveTo(column, row);
    context.arc(column, row, radius, -left, -right);
    context.fill();
    context.globalAlpha = 1;
  }

  // The letters of the goals that were weighed, as in the table "Why there?".
  drawOptions(search) {
    const options = search?.active ? (search.choice?.options ?? []) : [];
    options.forEach(({ xy_m: [x, y], chosen }, index) => {
      const [column, row] = this.pixels(x, y);
      this.label(letter(index), column + 8, row - 6, chosen ? this.colours.path : this.colours.ink);
    });
  }

  drawRegion(region, prefix) {
    const { context } = this;
    const [x0, y0, x1, y1] = region.extent_m;
    const [left, top] = this.pixels(x0, y1);
    const [right, bottom] = this.pixels(x1, y0);
    context.strokeStyle = this.colours.region;
    context.lineWidth = region.rank === 1 ? 2 : 1;
    context.setLineDash([5, 4]);
    context.beginPath();
    context.roundRect(left - 4, top - 4, right - left + 8, bottom - top + 8, 6);
    context.stroke();
    context.setLineDash([]);
    this.label(`${prefix}${region.rank}`, left, top - 10, this.colours.region);
  }

  drawFind(find) {
    this.drawPin(find);
    this.nameFind(find);
  }

  // No label lies on its head.
  drawPin(find) {
    const [column, row] = this.pixels(...find.position_m);
    this.pins.draw(this.context, find, column, row, this.colours);
    for (const line of [row - LABEL_PX / 2, row - PIN_PX]) {
      this.labels.push({ column: column - PIN_LABEL_PX, right: column + PIN_LABEL_PX, row: line });
    }
  }

  nameFind({ name, position_m: place }) {
    const [column, row] = this.pixels(...place);
    this.label(short(name), column + 20, row - PIN_PX + 5, this.colours.ink);
  }

  // The chosen place, or the one that Enter chooses.
  drawCross(column, row) {
    const { context } = this;
    for (const [colour, width] of [[this.colours.unknown, 5], [this.colours.robot, 2]]) {
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.beginPath();
      for (const [dx, dy] of [[1, 0], [0, 1], [-1, 0], [0, -1]]) {
        context.moveTo(column + 3 * dx, row + 3 * dy);
        context.lineTo(column + 11 * dx, row + 11 * dy);
      }
      context.stroke();
    }
  }

  // Name and colour of this page's robot.
  get own() {
    return this.robots.find(({ own }) => own) ?? { name: "", colour: "robot" };
  }

  drawRobots() {
    for (const { name, colour, own, state } of this.robots) {
      if (own || !state?.robot) continue;
      const { x_m: x, y_m: y, yaw_rad: yaw, collided } = state.robot;
      if (state.path) this.line(state.path.points_m, this.colours[colour], 1.5, 0.8);
      this.drawRobot({ x, y, yaw }, collided, colour, name);
    }
    const { name, colour } = this.own;
    if (this.robot) this.drawRobot(this.robot, this.state.robot?.collided, colour, name);
  }

  drawRobot({ x, y, yaw }, collided, colour, name) {
    const { context } = this;
    const [column, row] = this.pixels(x, y);
    context.save();
    context.translate(column, row);
    context.rotate(-yaw);
    context.beginPath();
    context.moveTo(13, 0);
    context.lineTo(-9, 8.5);
    context.lineTo(-4.5, 0);
    context.lineTo(-9, -8.5);
    context.closePath();
    context.fillStyle = this.colours[collided ? "collided" : colour];
    context.strokeStyle = this.colours.unknown;
    context.lineWidth = 2.5;
    context.lineJoin = "round";
    context.stroke();
    context.fill();
    context.restore();
    if (!name) return;
    context.font = FONT;
    const right = column + 12; // or left of it, where something stands on the right
    const left = column - 12 - context.measureText(name).width;
    this.label(name, this.isFree(name, right, row + 18) ? right : left, row + 18, this.colours[colour]);
  }

  drawScaleBar() {
    const { context, canvas } = this;
    const longest = Math.min(canvas.clientWidth / 4, 180) / this.camera.pixelsPerM;
    const length = [100, 50, 20, 10, 5, 2, 1, 0.5, 0.2, 0.1].find((m) => m <= longest) ?? 0.1;
    const left = 18;
    const right = left + length * this.camera.pixelsPerM;
    const row = canvas.clientHeight - 20 - (this.instead ? this.free.bottom - 14 : 0);
    context.strokeStyle = this.colours.ink;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(left, row - 5);
    context.lineTo(left, row);
    context.lineTo(right, row);
    context.lineTo(right, row - 5);
    context.stroke();
    this.label(`${length} m`, left + 2, row - 9, this.colours.ink);
  }

  line(points, colour, width, opacity, cap = "round") {
    if (points.length < 2) return;
    const { context } = this;
    context.globalAlpha = opacity;
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.lineJoin = "round";
    context.lineCap = cap;
    context.beginPath();
    for (const [x, y] of points) context.lineTo(...this.pixels(x, y));
    context.stroke();
    context.globalAlpha = 1;
  }

  dot(x, y, radius, colour, opacity) {
    const { context } = this;
    context.globalAlpha = opacity;
    context.fillStyle = colour;
    context.beginPath();
    context.arc(...this.pixels(x, y), radius, 0, 2 * Math.PI);
    context.fill();
    context.globalAlpha = 1;
  }

  ring(x, y, radius, colour) {
    const { context } = this;
    context.strokeStyle = colour;
    context.lineWidth = 2;
    context.beginPath();
    context.arc(...this.pixels(x, y), radius, 0, 2 * Math.PI);
    context.stroke();
  }

  // Whether a label there would lie on no other.
  isFree(text, column, row) {
    this.context.font = FONT;
    const right = column + this.context.measureText(text).width;
    return !this.labels.some(
      (box) =>
        column < box.right + LABEL_GAP_PX &&
        box.column < right + LABEL_GAP_PX &&
        Math.abs(row - box.row) < LABEL_PX,
    );
  }

  label(text, column, row, colour) {
    if (!text) return;
    const { context } = this;
    while (!this.isFree(text, column, row)) row -= LABEL_PX; // above the label that stands there
    context.font = FONT;
    this.labels.push({ column, right: column + context.measureText(text).width, row });
    context.lineWidth = 4;
    context.lineJoin = "round";
    context.strokeStyle = this.colours.unknown;
    context.strokeText(text, column, row);
    context.fillStyle = colour;
    context.fillText(text, column, row);
  }
}
