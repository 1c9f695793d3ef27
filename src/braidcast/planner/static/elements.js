/** Building pieces of the page; texts are always set as text, never as HTML. */

/** An element with attributes (on… are listeners, `text` its text) and children. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "text") made.textContent = value;
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value != null) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

export const find = (id) => document.getElementById(id);

/** Sets a text only where it changes: a slider's move must not lay the page out for nothing. */
export function write(target, text) {
  if (target.textContent !== text) target.textContent = text;
}
