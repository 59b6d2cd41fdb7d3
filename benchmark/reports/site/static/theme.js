// Light or dark: the system's choice until the reader makes one. Runs before the page is painted.
(() => {
  "use strict";
  const root = document.documentElement;
  const system = matchMedia("(prefers-color-scheme: dark)");
  const chosen = () => {
    try {
      return localStorage.getItem("rightofway-theme");
    } catch {
      return null; // a browser that keeps nothing for files
    }
  };
  const isDark = () => (root.dataset.theme || (system.matches ? "dark" : "light")) === "dark";

  const saved = chosen();
  if (saved === "dark" || saved === "light") root.dataset.theme = saved;

  document.addEventListener("DOMContentLoaded", () => {
    const button = document.querySelector("button.theme");
    const tell = () => {
      button.setAttribute("aria-pressed", String(isDark()));
      document.dispatchEvent(new CustomEvent("theme"));
    };
    button.hidden = false;
    button.addEventListener("click", () => {
      root.dataset.theme = isDark() ? "light" : "dark";
      try {
        localStorage.setItem("rightofway-theme", root.dataset.theme);
      } catch {
        // the choice lasts for this page
      }
      tell();
    });
    system.addEventListener("change", tell);
    tell();
  });
})();
