/** The probability of success over η: where it is safe is seen at once, a click goes there. */

const COUNT = 101;
export const ETAS = Array.from({ length: COUNT }, (_, i) => i / (COUNT - 1));

/** η in the middle of the widest window at or above the threshold; without one, of the highest. */
export function bestSite(probabilities, threshold) {
  let [widest, width, from] = [null, 0, 0];
  for (let i = 0; i <= probabilities.length; i++) {
    if (probabilities[i] >= threshold) continue;
    if (i - from > width) [widest, width] = [(from + i - 1) / 2, i - from];
    from = i + 1;
  }
  const highest = probabilities.indexOf(Math.max(...probabilities));
  return { eta: (widest ?? highest) / (probabilities.length - 1), safe: widest !== null };
}

/** The strip as SVG text in a box of 1000 × 100, η to the right, probability up. */
export function stripPicture(probabilities, threshold, eta) {
  const y = (probability) => (100 - 96 * probability - 2).toFixed(2);
  const points = probabilities.map((p, i) => `${(1000 * i) / (probabilities.length - 1)},${y(p)}`).join(" ");
  const windows = probabilities
    .map((p, i) => (p >= threshold ? `<rect class="safe" x="${(1000 * (i - 0.5)) / (probabilities.length - 1)}" y="0" width="${1000 / (probabilities.length - 1) + 0.5}" height="100"/>` : ""))
    .join("");
  return `<svg viewBox="0 0 1000 100" preserveAspectRatio="none" aria-hidden="true">${windows}
    <polygon class="area" points="0,100 ${points} 1000,100"/><polyline class="curve" points="${points}"/>
    <line class="threshold" x1="0" x2="1000" y1="${y(threshold)}" y2="${y(threshold)}"/>
    <line class="now" x1="${1000 * eta}" x2="${1000 * eta}" y1="0" y2="100"/></svg>`;
}

export class Strip {
  probabilities = null;

  /** `onChange(eta, committed)` */
  constructor(root, threshold, onChange) {
    this.root = root;
    this.threshold = threshold;
    this.eta = 0;
    const at = (event) => {
      const box = this.#plot().getBoundingClientRect();
      return Math.round(1000 * Math.max(0, Math.min(1, (event.clientX - box.left) / box.width))) / 1000;
    };
    root.addEventListener("pointerdown", (event) => {
      root.setPointerCapture(event.pointerId);
      onChange(at(event), false);
    });
    root.addEventListener("pointermove", (event) => {
      if (root.hasPointerCapture(event.pointerId)) onChange(at(event), false);
    });
    root.addEventListener("pointerup", (event) => onChange(at(event), true));
    const steps = { ArrowRight: 0.01, ArrowUp: 0.01, ArrowLeft: -0.01, ArrowDown: -0.01, PageUp: 0.1, PageDown: -0.1, Home: -1, End: 1 };
    root.addEventListener("keydown", (event) => {
      if (!(event.key in steps)) return;
      event.preventDefault();
      onChange(Math.round(1000 * Math.max(0, Math.min(1, this.eta + steps[event.key]))) / 1000, true);
    });
  }

  /** New probabilities (101) for the same vessel, or null while they are computed. */
  fill(probabilities) {
    this.probabilities = probabilities;
    this.root.classList.toggle("stale", !probabilities);
    if (!probabilities) return;
    this.root.innerHTML = stripPicture(probabilities, this.threshold, this.eta);
    this.root.append(this.#label(`${(100 * this.threshold).toFixed(0)} %`));
  }

  /** Moves the mark of the present site; `probability` is that of the site. */
  mark(eta, probability) {
    this.eta = eta;
    const line = this.root.querySelector(".now");
    line?.setAttribute("x1", 1000 * eta);
    line?.setAttribute("x2", 1000 * eta);
    this.root.setAttribute("aria-valuenow", eta);
    this.root.setAttribute("aria-valuetext", `η ${eta.toFixed(3)}, probability of success ${(100 * probability).toFixed(1)} %`);
  }

  #plot() {
    return this.root.querySelector("svg") ?? this.root;
  }

  #label(text) {
    const label = document.createElement("span");
    label.className = "threshold-label";
    label.textContent = text;
    label.style.top = `${100 - 96 * this.threshold - 2}%`;
    return label;
  }
}
