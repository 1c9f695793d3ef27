// Scale and axes, drawn over the picture.

import { roundLength } from "./views.js";

const AXES = ["#d55e00", "#009e73", "#3f8fd2"]; // of x, y, z

/** On a 2D context of [width, height] CSS pixels: a scale at the lower left and above it the axes of
 * space, whose directions on the screen are the columns of `turn` (16 numbers, column by column). */
export function drawRuler(context, [width, height], millimetresPerPixel, turn, colours) {
  const length = roundLength(millimetresPerPixel * Math.min(160, width / 3));
  const [left, low] = [16, height - 16];
  // Everything twice, first as a halo: wires may lie below.
  const halo = { strokeStyle: colours.background, lineWidth: 4, lineJoin: "round", globalAlpha: 0.8 };
  const plain = { lineWidth: 2, globalAlpha: 1 };
  const path = (points, colour) => {
    context.beginPath();
    points.forEach((point) => context.lineTo(...point));
    for (const style of [halo, { ...plain, strokeStyle: colour }]) Object.assign(context, style).stroke();
  };
  const write = (text, x, y, colour) => {
    Object.assign(context, halo).strokeText(text, x, y);
    Object.assign(context, plain, { fillStyle: colour }).fillText(text, x, y);
  };
  const right = left + length / millimetresPerPixel;
  Object.assign(context, { font: "12px system-ui, sans-serif", textAlign: "left", textBaseline: "bottom" });
  path([[left, low - 5], [left, low], [right, low], [right, low - 5]], colours.text);
  write(`${Number(length.toPrecision(3))} mm`, left + 5, low - 4, colours.text);

  const [x0, y0] = [left + 30, low - 62];
  const axes = [0, 1, 2].map((k) => ({ k, x: turn[4 * k], y: -turn[4 * k + 1], depth: turn[4 * k + 2] }));
  Object.assign(context, { textAlign: "center", textBaseline: "middle" });
  for (const { k, x, y } of axes.sort((a, b) => a.depth - b.depth)) {
    path([[x0, y0], [x0 + 24 * x, y0 + 24 * y]], AXES[k]);
    write("xyz"[k], x0 + 32 * x, y0 + 32 * y, AXES[k]);
  }
}
