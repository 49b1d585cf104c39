"use strict";
// What the page's buttons, links and keys do.
(() => {
  const view = Data.view, faults = new Map(view.faults.map((f) => [f.id, f]));
  const one = (s) => document.querySelector(s), all = (s) => [...document.querySelectorAll(s)], root = document.documentElement;
  const padding = (f) => Math.max(0.5, (f.stop - f.start) * 0.5);
  const ranges = {
    fault: (f) => [f.start - padding(f), f.stop + padding(f)],
    onset: (f) => [f.start - 0.5, f.start + 0.5],
    end: (f) => [f.stop - 0.5, f.stop + 0.5],
    mission: () => [0, view.duration],
  };
  let current = null, loopKey = view.loop[0]?.key;
  const evidence = one("#figure") && new Figure(one("#figure"), one("#badge"), (range) => {
    for (const w of all(".win")) {
      w.style.left = `${100 * range[0] / view.duration}%`;
      w.style.width = `${100 * (range[1] - range[0]) / view.duration}%`;
    }
    if (current) history.replaceState(null, "", `#fault=${encodeURIComponent(current)}&t=${range.map((v) => v.toFixed(4)).join(",")}`);
  });
  const loop = one("#loop-figure") && new Figure(one("#loop-figure"), one("#loop-badge"));

  const failed = (where) => (e) => { one(where).replaceChildren(`The plots cannot be drawn: ${e.message}`); throw e; };

  function select(id, { range, scroll } = {}) {
    const f = faults.get(id);
    if (!f) return;
    current = id;
    for (const e of all("[data-ev]")) e.hidden = e.dataset.ev !== id;
    for (const e of all(".fb, tr.fault")) e.dataset.f === id ? e.setAttribute("aria-current", "true") : e.removeAttribute("aria-current");
    keepInTable(one("tr.fault[aria-current]"));
    one("#live").textContent = `Showing ${id}: ${f.title}`;
    if (scroll) one("#evidence").scrollIntoView({ behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
    if (!evidence) return;
    one(`article[data-ev="${CSS.escape(id)}"] .slot`).append(one("#figure"));
    one("#figure").hidden = !f.rows.length;
    if (!f.rows.length) return;
    const shades = view.faults.filter((g) => g.component === f.component).map((g) => ({ ...g, main: g.id === id }));
    evidence.draw(f.rows, shades, range || ranges.fault(f)).catch(failed("#figure"));
  }

  function keepInTable(row) {
    const box = row.closest(".scroll");
    if (row.offsetTop < box.scrollTop || row.offsetTop + row.offsetHeight > box.scrollTop + box.clientHeight) box.scrollTop = row.offsetTop - 60;
  }

  function step(by) {
    const ids = [...faults.keys()], at = ids.indexOf(current);
    select(ids[Math.min(ids.length - 1, Math.max(0, at + by))]);
  }

  const zoom = (name) => current && evidence?.drawn && evidence.zoom(ranges[name](faults.get(current)));

  function drawLoop(key) {
    const group = view.loop.find((g) => g.key === key);
    if (!loop || !group) return;
    loopKey = key;
    for (const b of all("[data-loop]")) b.setAttribute("aria-pressed", String(b.dataset.loop === key));
    loop.draw(group.rows, view.faults.map((f) => ({ ...f, main: false })), loop.drawn ? loop.range : [0, view.duration]).catch(failed("#loop-figure"));
  }

  // Unit and factor of a channel, from the first row that shows it.
  function unitOf(c) {
    for (const row of [...view.faults, ...view.loop].flatMap((g) => g.rows)) {
      const t = row.traces.find((u) => u.c === c);
      if (t) return { unit: t.right ? row.rightUnit.unit : row.unit, k: t.k };
      if (row.threshold === c || row.band?.includes(c)) return { unit: row.unit, k: row.bandScale };
    }
    return { unit: "1", k: 1 };
  }

  function addSignal(c) {
    const { unit, k } = unitOf(c), { name } = view.channels[c], row = { key: name, title: name, unit, traces: [{ c, name, role: "measured", k }] };
    loop.draw([...loop.rows, row], loop.shades, loop.range).catch(failed("#loop-figure"));
  }

  function save(name, type, text) {
    const url = URL.createObjectURL(new Blob([text], { type })), a = document.createElement("a");
    a.href = url;
    a.download = name;
    a.click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  }

  async function copy(button) {
    const article = one(`article[data-ev="${CSS.escape(current)}"]`);
    const text = `${view.name}\n${article.dataset.text}\n` + [...article.querySelectorAll("li, .advice")].map((e) => `- ${e.textContent.trim()}`).join("\n") + "\n";
    try { await navigator.clipboard.writeText(text); } catch {
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    button.dataset.copied = text;
    const words = button.textContent;
    button.textContent = "Copied";
    setTimeout(() => { button.textContent = words; }, 1500);
  }

  function setTheme(theme) {
    root.dataset.theme = theme;
    root.dataset.chosen = "1";
    try { localStorage.setItem("mfhca-theme", theme); } catch { /* storage may be off for files */ }
    root.dispatchEvent(new Event("theme"));
  }

  function themed() {
    one("#theme").setAttribute("aria-pressed", String(root.dataset.theme === "dark"));
    return Promise.all([evidence?.redraw(), loop?.redraw()]);
  }

  const actions = {
    zoom: (b) => zoom(b.dataset.zoom),
    csv: () => evidence.csv().then((text) => save(`${current}.csv`.replace(/[^\w.-]/g, "_"), "text/csv", text)),
    "loop-csv": () => loop.csv().then((text) => save(`loop-${loopKey}.csv`, "text/csv", text)),
    "loop-all": () => loop.zoom([0, view.duration]),
    copy,
    theme: () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"),
    print: () => window.print(),
    help: () => one("#help").showModal(),
    close: () => one("#help").close(),
  };

  document.addEventListener("click", (e) => {
    const target = e.target.closest("[data-f], [data-act], [data-loop]");
    if (!target) return;
    if (target.dataset.act) actions[target.dataset.act](target);
    else if (target.dataset.loop) drawLoop(target.dataset.loop);
    else { e.preventDefault(); select(target.dataset.f, { scroll: "scroll" in target.dataset }); }
  });

  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || e.target.matches("input, select, textarea") || one("#help").open) return;
    if ((e.key === "Enter" || e.key === " ") && e.target.matches("g[data-f]")) { e.preventDefault(); select(e.target.dataset.f, { scroll: true }); return; }
    const key = {
      j: () => step(1), k: () => step(-1), f: () => zoom("fault"), o: () => zoom("onset"), e: () => zoom("end"), m: () => zoom("mission"),
      t: actions.theme, "?": actions.help,
    }[e.key];
    if (key) { e.preventDefault(); key(); }
  });

  function fromAddress(hash, scroll) {
    const q = new URLSearchParams(hash.slice(1)), t = (q.get("t") || "").split(",").map(Number);
    const range = t.length === 2 && t.every(Number.isFinite) && t[1] > t[0] ? t : undefined;
    if (faults.has(q.get("fault"))) select(q.get("fault"), { range, scroll });
    else if (!current && faults.size) select(faults.keys().next().value);
  }

  // Paper: light colours and the width of a page, then back.
  let before = null;
  addEventListener("beforeprint", () => {
    before = root.dataset.theme;
    root.dataset.theme = "light";
    evidence?.print(680);
    loop?.print(680);
  });
  addEventListener("afterprint", () => {
    root.dataset.theme = before;
    evidence?.redraw();
    loop?.redraw();
  });

  one("#explore")?.addEventListener("change", (e) => {
    if (e.target.value !== "" && loop.drawn) addSignal(+e.target.value);
    e.target.value = "";
  });
  root.addEventListener("theme", themed);
  addEventListener("hashchange", (e) => fromAddress(new URL(e.newURL).hash, true));
  let resizing = 0;
  addEventListener("resize", () => { clearTimeout(resizing); resizing = setTimeout(() => { evidence?.redraw(); loop?.redraw(); }, 200); });
  one("#theme").setAttribute("aria-pressed", String(root.dataset.theme === "dark"));
  fromAddress(location.hash, false);
  if (loop) {
    // Drawn when it comes near, or a little later so that it is there to be printed.
    const begin = () => { seen.disconnect(); clearTimeout(later); drawLoop(loopKey); };
    const seen = new IntersectionObserver((entries) => entries.some((e) => e.isIntersecting) && begin(), { rootMargin: "300px" });
    const later = setTimeout(begin, 4000);
    seen.observe(one("#loop-figure"));
  }
  root.dataset.ready = "1";
})();
