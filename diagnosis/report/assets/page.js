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
  const SHADES = 40, first = [one("#verdict .actions [data-f]")?.dataset.f, ...faults.keys()].find((id) => faults.has(id)); // of the first action
  let current = null, shared = null, loopKey = view.loop[0]?.key;

  // Time shown in the evidence: marked on the timeline, kept in the address, followed by the explorer where linked.
  const evidence = one("#figure") && new Figure(one("#figure"), one("#badge"), (range) => {
    shared = range;
    for (const w of all(".win")) {
      w.style.left = `${100 * range[0] / view.duration}%`;
      w.style.width = `${100 * (range[1] - range[0]) / view.duration}%`;
    }
    follow(explorer?.active && explorer.figure, range);
    follow(loop?.drawn && loop, range, "#loop-linked");
    // The clock stands within what is shown: what is zoomed or chosen takes it along, as it takes the plots along where it is led.
    if (Now.held && !Now.playing && (Now.t < range[0] || Now.t > range[1])) Now.set(Math.min(range[1], Math.max(range[0], Now.t)), { held: true });
    remember();
  });
  // What has just been drawn (`drawn`) follows the shared time, which may have moved meanwhile; what is zoomed leads.
  const loop = one("#loop-figure") && new Figure(one("#loop-figure"), one("#loop-badge"), (range, drawn) => {
    if (!one("#loop-linked").checked) return;
    if (drawn && shared) { follow(loop, shared, "#loop-linked"); return; }
    if (!current || !evidence?.drawn) shared = range;
    follow(evidence?.rows.length && !one("#figure").hidden && evidence, range, "#loop-linked");
    remember();
  });
  const explorer = one("#signals") && new Explorer(showSignals, (range, drawn) => {
    if (drawn && shared && one("#linked").checked) { follow(explorer.figure, shared); return; }
    if (!current || !evidence?.drawn) shared = range;
    follow(evidence?.rows.length && !one("#figure").hidden && evidence, range);
    if (!current) follow(loop?.drawn && loop, range, "#loop-linked");
    explorer?.across();
    remember();
  });
  const figures = { evidence, loop, signals: explorer?.figure };

  // Lanes without a fault, opened: drawn when asked for.
  one("#timeline")?.addEventListener("toggle", (e) => {
    const key = e.target.dataset.part;
    if (!key || !e.target.open || figures[key] || !view.n) return;
    const element = e.target.querySelector(".lane-figure"), figure = figures[key] = new Figure(element);
    Data.later().then(() => Lanes.draw(figure, key, e.target.querySelector(".near"))).then(() => Sight.near(element)).catch((wrong) => { element.textContent = `The plots cannot be drawn: ${wrong.message}`; throw wrong; });
  }, true);

  // How the rows of a fault's figure are looked at: as they are, one row for every part, residuals as multiples of thresholds.
  const looks = { peers: "", ratio: false };
  function looked(f) {
    const rows = view.figures[f.rows], own = rows.find((r) => r.key === looks.peers), list = own ? Looks.peers(own, f.component) : rows;
    return looks.ratio ? list.map(Looks.ratio) : list;
  }

  function choices(f) {
    const many = view.figures[f.rows].filter((r) => r.key !== "peers" && Looks.peers(r, f.component).length > 1);
    if (!many.some((r) => r.key === looks.peers)) looks.peers = "";
    one("#peers").replaceChildren(new Option("every panel of this part", ""), ...many.map((r) => new Option(`${r.title.replace(` ${f.component}`, "")}, all parts`, r.key)));
    one("#peers").value = looks.peers;
  }

  function drawEvidence() {
    const f = faults.get(current), kind = looked(f);
    const shades = shadesOf(view.faults.filter((g) => (looks.peers ? kind.some((r) => r.component === g.component) : g.component === f.component)), f.start).map((g) => ({ ...g, main: g.id === f.id }));
    return evidence.draw(kind, shades, shared).catch(failed("#figure"));
  }

  function look(change, button) {
    Object.assign(looks, change);
    button?.setAttribute("aria-pressed", String(looks.ratio));
    if (current && !one("#figure").hidden) drawEvidence();
  }

  function robust() {
    Figure.robust = !Figure.robust;
    for (const f of Object.values(figures)) f?.redraw(); // what is zoomed stays so
    for (const b of all("[data-act=robust]")) b.setAttribute("aria-pressed", String(Figure.robust));
  }

  // The cursor by keys: some samples, or as many pixels as ten keys take.
  function cursor(by) {
    const figure = active();
    if (!figure?.drawn) return;
    const [a, b] = figure.range, step = Math.max(view.dt, (b - a) / figure.pixels());
    Now.set(Now.t === null || Now.t < a || Now.t > b ? (a + b) / 2 : Now.t + by * step, { held: true });
    figure.read().show().then(() => { one("#live").textContent = figure.read().values ? figure.read().spoken() : ""; });
  }

  // Sliders below the plots: made when they are first opened.
  let panel = null;
  const whatIf = () => Data.later().then(() => { panel ??= new WhatIfPanel(one); figures.whatif = panel.figure; return panel.open(faults.get(current)); }).catch(failed("#whatif-words"));
  one("#whatif")?.addEventListener("toggle", (e) => e.target.open && current && (panel?.f?.id === current ? Promise.resolve() : whatIf()).then(() => Sight.near("#whatif")));

  const mark = (name) => Now.t !== null && Now.set(Now.t, { [name]: Now.t });

  const stage = new Stage(one, figures, (where) => failed(where));

  function follow(figure, range, where = "#linked") {
    if (figure && one(where).checked && figure.range.some((v, i) => Math.abs(v - range[i]) > 1e-9)) figure.zoom(range);
  }

  // The address restores what is shown: fault, time, chosen signals. A new fault is a step of the browser's history.
  function remember(step) {
    const address = Address.text(current, shared, explorer?.plots ?? [], explorer?.view);
    if (address === "#" || address === location.hash) return;
    try { history[step ? "pushState" : "replaceState"](null, "", address); } catch { /* browsers limit how often; the next change tells */ }
  }

  const failed = (where) => (e) => { one(where).replaceChildren(`The plots cannot be drawn: ${e.message}`); throw e; };

  // The faults to shade: of many those nearest to a time.
  function shadesOf(list, at) {
    if (list.length <= SHADES) return list;
    return at === undefined ? list.slice(0, SHADES) : [...list].sort((f, g) => Math.abs(f.start - at) - Math.abs(g.start - at)).slice(0, SHADES);
  }

  const articleOf = (id) => one(`article[data-ev="${CSS.escape(id)}"]`);

  function select(id, { range, scroll, step: stepped } = {}) {
    const f = faults.get(id);
    if (!f) return;
    Address.tell("");
    const before = current;
    current = id;
    if (before !== id) evidence?.release();
    if (!articleOf(id)) Sight.brief(f);
    for (const e of all("[data-ev]")) e.hidden = e.dataset.ev !== id;
    for (const e of all("[aria-current]")) e.removeAttribute("aria-current");
    for (const e of all(`[data-f="${CSS.escape(id)}"]`)) if (e.matches(".fb, tr.fault")) e.setAttribute("aria-current", "true");
    Sight.keepInTable(one("tr.fault[aria-current]"));
    one("#live").textContent = `Showing ${id}: ${f.title}`;
    if (scroll) Sight.go("#evidence", scroll === "at once");
    shared = range || ranges.fault(f);
    remember(stepped && before && before !== id);
    if (!evidence) return;
    const rows = view.figures[f.rows];
    articleOf(id).querySelector(".slot").append(one("#looks"), one("#figure"), one("#whatif"));
    if (one("#whatif").open) whatIf();
    one("#looks").hidden = !rows.length;
    one("#figure").hidden = !rows.length;
    for (const b of all("[data-of=evidence], [data-zoom]")) b.disabled = !rows.length;
    if (!rows.length) return;
    Data.later().then(() => { if (current === id) { choices(f); return drawEvidence(); } });
  }

  // What the machine did as a whole: its time in all plots; the address keeps the time, and the event while nothing else is chosen.
  function showEvent(bar, scroll) {
    for (const e of all(".mev[aria-current]")) e.removeAttribute("aria-current");
    bar.setAttribute("aria-current", "true");
    const span = [Number(bar.dataset.from), Number(bar.dataset.to)], pad = Math.max(0.5, (span[1] - span[0]) * 0.25), range = [Math.max(0, span[0] - pad), Math.min(view.duration, span[1] + pad)];
    if (current) select(current, { range, scroll });
    else {
      shared = range;
      const figure = loop ?? explorer?.figure;
      if (figure?.drawn) figure.zoom(range);
      else if (loop) drawLoop(loopKey);
      if (scroll) Sight.go(loop ? "#loop" : "#timeline", scroll === "at once");
    }
    bar.setAttribute("aria-current", "true");
    try { history.replaceState(null, "", bar.getAttribute("href")); } catch { /* browsers limit how often */ }
    one("#live").textContent = bar.title;
  }

  const barOf = (id, t) => { const mine = all(`.mev[data-e="${CSS.escape(id)}"]`); return mine.find((b) => t && Number(b.dataset.from) === t[0] && Number(b.dataset.to) === t[1]) ?? mine[0]; };

  function step(by) {
    const ids = [...faults.keys()], at = ids.indexOf(current);
    select(ids[Math.min(ids.length - 1, Math.max(0, at + by))], { step: true });
  }

  // The plots that keys act on: those with the focus, else the evidence.
  function active() {
    const at = document.activeElement;
    if (explorer?.active && one("#signals").contains(at)) return explorer.figure;
    if (loop?.drawn && one("#loop").contains(at)) return loop;
    const lane = at?.closest(".more")?.dataset.part;
    if (figures[lane]?.drawn) return figures[lane];
    return evidence?.drawn && !one("#figure").hidden ? evidence : explorer?.active ? explorer.figure : loop?.drawn ? loop : null;
  }

  const zoom = (name) => current && evidence?.drawn && !one("#figure").hidden && evidence.zoom(ranges[name](faults.get(current)));

  function drawLoop(key) {
    const group = view.loop.find((g) => g.key === key);
    if (!loop || !group) return;
    if (loopKey !== key) loop.release();
    loopKey = key;
    for (const b of all("[data-loop]")) b.setAttribute("aria-pressed", String(b.dataset.loop === key));
    loop.draw(group.rows, shadesOf(view.faults).map((f) => ({ ...f, main: false })), one("#loop-linked").checked && shared ? shared : loop.drawn ? loop.range : [0, view.duration]).catch(failed("#loop-figure"));
  }

  function showSignals() {
    remember();
    const range = one("#linked").checked && shared ? shared : explorer.figure.drawn ? explorer.figure.range : shared || [0, view.duration];
    const shades = shadesOf(view.faults, range[0]).map((f) => ({ ...f, main: false }));
    return explorer.draw(shades, range)?.catch(failed("#signals-figure"));
  }

  function setTheme(theme) {
    root.dataset.theme = theme;
    root.dataset.chosen = "1";
    try { localStorage.setItem("mfhca-theme", theme); } catch { /* storage may be off for files */ }
    root.dispatchEvent(new Event("theme"));
  }

  const redraw = () => Promise.all(Object.entries(figures).map(([name, f]) => (name !== "signals" || explorer?.active) && f?.redraw()).concat(explorer?.across()));
  const fileName = (of) => ({ evidence: current, loop: `loop-${loopKey}`, signals: "signals" })[of];

  const actions = {
    zoom: (b) => zoom(b.dataset.zoom),
    csv: ({ dataset: { of } }) => figures[of].rows.length && figures[of].csv().then((text) => Export.save(`${fileName(of)}.csv`, "text/csv", text)),
    image: ({ dataset: { of, form } }) => figures[of].drawn && Export.image(figures[of], fileName(of), form),
    ratio: (b) => look({ ratio: !looks.ratio }, b),
    robust, play: () => stage.play(),
    taller: () => active()?.stretch(2),
    json: () => Export.json(current),
    table: () => Export.table(),
    copy: (b) => Export.copy(articleOf(current), b),
    add: (b) => explorer.add(b.dataset.how),
    "signals-clear": () => { explorer.set([]); one("#find").focus(); },
    "loop-all": () => { one("#loop-linked").checked = false; loop.zoom([0, view.duration]); },
    theme: () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"),
    print: () => window.print(),
    "print-all": () => { root.dataset.print = "all"; window.print(); },
    help: () => one("#help").showModal(),
    close: () => one("#help").close(),
  };

  document.addEventListener("click", (e) => {
    const target = e.target.closest("[data-f], [data-act], [data-loop], [data-e]");
    if (!target) return;
    if (target.dataset.e) { e.preventDefault(); showEvent(target, true); return; }
    if (target.dataset.act) actions[target.dataset.act](target);
    else if (target.dataset.loop) drawLoop(target.dataset.loop);
    else { e.preventDefault(); select(target.dataset.f, { scroll: true, step: true }); }
  });

  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || document.querySelector("dialog[open]") || e.target.matches("input:not([type=checkbox], [type=range]), select, textarea") || (e.target.matches("[type=range]") && /^(Arrow|Home|End|Page)/.test(e.key))) return;
    if ((e.key === "Enter" || e.key === " ") && e.target.matches("g[data-f]")) { e.preventDefault(); select(e.target.dataset.f, { scroll: true, step: true }); return; }
    if (e.key.startsWith("Arrow") && e.target.closest(".scroll")) return;
    const key = {
      j: () => step(1), k: () => step(-1), f: () => zoom("fault"), o: () => zoom("onset"), e: () => zoom("end"),
      m: () => active()?.zoom(ranges.mission()), ArrowLeft: () => active()?.pan(-0.25), ArrowRight: () => active()?.pan(0.25),
      "+": () => active()?.scale(0.5), "=": () => active()?.scale(0.5), "-": () => active()?.scale(2),
      ",": () => cursor(-1), ".": () => cursor(1), "<": () => cursor(-10), ">": () => cursor(10), a: () => mark("a"), b: () => mark("b"),
      Escape: () => Now.set(null, { a: null, b: null, held: false }), y: robust, z: () => active()?.stretch(2), Z: () => active()?.stretch(0.5),
      p: actions.play, w: () => { const e = one("#whatif"); if (e) { e.open = true; Sight.go("#whatif"); one("#whatif-mode").focus({ preventScroll: true }); } },
      g: () => { Sight.go("#evidence"); one("#figure")?.focus({ preventScroll: true }); },
      s: () => one("#find")?.focus(), t: actions.theme, "?": actions.help,
    }[e.key];
    if (key) { e.preventDefault(); key(); }
  });

  function fromAddress(hash, scroll) {
    const { event, has, t, range, plots, view: shown, id } = Address.read(hash), wanted = plots ?? [], bar = event && barOf(event, range);
    if (bar) { if (!current && faults.size) select(first); showEvent(bar, scroll); } else if (faults.has(id)) select(id, { range, scroll });
    else if (!current && faults.size) select(first, { range });
    else if (!faults.size && range) shared = range;
    if (explorer && plots) one("#signals-view").value = ["xy", "spectrum"].find((v) => v === shown) ?? "time";
    if (explorer && (plots || faults.has(id)) && JSON.stringify(wanted) !== JSON.stringify(explorer.plots)) explorer.set(wanted);
    const lacking = explorer ? [...new Set(wanted.flat())].filter((n) => !explorer.meaning(n)) : [];
    Address.tell([
      event && !bar ? `There is no event ${Address.cut(event)} of the machine in this report.` : "",
      has && !faults.has(id) ? `There is no fault ${Address.cut(id || has)} in this report${current ? `: ${current} is shown` : ""}.` : "",
      t && !range ? `“${Address.cut(t)}” is not a time: expected t=seconds or t=from,to.` : "",
      lacking.length ? `There is no signal ${lacking.slice(0, 3).map(Address.cut).join(", ")}${lacking.length > 3 ? ` and ${lacking.length - 3} more` : ""} in this report.` : "",
    ].filter(Boolean).join(" "));
  }

  // Paper: light colours and the width of a page, then back.
  let before = null;
  addEventListener("beforeprint", () => {
    before = root.dataset.theme;
    root.dataset.theme = "light";
    if (root.dataset.print) for (const f of [evidence, loop, explorer?.active && explorer.figure]) f && f.print(680);
  });
  addEventListener("afterprint", () => {
    root.dataset.theme = before;
    delete root.dataset.print;
    redraw();
  });

  root.addEventListener("theme", () => { one("#theme").setAttribute("aria-pressed", String(root.dataset.theme === "dark")); redraw(); });
  one("#peers")?.addEventListener("change", (e) => look({ peers: e.target.value }));
  one("#loop-linked")?.addEventListener("change", () => loop.drawn && drawLoop(loopKey));
  one("#linked")?.addEventListener("change", () => explorer.active && showSignals());
  addEventListener("hashchange", (e) => fromAddress(new URL(e.newURL).hash, true));
  let resizing = 0;
  addEventListener("resize", () => { clearTimeout(resizing); resizing = setTimeout(redraw, 200); });
  one("#theme").setAttribute("aria-pressed", String(root.dataset.theme === "dark"));
  const asked = location.hash;
  fromAddress(asked, "at once");
  // A link to signals alone shows them, also once what stands above them has grown, unless the reader has moved on.
  if (explorer && /[#&]plots=/.test(asked) && !/[#&]fault=/.test(asked)) {
    let moved = false;
    for (const e of ["wheel", "pointerdown", "keydown"]) addEventListener(e, () => { moved = true; }, { once: true, passive: true });
    const grown = new ResizeObserver(() => { if (!moved) Sight.go("#signals", true); });
    for (const e of ["#figure", "#loop-figure", "#signals-figure"]) if (one(e)) grown.observe(one(e));
    setTimeout(() => grown.disconnect(), 5000);
  }
  if (loop) {
    // Drawn when it comes near, or a little later so that it is there to be printed.
    const begin = () => { seen.disconnect(); clearTimeout(later); drawLoop(loopKey); };
    const seen = new IntersectionObserver((entries) => entries.some((e) => e.isIntersecting) && begin(), { rootMargin: "300px" });
    const later = setTimeout(begin, 4000);
    seen.observe(one("#loop-figure"));
  }
  root.dataset.ready = "1";
})();
