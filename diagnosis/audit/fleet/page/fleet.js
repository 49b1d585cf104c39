"use strict";
// Sorts the machines and searches the missions; the page can be read without it.
(() => {
  const root = document.documentElement, one = (s) => document.querySelector(s), all = (s, e = document) => [...e.querySelectorAll(s)];

  const theme = one("#theme");
  const pressed = () => theme.setAttribute("aria-pressed", String(root.dataset.theme === "dark"));
  theme.addEventListener("click", () => {
    root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
    root.dataset.chosen = "";
    try { localStorage.setItem("mfhca-theme", root.dataset.theme); } catch { /* storage may be off for files */ }
    pressed();
  });
  root.addEventListener("theme", pressed);
  pressed();

  // Headings that sort: largest first, the machines themselves worst first.
  const body = one(".fleet tbody"), heads = all(".fleet th[data-sort]");
  for (const head of heads) {
    const key = head.dataset.sort, button = document.createElement("button");
    button.className = "sort";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === (key === "rank" ? "ascending" : "descending");
      const sign = (key === "rank") === down ? -1 : 1;
      heads.forEach((h) => h.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
      const rows = all("tr[data-rank]", body), value = (r) => Number(r.dataset[key]);
      body.append(...rows.sort((a, b) => sign * (value(a) - value(b)) || a.dataset.rank - b.dataset.rank));
    });
  }

  // Search: every word has to stand in the row or in its machine's name.
  const find = one("#find"), which = one("#which"), hits = one("#hits");
  const groups = all("details.group").map((box) => ({
    box, open: box.open, name: box.querySelector("summary b").textContent.toLowerCase(), rows: all("tbody tr", box), texts: null,
  }));
  const total = groups.reduce((n, g) => n + g.rows.length, 0);
  function search() {
    const words = find.value.toLowerCase().split(/\s+/).filter(Boolean), kind = which.value, asked = words.length > 0 || kind !== "";
    let found = 0;
    for (const g of groups) {
      g.texts ??= g.rows.map((r) => `${g.name} ${r.textContent.toLowerCase()}`);
      let mine = 0;
      g.rows.forEach((row, k) => {
        const fits = (!kind || row.classList.contains(kind)) && words.every((w) => g.texts[k].includes(w));
        row.hidden = !fits;
        mine += fits;
      });
      g.box.hidden = asked && mine === 0;
      g.box.open = asked ? mine > 0 : g.open;
      found += mine;
    }
    hits.textContent = asked ? `${found} of ${total}` : "";
  }
  find.addEventListener("input", search);
  which.addEventListener("change", search);

  // A link to a machine opens its missions.
  const unfold = () => {
    const box = location.hash.length > 1 && document.getElementById(location.hash.slice(1));
    if (box instanceof HTMLDetailsElement) { box.hidden = false; box.open = true; box.scrollIntoView(); }
  };
  addEventListener("hashchange", unfold);
  unfold();
  if (find.value || which.value) search(); // kept by the browser over a reload
  root.dataset.ready = "";
})();
