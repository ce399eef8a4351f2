// What the pointer and the keyboard do to the map: move, zoom, choose a place.

const DRAG_PX = 6; // a press that moves less is a click
const STEP_PX = 60; // of an arrow key

// view: a MapView. onPlace(column, row, byTouch): a place was chosen, not a drag.
export function listen(view, onPlace) {
  const { canvas } = view;
  const pointers = new Map();
  let start = null; // where the press began; null once it is a drag

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    start = pointers.size ? null : event;
    pointers.set(event.pointerId, event);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    if (start && distance(event, start) < DRAG_PX) return;
    start = null;
    if (pointers.size === 2) {
      const [other] = [...pointers.values()].filter((p) => p.pointerId !== event.pointerId);
      const factor = distance(event, other) / Math.max(distance(before, other), 1);
      view.zoom(factor, other.offsetX, other.offsetY);
    } else {
      view.pan(event.offsetX - before.offsetX, event.offsetY - before.offsetY);
    }
    pointers.set(event.pointerId, event);
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener("click", (event) => {
    // the second click of a double one fits the map
    if (start && event.detail < 2) onPlace(event.offsetX, event.offsetY, event.pointerType === "touch");
  });
  canvas.addEventListener("contextmenu", (event) => {
    event.preventDefault(); // a right click, or a long press on a touch screen
    onPlace(event.offsetX, event.offsetY, event.pointerType === "touch");
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      view.zoom(Math.exp(-event.deltaY * 0.0015), event.offsetX, event.offsetY);
    },
    { passive: false },
  );
  canvas.addEventListener("dblclick", () => view.fit());
  canvas.addEventListener("keydown", (event) => {
    const action = keyAction(event.key, view, onPlace);
    if (!action || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    action();
  });
}

function keyAction(key, view, onPlace) {
  const { clientWidth: width, clientHeight: height } = view.canvas;
  const actions = {
    ArrowLeft: () => view.pan(STEP_PX, 0),
    ArrowRight: () => view.pan(-STEP_PX, 0),
    ArrowUp: () => view.pan(0, STEP_PX),
    ArrowDown: () => view.pan(0, -STEP_PX),
    "+": () => view.zoom(1.25),
    "=": () => view.zoom(1.25),
    "-": () => view.zoom(0.8),
    0: () => view.fit(),
    Enter: () => onPlace(width / 2, height / 2, false),
  };
  return actions[key];
}

function distance(a, b) {
  return Math.hypot(a.offsetX - b.offsetX, a.offsetY - b.offsetY);
}
