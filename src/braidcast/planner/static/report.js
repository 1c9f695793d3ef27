/** One page with pictures, numbers and the model's card, complete in itself, to keep or to print (on one A4). */

import { card } from "./card.js";
import { element } from "./elements.js";
import { stripPicture } from "./strip.js";

const STYLE = `
  body { font: 14px/1.45 system-ui, sans-serif; color: #1a1d21; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
  h1 { font-size: 1.5rem; margin: 0; } h2 { font-size: 1.1rem; margin: 1.4rem 0 .4rem; border-bottom: 1px solid #c8ced6; }
  h3, h4 { font-size: 1rem; margin: 1rem 0 .3rem; }
  .warning { border: 2px solid #b45309; padding: .4rem .7rem; font-weight: 600; }
  figure { margin: .6rem 0; display: inline-block; vertical-align: top; width: 49%; } figure:first-of-type { width: 100%; } figure img { max-width: 100%; border: 1px solid #c8ced6; }
  .strip { border: 1px solid #c8ced6; } .strip svg { display: block; width: 100%; height: 70px; } .safe { fill: #d6e8f5; }
  .curve { fill: none; stroke: #0b62a4; stroke-width: 2; vector-effect: non-scaling-stroke; }
  .threshold { stroke: #555; stroke-dasharray: 6 4; vector-effect: non-scaling-stroke; }
  .now { stroke: #b45309; stroke-width: 2; vector-effect: non-scaling-stroke; }
  table { border-collapse: collapse; margin: .4rem 0; } th, td { border: 1px solid #c8ced6; padding: .2rem .5rem; text-align: left; font-weight: 400; }
  td { font-variant-numeric: tabular-nums; } pre { background: #f2f4f7; padding: .6rem; white-space: pre-wrap; } pre code { display: block; font: inherit; } pre code + code { margin-top: 1lh; } .card { font-size: .92em; }
  @media print {
    @page { size: A4; margin: 9mm 10mm; }
    body { margin: 0; padding: 0; max-width: none; font: 8pt/1.3 Arial, "Liberation Sans", Helvetica, sans-serif; }
    h1 { font-size: 13pt; } h2 { font-size: 9pt; margin: 1.5mm 0 .8mm; break-after: avoid; } h3, h4 { font-size: 8pt; margin: 1.2mm 0 .4mm; break-after: avoid; }
    p { margin: .8mm 0; } .warning { padding: .8mm 2mm; border-width: 1.5pt; }
    .remark { display: inline; font-size: 7.5pt; } .remark::after { content: " "; }
    .pictures { display: grid; grid-template-columns: 2fr 1fr; gap: 0 2mm; }
    figure, figure:first-of-type { width: auto; margin: .5mm 0; break-inside: avoid; } figure:first-of-type { grid-row: span 2; } figure:only-of-type { grid-column: 1 / -1; }
    figure img { display: block; max-height: 68mm; margin: auto; } figure:only-of-type img { max-height: 52mm; } figure:not(:first-of-type) img { max-height: 31mm; } figcaption { font-size: 7pt; text-align: center; }
    .strip svg { height: 9mm; }
    .texts { columns: 3; column-gap: 4mm; } .texts > h2:first-child { margin-top: 0; }
    table { width: 100%; margin: .5mm 0; font-size: 7.2pt; line-height: 1.15; } tr { break-inside: avoid; } th, td { padding: .1mm .6mm; overflow-wrap: break-word; }
    pre, .card, .card table { font-size: 6.7pt; line-height: 1.22; } pre { margin: 0; padding: 0; background: none; overflow-wrap: anywhere; } pre code + code { margin-top: .8mm; }
    .card code { font-size: 6.5pt; line-height: 1; } .card ul { margin: 0; padding-left: 3mm; }
  }`;

/**
 * The report's HTML. `pictures`: [{caption, url}] data URLs; `tables`: [{title, head, rows}] of
 * texts; `strip`: {probabilities, threshold, eta} or null; `remarks`: sentences; `toml`, `markdown`.
 */
export function report({ title, made, version, modelName, remarks, pictures, tables, strip, toml, markdown }) {
  const heading = (text) => element("h2", { text });
  const body = element("body", {},
    element("h1", { text: title || "Deployment of a braided stent" }),
    element("p", { text: `braidcast planner ${version}, ${made}. Model: ${modelName || "none"}.` }),
    element("p", { class: "warning", text: "Not a medical device. For research on and engineering of braided stents; not for diagnosis or treatment." }),
    ...remarks.map((text) => element("p", { class: "remark", text })),
    element("div", { class: "pictures" }, ...pictures.map(({ caption, url }) => element("figure", {}, element("img", { src: url, alt: caption }), element("figcaption", { text: caption })))));
  if (strip) {
    const drawn = element("div", { class: "strip" });
    drawn.innerHTML = stripPicture(strip.probabilities, strip.threshold, strip.eta);
    body.append(heading("Probability of success along the vessel"), drawn,
      element("p", { text: `From η = 0 (left) to η = 1 (right), 0 to 100 % upwards; dashed: the threshold of ${(100 * strip.threshold).toFixed(0)} %; the line: this site, η = ${strip.eta.toFixed(3)}.` }));
  }
  const texts = element("div", { class: "texts" }); // columns on paper
  for (const { title: name, head, rows } of tables) {
    texts.append(heading(name), element("table", {},
      ...(head ? [element("tr", {}, ...head.map((text) => element("th", { text })))] : []),
      ...rows.map(([what, ...values]) => element("tr", {}, element("th", { text: what }), ...values.map((text) => element("td", { text }))))));
  }
  texts.append(heading("The case"), element("pre", {}, ...toml.trim().split(/\n{2,}/).map((text) => element("code", { text: `${text}\n` }))));
  if (markdown) texts.append(card(markdown));
  body.append(texts);
  const head = element("head", {}, element("meta", { charset: "utf-8" }), element("title", { text: `braidcast: ${title || "report"}` }), element("style", { text: STYLE }));
  return `<!doctype html>\n${element("html", { lang: "en" }, head, body).outerHTML}\n`;
}
