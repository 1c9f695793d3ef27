/** A number's slider and typed value; and the site's, which is also a length along the centreline. */

import { element, write } from "./elements.js";
import { parse, shown } from "./numbers.js";

/** A field for a number; what is being typed into it stays until it is complete. */
function typedField(id, note) {
  const field = element("input", { type: "text", id, inputmode: "decimal", autocomplete: "off", spellcheck: "false", "aria-describedby": note });
  field.addEventListener("input", () => (field.dataset.typing = "yes"));
  for (const end of ["change", "blur"]) field.addEventListener(end, () => delete field.dataset.typing);
  return field;
}

function display(field, text) {
  if (!field.dataset.typing && field.value !== text) field.value = text;
}

/** One number: a slider over its range, a field that takes any number a case file may hold. */
export class NumberControl {
  /** `onChange(value, committed)`; committed is false while a slider is dragged. */
  constructor(field, onChange) {
    this.field = field;
    const [low, high] = field.range;
    const id = `number-${field.name}`;
    const step = high - low <= 2 ? 0.001 : 0.01;
    const unit = field.unit ? ` (${field.unit})` : "";
    this.slider = element("input", { type: "range", min: low, max: high, step, "aria-label": `${field.label}${unit}, slider` });
    this.typed = typedField(id, `${id}-note`);
    this.note = element("p", { class: "note", id: `${id}-note`, role: "status" });
    const emit = (committed) => onChange(Number(this.slider.value), committed);
    this.slider.addEventListener("input", () => emit(false));
    this.slider.addEventListener("change", () => emit(true));
    this.typed.addEventListener("change", () => {
      const { value, complaint } = parse(this.typed.value, field);
      if (!complaint) return onChange(value, true);
      this.typed.value = shown(this.value);
      this.#complain(`${complaint} Kept ${shown(this.value)}${field.unit && ` ${field.unit}`}.`);
    });
    this.root = element("div", { class: "control" },
      element("label", { for: id, text: field.label }), this.slider, this.typed,
      element("span", { class: "unit", text: field.unit }), this.note);
  }

  show(value) {
    this.value = value;
    const [low, high] = this.field.range;
    if (Number(this.slider.value) !== value) this.slider.value = value;
    display(this.typed, shown(value));
    const outside = this.field.trained && (value < low - 1e-9 || value > high + 1e-9);
    this.root.classList.toggle("outside", outside);
    if (!this.complaint) write(this.note, outside ? `Trained from ${low} to ${high}${this.field.unit && ` ${this.field.unit}`}.` : "");
  }

  /** Complaints are of what was typed last. */
  forget() {
    if (this.complaint) this.#complain("");
  }

  #complain(text) {
    this.complaint = text;
    this.typed.setAttribute("aria-invalid", Boolean(text));
    write(this.note, text);
  }
}

/** The site: a slider as wide as the strip above it, η and the proximal end in mm, linked. */
export class SiteControl {
  /** `hasEta`: false for a vessel from a surface, whose sites are known by their mm alone. */
  constructor(field, hasEta, onChange) {
    this.spare = 1;
    this.eta = 0;
    this.slider = element("input", { type: "range", min: 0, max: 1, step: 0.001, "aria-label": "Site along the vessel, slider" });
    this.note = element("p", { class: "note", id: "site-note", role: "status" });
    this.typed = typedField("number-site_eta", "site-note");
    this.millimetres = typedField("number-site_mm", "site-note");
    this.ends = element("span", { id: "site-ends" });
    this.slider.addEventListener("input", () => onChange(Number(this.slider.value), false));
    this.slider.addEventListener("change", () => onChange(Number(this.slider.value), true));
    this.typed.addEventListener("change", () => {
      const { value, complaint } = parse(this.typed.value, field);
      if (complaint) this.#refuse(this.typed, `${complaint} Kept η ${shown(this.eta)}.`);
      else onChange(value, true);
    });
    this.millimetres.addEventListener("change", () => {
      const rule = `from 0 to ${this.spare.toFixed(2)} mm`;
      const { value, complaint } = parse(this.millimetres.value, { label: "Proximal end", low: 0, high: this.spare + 0.005, rule });
      if (complaint) this.#refuse(this.millimetres, `${complaint} Kept ${(this.eta * this.spare).toFixed(2)} mm.`);
      else onChange(Math.min(1, value / this.spare), true);
    });
    const eta = [element("label", { for: "number-site_eta", text: "Site η" }), this.typed];
    this.root = element("div", { class: "site-control" }, this.slider,
      element("div", { class: "site-values" }, ...(hasEta ? eta : []),
        element("label", { for: "number-site_mm", text: "Proximal end at" }), this.millimetres,
        element("span", { class: "unit", text: "mm" }), this.ends), this.note);
  }

  /** `geometry`: {length, crimpedLength, spareLength}, mm. */
  show(eta, { length, crimpedLength, spareLength }) {
    this.eta = eta;
    this.spare = spareLength;
    if (Number(this.slider.value) !== eta) this.slider.value = eta;
    this.#display();
    const start = eta * spareLength;
    this.slider.setAttribute("aria-valuetext", `η ${eta.toFixed(3)}, proximal end at ${start.toFixed(2)} mm`);
    write(this.ends, `crimped to ${(start + crimpedLength).toFixed(2)} mm of the centreline's ${length.toFixed(2)} mm`);
  }

  #display() {
    display(this.typed, shown(this.eta));
    display(this.millimetres, (this.eta * this.spare).toFixed(2));
  }

  forget() {
    write(this.note, "");
    for (const field of [this.typed, this.millimetres]) field.removeAttribute("aria-invalid");
  }

  #refuse(field, text) {
    this.forget();
    write(this.note, text);
    field.setAttribute("aria-invalid", true);
    this.#display();
  }
}
