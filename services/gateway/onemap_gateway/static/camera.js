// The camera image with a labelled box around each detection.

const BOX = "#ffbe5c";

export class CameraView {
  constructor(canvas, numbers) {
    this.canvas = canvas;
    this.numbers = numbers;
    this.context = canvas.getContext("2d");
    this.bitmap = null;
  }

  showImage(bitmap) {
    this.bitmap?.close();
    this.bitmap = bitmap;
  }

  show(camera) {
    const seen = camera.detections.map((d) => `${d.name} ${d.score.toFixed(2)}`);
    const flow = camera.age_s > 2 ? `silent for ${camera.age_s.toFixed(0)} s` : `${camera.rate_hz.toFixed(0)} Hz`;
    this.numbers.textContent = [`Camera, ${flow}`, ...seen].join(" · ");
    this.canvas.setAttribute("aria-label", `Camera image. ${seen.join(", ") || "Nothing detected."}`);
    if (this.bitmap) this.draw(camera);
  }

  draw(camera) {
    const { canvas, context, bitmap } = this;
    const zoom = Math.max(1, 640 / bitmap.width); // boxes and letters stay sharp on small images
    canvas.width = Math.round(bitmap.width * zoom);
    canvas.height = Math.round(bitmap.height * zoom);
    context.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
    context.font = "600 22px system-ui, 'DejaVu Sans', sans-serif";
    for (const { name, box_px: box } of camera.detections) {
      const [x0, y0, x1, y1] = box.map((value) => value * zoom);
      context.strokeStyle = BOX;
      context.lineWidth = 3;
      context.beginPath();
      context.roundRect(x0, y0, x1 - x0, y1 - y0, 5);
      context.stroke();
      const width = context.measureText(name).width + 14;
      const left = Math.min(Math.max(x0, 0), canvas.width - width);
      const top = Math.max(y0 - 30, 0);
      context.fillStyle = BOX;
      context.beginPath();
      context.roundRect(left, top, width, 28, 5);
      context.fill();
      context.fillStyle = "#1a1206";
      context.fillText(name, left + 7, top + 21);
    }
  }
}
