// Pictures to ask with: chosen, dropped on the page, or the robot's own.

import { fetchImage } from "./api.js";
import { CropDialog } from "./crop.js";
import { by } from "./panels.js";

const WHOLE = 1;
const MIDDLE = 0.5; // of a camera image, which shows more than one thing
const NO_IMAGE = "This file is no image that the browser can read: take a PNG or a JPEG.";

// onAsk(image): a crop as a data URL. act(button, task): runs a task, shows its error.
export function listenForPictures(onAsk, act) {
  const crop = new CropDialog(onAsk);
  const file = by("image-file");
  const open = (chosen) =>
    act(by("image-choose"), async () => {
      crop.show(await createImageBitmap(chosen).catch(() => Promise.reject(new Error(NO_IMAGE))), WHOLE);
    });

  by("image-choose").addEventListener("click", () => file.click());
  file.addEventListener("change", () => {
    if (file.files.length) open(file.files[0]);
    file.value = ""; // the same file may be chosen again
  });
  by("image-camera").addEventListener("click", () =>
    act(by("image-camera"), async () => {
      crop.show((await fetchImage("/v1/camera.jpg?detections=false")).bitmap, MIDDLE);
    }),
  );
  listenForDrops(open);
}

function listenForDrops(open) {
  const page = document.body;
  const show = (dropping) => page.classList.toggle("dropping", dropping);
  document.addEventListener("dragover", (event) => {
    if (!event.dataTransfer.types.includes("Files")) return;
    event.preventDefault(); // else the browser leaves the page for the file
    show(true);
  });
  document.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) show(false); // out of the window
  });
  document.addEventListener("drop", (event) => {
    if (!event.dataTransfer.files.length) return;
    event.preventDefault();
    show(false);
    if (!by("token-dialog").open) open(event.dataTransfer.files[0]);
  });
}
