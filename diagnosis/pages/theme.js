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
// Beside times in UTC the reader's own, where that is another.
document.addEventListener("DOMContentLoaded", () => {
  const two = (n) => String(n).padStart(2, "0");
  for (const e of document.querySelectorAll("time")) {
    const at = new Date(`${e.textContent.replace(" ", "T")}Z`);
    const offset = -at.getTimezoneOffset();
    if (!offset || Number.isNaN(offset)) continue;
    const size = Math.abs(offset);
    const zone = `UTC${offset < 0 ? "−" : "+"}${Math.floor(size / 60)}${size % 60 ? `:${two(size % 60)}` : ""}`;
    const seconds = e.textContent.length > 16 ? `:${two(at.getSeconds())}` : "";
    const here = `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())} ${two(at.getHours())}:${two(at.getMinutes())}${seconds}`;
    e.title = `${here} local time (${zone})`;
    if (e.className !== "both") continue;
    const own = document.createElement("span");
    own.className = "local small muted";
    own.textContent = ` ${here} local (${zone})`;
    e.after(own);
  }
});
