/** The model card's Markdown, of which it uses headings, lists, tables, bold and code, as elements. */

import { element } from "./elements.js";

/** Text with **bold** and `code` as nodes. */
function inline(text) {
  return text.split(/(\*\*[^*]+\*\*|`[^`]+`)/).map((piece) => {
    if (piece.startsWith("**")) return element("strong", { text: piece.slice(2, -2) });
    if (piece.startsWith("`")) return element("code", { text: piece.slice(1, -1) });
    return document.createTextNode(piece);
  });
}

/** Blocks are parted by empty lines; headings go down by one level. */
export function card(markdown) {
  const blocks = markdown.trim().split(/\n\s*\n/);
  return element("section", { class: "card" }, ...blocks.map(block));
}

function block(text) {
  const heading = /^(#+) (.*)/.exec(text);
  if (heading) return element(`h${Math.min(6, heading[1].length + 1)}`, {}, ...inline(heading[2]));
  if (text.startsWith("|")) {
    const cells = (line) => line.replace(/^\||\|$/g, "").split("|").map((cell) => cell.trim());
    const [head, , ...rows] = text.split("\n").map(cells);
    const row = (tag) => (line) => element("tr", {}, ...line.map((cell) => element(tag, {}, ...inline(cell))));
    return element("table", {}, row("th")(head), ...rows.map(row("td")));
  }
  if (text.startsWith("- ")) {
    return element("ul", {}, ...text.slice(2).split(/\n- /).map((item) => element("li", {}, ...inline(item.replace(/\s+/g, " ")))));
  }
  return element("p", {}, ...inline(text.replace(/\s+/g, " ")));
}
