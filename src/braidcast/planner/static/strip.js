/** The probability of success over η: where it is safe is seen at once, a click goes there. */

const COUNT = 101;
export const ETAS = Array.from({ length: COUNT }, (_, i) => i / (COUNT - 1));

/** First and last place of every run of probabilities at or above the threshold. */
function safeWindows(probabilities, threshold) {
  const windows = [];
  probabilities.forEach((probability, i) => {
    if (probability < threshold) return;
    if (windows.at(-1)?.[1] === i - 1) windows.at(-1)[1] = i;
    else windows.push([i, i]);
  });
  return windows;
}

/** η in the middle of the widest safe window; without one, of the highest probability. */
export function bestSite(probabilities, threshold) {
  const windows = safeWindows(probabilities, threshold);
  const [widest] = windows.sort(([a, b], [c, d]) => d - c - (b - a));
  const place = widest ? (widest[0] + widest[1]) / 2 : probabilities.indexOf(Math.max(...probabilities));
  return { eta: place / (probabilities.length - 1), safe: Boolean(widest) };
}

/** The strip as SVG text in a box of 1000 × 100, η to the right, probability up. */
export function stripPicture(probabilities, threshold, eta) {
  const x = (place) => ((1000 * place) / (probabilities.length - 1)).toFixed(1);
  const y = (probability) => (98 - 96 * probability).toFixed(1);
  const points = probabilities.map((probability, i) => `${x(i)},${y(probability)}`).join(" ");
  const safe = safeWindows(probabilities, threshold).map(([from, to]) => `<rect class="safe" x="${x(from)}" y="0" width="${x(to - from)}" height="100"/>`).join("");
  return `<svg viewBox="0 0 1000 100" preserveAspectRatio="none" aria-hidden="true">${safe}<polyline class="curve" points="${points}"/>
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
    label.style.top = `${98 - 96 * this.threshold}%`;
    return label;
  }
}
