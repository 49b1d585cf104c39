"use strict";
// Light or dark before the first paint: the user's last choice, else the system's.
(() => {
  let theme = null;
  try { theme = localStorage.getItem("mfhca-theme"); } catch { /* storage may be off for files */ }
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const root = document.documentElement;
  root.classList.add("js");
  root.dataset.theme = theme || (dark.matches ? "dark" : "light");
  dark.addEventListener("change", (e) => {
    if (theme || root.dataset.chosen) return;
    root.dataset.theme = e.matches ? "dark" : "light";
    root.dispatchEvent(new Event("theme"));
  });
})();
