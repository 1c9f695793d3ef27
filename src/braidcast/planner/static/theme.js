/** Light or dark: the system's choice until the button says otherwise. */

const system = matchMedia("(prefers-color-scheme: dark)");

/** `onChange(dark)` now and at every change. */
export function theme(button, onChange) {
  let chosen = null;
  try {
    chosen = localStorage.getItem("theme");
  } catch {} // where a page may keep nothing, the choice lasts as long as the page
  const dark = () => (chosen ? chosen === "dark" : system.matches);
  const apply = () => {
    document.documentElement.dataset.theme = dark() ? "dark" : "light";
    button.textContent = dark() ? "Light" : "Dark";
    button.setAttribute("aria-label", `Change to ${dark() ? "light" : "dark"} colours`);
    onChange(dark());
  };
  button.addEventListener("click", () => {
    chosen = dark() ? "light" : "dark";
    try {
      localStorage.setItem("theme", chosen);
    } catch {}
    apply();
  });
  system.addEventListener("change", apply);
  apply();
}
