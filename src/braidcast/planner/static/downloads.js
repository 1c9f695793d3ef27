/** Files of what is seen. */

import { element } from "./elements.js";

const KINDS = [
  ["vtp", "Wires (VTP)", "The wires as polylines with their values, for ParaView"],
  ["stl", "Vessel (STL)", "The lumen as a closed surface, mm"],
  ["png", "Picture (PNG)", "The picture as it is seen"],
  ["toml", "Case (TOML)", "The case file, for braidcast simulate and predict"],
  ["html", "Report (HTML)", "One page with pictures, numbers and the model's card, to keep or to print as PDF"],
];

/** Buttons; `make[kind]()` → Blob, text or buffer, or a promise of it; `name()` without ending. */
export function downloads(root, name, make, onError) {
  for (const [kind, text, title] of KINDS) {
    root.append(element("button", { type: "button", id: `download-${kind}`, text, title, onclick: async () => {
      try {
        const content = await make[kind]();
        save(content instanceof Blob ? content : new Blob([content]), `${name()}.${kind}`);
      } catch (error) {
        onError(`${text} could not be made: ${error.message}`);
      }
    } }));
  }
}

function save(blob, name) {
  const url = URL.createObjectURL(blob);
  element("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
