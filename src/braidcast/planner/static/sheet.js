/** Pictures side by side, their captions and the scale of their colours, as one PNG. */

import { ticksOf } from "./legend.js";
import { pngOf } from "./view.js";
import { palette } from "./wires.js";

const MARGIN = 10, BAR = 200, FOOT = 70; // CSS pixels

/** `pictures`: [{view, caption}]; `scale`: {kind, range, palette, title} or null. → Blob */
export async function sheet(pictures, scale) {
  const images = await Promise.all(pictures.map(async ({ view }) => createImageBitmap(await view.png())));
  const { colours, canvas: first } = pictures[0].view;
  const ratio = images[0].width / first.clientWidth;
  const canvas = document.createElement("canvas");
  canvas.width = images.reduce((sum, { width }) => sum + width, 0);
  canvas.height = images[0].height + Math.round(FOOT * ratio);
  const context = canvas.getContext("2d");
  context.fillStyle = colours.background;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.scale(ratio, ratio);
  context.font = "12px system-ui, sans-serif";
  context.fillStyle = colours.text;
  const top = images[0].height / ratio;
  let left = 0;
  images.forEach((image, i) => {
    const [width, height] = [image.width / ratio, image.height / ratio];
    context.drawImage(image, left, 0, width, height);
    context.fillText(pictures[i].caption, left + MARGIN, top + 14, width - 2 * MARGIN);
    left += width;
  });
  if (scale) drawScale(context, scale, top, colours.text);
  return pngOf(canvas);
}

function drawScale(context, scale, top, text) {
  context.fillText(scale.title, MARGIN, top + 32);
  const gradient = context.createLinearGradient(MARGIN, 0, MARGIN + BAR, 0);
  const colours = palette(scale.palette);
  colours.forEach((colour, i) => gradient.addColorStop(i / (colours.length - 1), colour));
  context.fillStyle = gradient;
  context.fillRect(MARGIN, top + 38, BAR, 10);
  context.fillStyle = text;
  ticksOf(scale).forEach((tick, i) => {
    context.textAlign = ["left", "center", "right"][i];
    context.fillText(tick, MARGIN + (i * BAR) / 2, top + 62);
  });
}
