/** Files of what is seen. */

import { element } from "./elements.js";

const KINDS = [
  ["vtp", "Wires (VTP)", "The wires (of B) as polylines with their values, for ParaView"],
  ["stl", "Vessel (STL)", "The lumen (of B) as a closed surface, mm"],
  ["png", "Picture (PNG)", "What is seen, with the scale of the colours"],
  ["toml", "Case (TOML)", "The case file (of B), for braidcast simulate and predict"],
  ["html", "Report (HTML)", "One page with pictures, numbers and the model's card, to keep or to print as PDF"],
];

/** Buttons; `make[kind]()` → Blob, text or buffer, or a promise of it; `name()` without ending;
 * `complain(text)` of what could not be made, "" after what could. */
export function downloads(root, name, make, complain) {
  for (const [kind, text, title] of KINDS) {
    root.append(element("button", { type: "button", id: `download-${kind}`, text, title, onclick: async () => {
      try {
        const content = await make[kind]();
        save(content instanceof Blob ? content : new Blob([content]), `${name()}.${kind}`);
        complain("");
      } catch (error) {
        complain(`${text} could not be made: ${error.message}`);
      }
    } }));
  }
}

function save(blob, name) {
  const url = URL.createObjectURL(blob);
  element("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
