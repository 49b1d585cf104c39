"use strict";
// One figure: rows of panels over one time axis. Zooming thins the samples anew and restyles once.
class Figure {
  constructor(element, badge, onRange) {
    Object.assign(this, { element, badge, onRange, rows: [], shades: [], range: [0, 1], drawn: false, busy: false, again: false, job: 0, robust: false, tall: 1 });
    element.addEventListener("pointermove", (e) => { if (this.drawn && !e.buttons && this.read().inside(e)) Now.set(this.read().time(e)); });
    element.addEventListener("pointerleave", () => Now.leave());
    // A click sets a marker; a drag is a zoom.
    element.addEventListener("pointerdown", (e) => {
      if (!this.drawn || e.button || !this.read().inside(e)) return;
      this.shifted = e.shiftKey; // a click and a shift-click soon after it are two markers, not a double click
      addEventListener("pointerup", (up) => {
        if (Math.hypot(up.clientX - e.clientX, up.clientY - e.clientY) > 4 || e.target.closest(".modebar")) return;
        Now.set(this.read().time(e), { [e.shiftKey ? "b" : "a"]: this.read().time(e) });
      }, { once: true, capture: true });
    }, true);
    element.addEventListener("wheel", (e) => { if (e.shiftKey && this.drawn) { e.preventDefault(); this.stretch(e.deltaY + e.deltaX < 0 ? 2 : 0.5); } }, { passive: false });
  }

  read() { return (this.reading ??= new Reading(this)); }

  // Smallest and largest value of a curve at a time, in the row's unit.
  static async at(t, time) {
    if (!t.op) return (await Data.at(t.c, time)).map((v) => v * t.k);
    const d = await Figure.computed(t, time, time), v = d.y[Math.round((time - d.t) / d.dt)];
    return [v, v];
  }

  // A curve made from others: values worked out on the page, a difference, a ratio, or the change per second.
  static async computed(t, t0, t1) {
    if (t.op === "given") {
      const { y, t: from, dt } = t.data, i = Math.min(y.length, Math.max(0, Math.floor((t0 - from) / dt + 1e-6) - 1)), j = Math.max(i, Math.min(y.length, Math.ceil((t1 - from) / dt) + 2));
      return { ...t.data, y: y.slice(i, j).map((v) => v * t.k), t: from + i * dt };
    }
    const a = await Data.samples(t.c, t0, t1), b = t.other === undefined ? null : await Data.samples(t.other, t0, t1), n = a.y.length, y = new Float64Array(n);
    const other = (i) => b.y[Math.min(b.y.length - 1, Math.max(0, Math.round((a.t + i * a.dt - b.t) / b.dt)))];
    for (let i = 0; i < n; i++) y[i] = t.k * (t.op === "over" ? a.y[i] / other(i) : t.op === "minus" ? a.y[i] - other(i) : (a.y[Math.min(n - 1, i + 1)] - a.y[Math.max(0, i - 1)]) / (a.dt * (Math.min(n - 1, i + 1) - Math.max(0, i - 1))));
    return { ...a, y };
  }

  // Height of the values: twice or half as tall about the middle of what is shown; `robust`: without a few outliers.
  stretch(by) { this.tall = by ? Math.min(64, Math.max(1, this.tall * by)) : 1; return this.redraw(); }

  // Range of a row's axis, or null for all values; and what it cuts off.
  heights(row, curves) {
    const y = curves.flatMap((c) => c.y.filter(Number.isFinite)), robust = this.robust && !row.limits ? Looks.robust(curves) : null;
    if (this.tall === 1 || !y.length) return robust;
    const least = y.reduce((a, b) => Math.min(a, b), Infinity), most = y.reduce((a, b) => Math.max(a, b), -Infinity), [low, high] = robust?.range ?? row.limits ?? [least, most], middle = (low + high) / 2, half = (high - low || 1) / 2 / this.tall;
    return { range: [middle - half, middle + half], least, most };
  }

  static colour(name) { return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim(); }

  static text(s) { return s.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;").replaceAll("%{", "&#37;{"); }

  static styles = {
    measured: { colour: "accent", width: 1.7, sign: "━━" },
    commanded: { colour: "text", width: 1.3, dash: "dot", sign: "···" },
    expected: { colour: "teal", width: 1.5, dash: "dash", sign: "╌╌" },
    reference: { colour: "text", width: 1, sign: "──" },
    replayed: { colour: "alt", width: 1.5, dash: "dash", sign: "╌╌" },
    applied: { colour: "teal", width: 1.5, sign: "━━" },
    right: { colour: "muted", width: 1, dash: "dot", sign: "···" },
    peer: { colour: "peer", width: 1.1, sign: "──" },
    "free-0": { colour: "accent", width: 1.6, sign: "━━" },
    "free-1": { colour: "stuck", width: 1.4, dash: "dash", sign: "╌╌" },
    "free-2": { colour: "teal", width: 1.6, sign: "━━" },
    "free-3": { colour: "alt", width: 1.4, dash: "dash", sign: "╌╌" },
    "free-4": { colour: "inefficient-line", width: 1.6, dash: "dot", sign: "···" },
    "free-5": { colour: "text", width: 1.1, sign: "──" },
    band: { colour: "accent", width: 0 },
    threshold: { colour: "stuck", width: 1.3, dash: "dash", sign: "╌╌" },
  };

  static style(role) {
    if (role.startsWith("mode-")) {
      const mode = role.slice(5), dash = Data.view.dashes[mode] ?? "solid";
      return { colour: `${mode}-line`, width: 1.6, dash, sign: dash === "dash" ? "╌╌" : dash === "dot" ? "···" : "━━" };
    }
    return Figure.styles[role];
  }

  // Dots where few enough samples are in view to tell them apart.
  static mode(curve) { return curve.exact && curve.x.length <= 160 ? "lines+markers" : "lines"; }

  // Whether extremes fill areas somewhere: dashes along them would interfere with each other and with other bands.
  static dense({ exact, y }) {
    if (exact) return false;
    let low = Infinity, high = -Infinity, swings = 0;
    for (const v of y) { if (v < low) low = v; if (v > high) high = v; }
    const wide = 0.1 * (high - low);
    for (let i = 2; i < y.length; i++) if (Math.abs(y[i] - y[i - 1]) > wide && (y[i] - y[i - 1]) * (y[i - 1] - y[i - 2]) < 0) swings += 1;
    return swings > 12;
  }

  // Line of a curve: areas of extremes are even and let others show through.
  static line(s, curve) {
    return Figure.dense(curve) ? { width: 1.8, dash: "solid", opacity: 0.65 } : { width: s.width, dash: s.dash || "solid", opacity: 1 };
  }

  pixels() { return Math.max(200, this.element.clientWidth - 70); }

  // Curves of all rows for the current range, in the order of `traces`.
  async fetch(range) {
    const pixels = this.pixels(), [t0, t1] = range;
    const made = (t) => Figure.computed(t, t0, t1).then((d) => Data.thinned(d, pixels));
    const one = (c, k) => Data.curve(c, t0, t1, pixels).then((d) => (k === 1 ? d : { ...d, y: d.y.map((v) => v * k) }));
    const curves = [];
    for (const row of this.rows) {
      if (row.band) {
        const [low, high] = await Promise.all(row.band.map((c) => one(c, row.bandScale)));
        curves.push(Figure.polygon(low, high));
      }
      if (row.threshold !== undefined) {
        const d = await one(row.threshold, row.bandScale);
        curves.push(d, { ...d, y: d.y.map((v) => -v) });
      }
      for (const t of row.traces) curves.push(await (t.op ? made(t) : one(t.c, t.k)));
    }
    return curves;
  }

  // Closed outlines between two curves, one for each stretch without a gap.
  static polygon(low, high) {
    const x = [], y = [];
    const runs = (d) => {
      const list = [];
      let run = null;
      d.y.forEach((v, i) => {
        if (!Number.isFinite(v)) run = null;
        else { if (!run) list.push(run = []); run.push([d.x[i], v]); }
      });
      return list;
    };
    const lows = runs(low), highs = runs(high);
    for (let i = 0; i < Math.min(lows.length, highs.length); i++) {
      for (const [a, b] of [...highs[i], ...lows[i].reverse()]) { x.push(a); y.push(b); }
      x.push(NaN); y.push(NaN);
    }
    return { x, y, exact: low.exact, stride: low.stride, stored: low.stored };
  }

  traces(curves) {
    const list = [], add = (i, role, name, unit, right, more) => {
      const s = Figure.style(role), d = curves[list.length], { opacity, ...line } = Figure.line(s, d);
      list.push({ opacity,
        type: "scatter", mode: Figure.mode(d), marker: { size: 4 }, x: d.x, y: d.y, name: Figure.text(name), connectgaps: false, xaxis: "x",
        yaxis: right ? `y${100 + i}` : `y${i ? i + 1 : ""}`, line: { color: Figure.colour(s.colour), ...line }, meta: role,
        hoverinfo: "skip", ...more,
      });
    };
    this.rows.forEach((row, i) => {
      if (row.band) add(i, "band", "95 % band", row.unit, false, { fill: "toself", opacity: 0.22, fillcolor: Figure.colour("accent"), mode: "lines" });
      if (row.threshold !== undefined) {
        add(i, "threshold", "+ threshold", row.unit, false);
        add(i, "threshold", "− threshold", row.unit, false);
      }
      for (const t of row.traces) add(i, t.role, t.name, t.unit ?? (t.right ? row.rightUnit.unit : row.unit), t.right);
    });
    return list;
  }

  // For each row the curves drawn in it.
  perRow(curves) {
    let from = 0;
    return this.rows.map((r) => curves.slice(from, from += r.traces.length + (r.band ? 1 : 0) + (r.threshold === undefined ? 0 : 2)));
  }

  static duration(s) { return s < 1 ? `${+(s * 1e3).toPrecision(2)} ms` : `${+s.toPrecision(2)} s`; }

  // Samples of which the extremes alone are stored, where curves are drawn from such; else 1.
  static stored(curves) { return Math.max(1, ...curves.map((c) => c.stored || 1)); }

  // Whether a row shows every sample or the extremes of several, and how far that moves what it shows.
  static drawn(curves) {
    if (curves.every((c) => c.exact)) return "▪ every sample";
    const stored = Figure.stored(curves), moved = stored > 1 ? `, times to ${Figure.duration(stored * Data.view.dt)}` : "";
    return `▤ min–max of ${Math.max(...curves.map((c) => c.stride))} samples${moved}`;
  }

  // Channels that a row draws.
  static channels(row) { return [...row.traces.flatMap((t) => (t.other === undefined ? [t.c] : [t.c, t.other])), ...(row.band || []), ...(row.threshold === undefined ? [] : [row.threshold])]; }

  // Title and legend of a row, wrapped to the figure's width; at the end how it is drawn.
  heading(row, curves) {
    const entries = row.traces.filter((t) => t.role !== "peer").map((t) => [Figure.style(t.role), t.name]);
    const peers = row.traces.filter((t) => t.role === "peer").map((t) => t.name);
    if (peers.length) entries.unshift([Figure.style("peer"), peers.join(", ")]);
    if (row.threshold !== undefined) entries.push([Figure.style("threshold"), "± threshold"]);
    if (row.level !== undefined) entries.push([Figure.style("threshold"), `limit ${row.level}`]);
    const cut = this.heights(row, curves);
    if (row === this.rows[0] && this.shades.some((s) => s.main && s.detected != null)) entries.push([{ colour: "text", sign: "╎" }, "detected"]);
    const muted = Figure.colour("muted"), room = this.pixels() / 6.4, title = `${row.title} (${row.unit})`;
    let text = `<b>${Figure.text(row.title)}</b> (${Figure.text(row.unit)})`, used = title.length, lines = 1;
    for (const [s, n] of entries) {
      if (used + n.length + 6 > room) { text += "<br>"; used = 0; lines += 1; } else text += "   ";
      used += n.length + 6;
      text += `<span style="color:${Figure.colour(s.colour)}">${s.sign}</span> <span style="color:${muted}">${Figure.text(n)}</span>`;
    }
    const drawn = Figure.drawn(curves) + (cut ? ` · scale cut, values from ${Now.number(cut.least)} to ${Now.number(cut.most)}` : "");
    if (used + 30 > room) { text += "<br>"; lines += 1; } else text += "   ";
    return { text: `${text}<span style="color:${muted}"><i>${drawn}</i></span>`, lines };
  }

  headings(curves) {
    const parts = this.perRow(curves);
    return this.rows.map((r, i) => this.heading(r, parts[i]));
  }

  layout(width) {
    const [text, muted, line, grid] = ["text", "muted", "line", "line2"].map(Figure.colour);
    const panel = !width && this.rows.length > 5 ? 104 : 128, foot = 44, headings = this.headings(this.curves);
    this.lines = headings.map((h) => h.lines);
    const heads = headings.map((h) => 15 + 16 * h.lines), plot = heads.reduce((sum, h) => sum + h + panel, 0), height = plot + foot;
    const last = this.rows.length;
    const layout = {
      margin: { l: 56, r: this.rows.some((r) => r.rightUnit) ? 52 : 14, t: 0, b: foot }, height, width, autosize: !width,
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", showlegend: false, dragmode: "zoom",
      modebar: { bgcolor: "rgba(0,0,0,0)", color: muted, activecolor: Figure.colour("accent") },
      font: { color: text, size: 12, family: getComputedStyle(document.body).fontFamily },
      hovermode: false,
      xaxis: {
        range: [...this.range], tickformat: ".9~g", anchor: last > 1 ? `y${last}` : "y", gridcolor: grid, zeroline: false, linecolor: line, tickcolor: line,
        ticks: "outside", title: { text: "mission time (s)", standoff: 4, font: { color: muted, size: 12 } },
      },
      shapes: [], annotations: [],
    };
    let down = 0;
    const parts = this.perRow(this.curves), cuts = this.rows.map((r, i) => this.heights(r, parts[i]));
    this.rows.forEach((row, i) => {
      down += heads[i] + panel;
      const top = 1 - (down - panel) / plot, axis = `yaxis${i ? i + 1 : ""}`;
      layout[axis] = {
        domain: [Math.max(0, top - panel / plot), top], gridcolor: grid, zerolinecolor: line, fixedrange: true, nticks: 5, tickformat: ".4~g",
        ...Figure.ranged(cuts[i], row), ...(row.clip ? { autorangeoptions: { clipmin: row.clip[0], clipmax: row.clip[1] } } : {}),
      };
      if (row.rightUnit) layout[`yaxis${100 + i}`] = { overlaying: `y${i ? i + 1 : ""}`, side: "right", anchor: "x", showgrid: false, zeroline: false, fixedrange: true, nticks: 4, tickfont: { color: muted }, tickformat: ".3~g", title: { text: Figure.text(`${row.rightUnit.title} (${row.rightUnit.unit})`), font: { size: 11, color: muted }, standoff: 2 } };
      for (const level of row.levels ?? [row.level]) if (level !== undefined) layout.shapes.push({ type: "line", xref: "paper", yref: `y${i ? i + 1 : ""}`, x0: 0, x1: 1, y0: level, y1: level, line: { color: Figure.colour("stuck"), width: 1.3, dash: "dash" } });
      layout.annotations.push({
        xref: "paper", yref: "paper", x: 0, y: top, yshift: 3, xanchor: "left", yanchor: "bottom", showarrow: false, align: "left", font: { size: 12 },
        text: headings[i].text,
      });
    });
    this.shade(layout);
    return layout;
  }

  static ranged(cut, row) { return cut ? { range: cut.range, autorange: false } : row.limits ? { range: row.limits, autorange: false } : { autorange: true }; }

  // Intervals of faults behind the panels that show their component, named in the first.
  shade(layout) {
    const stored = this.perRow(this.curves).map(Figure.stored), { t0, dt } = Data.view;
    for (const s of this.shades) {
      const fill = Figure.colour(s.mode), x0 = s.start, x1 = Math.max(s.stop, s.start + Data.view.dt);
      const rows = [...this.rows.keys()].filter((i) => !this.rows[i].component || this.rows[i].component === s.component);
      for (const i of rows) {
        const yref = `y${i ? i + 1 : ""} domain`, box = { xref: "x", yref, x0, y0: 0, y1: 1 };
        layout.shapes.push({ ...box, type: "rect", x1, fillcolor: fill, opacity: s.main ? 0.15 : 0.09, line: { width: 0 }, layer: "below" });
        if (s.main) for (const x of [x0, x1]) layout.shapes.push({ ...box, type: "line", x0: x, x1: x, line: { color: fill, width: 1.2 } });
        // Extremes stand somewhere in their block: what bends within the one of an edge may bend at the edge.
        const block = stored[i] * dt, begin = (x) => t0 + Math.floor((x - t0) / block + 1e-6) * block;
        if (s.main && stored[i] > 1) for (const x of [s.start, s.stop]) layout.shapes.push({ ...box, type: "rect", x0: begin(x), x1: begin(x) + block, fillcolor: Figure.colour("muted"), opacity: 0.3, line: { width: 0 }, layer: "below" });
        if (s.main && s.detected != null) layout.shapes.push({ ...box, type: "line", x0: s.detected, x1: s.detected, line: { color: Figure.colour("text"), width: 1.2, dash: "dash" } });
      }
      if (s.main || !rows.length || this.shades.length > 30) continue;
      layout.annotations.push({
        xref: "x", yref: `y${rows[0] ? rows[0] + 1 : ""} domain`, x: (x0 + x1) / 2, y: 1, yanchor: "top", showarrow: false, text: Figure.text(s.id), bgcolor: Figure.colour("surface"), borderpad: 0, opacity: 0.85,
        font: { size: 11, color: Figure.colour("muted") },
      });
    }
  }

  // What is drawn in the current view, and where every sample is to be had.
  label(curves) {
    if (!this.badge) return;
    const { dt } = Data.view, parts = this.perRow(curves), exact = parts.filter((p) => p.every((c) => c.exact)).length, every = exact === parts.length;
    this.badge.classList.toggle("full", every);
    if (every) {
      this.badge.textContent = `every sample drawn · ${+(1 / dt).toPrecision(4)} Hz`;
      return;
    }
    const time = Figure.duration(Math.max(...curves.map((c) => c.stride)) * dt), words = [`min–max envelope · ${time}`], stored = Figure.stored(curves);
    if (exact) words.unshift(`every sample in ${exact} of ${parts.length} plots, else`);
    if (stored === 1) words.push("per pixel");
    else words.push(`· ${this.near(parts) ? "every sample around faults: zoom in" : `extremes of ${stored} samples stored${this.command()}`}`);
    this.badge.textContent = words.join(" ");
  }

  // Whether the plots that draw stored extremes show every sample once zoomed in: to the chosen fault, else anywhere in view.
  near(parts) {
    const main = this.shades.find((s) => s.main), coarse = this.rows.filter((_, i) => Figure.stored(parts[i]) > 1).flatMap(Figure.channels);
    const [a, b] = this.range;
    return main && main.start < b && main.stop > a
      ? coarse.some((c) => Data.full(c, main.start) || Data.full(c, main.stop))
      : coarse.some((c) => Data.full(c, a, b));
  }

  // Which rows draw stored extremes of how many samples: their edges are shaded.
  coarseness(curves) { return this.perRow(curves).map(Figure.stored).join(); }

  // How to get every sample of a view short enough for a page of its own.
  command() {
    const [a, b] = this.range;
    return b - a > 300 ? "" : ` · every sample: mfhca diagnose LOG --start ${Math.max(0, Math.floor(a - 5))} --end ${Math.ceil(b + 5)}`;
  }

  async draw(rows, shades, range) {
    Object.assign(this, { rows, shades, range: this.clip(range) });
    const job = ++this.job, Plotly = await Data.plotly();
    let curves, target;
    // Zoomed while its samples were read: those of the new view.
    do curves = await this.fetch(target = this.range); while (job === this.job && target !== this.range);
    if (job !== this.job) return;
    const config = {
      responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "", doubleClick: false,
      modeBarButtonsToRemove: ["toImage", "select2d", "lasso2d", "autoScale2d", "resetScale2d"],
    };
    this.curves = curves;
    this.coarse = this.coarseness(curves);
    await Plotly.react(this.element, this.traces(curves), this.layout(), config);
    this.label(curves);
    if (Now.t !== null) this.read().show();
    if (!this.drawn) {
      this.drawn = true;
      this.element.on("plotly_relayout", (e) => {
        const r = e["xaxis.range"] || ("xaxis.range[0]" in e ? [e["xaxis.range[0]"], e["xaxis.range[1]"]] : null);
        if (r && !this.busy) this.zoom(r.map(Number));
      });
      this.element.on("plotly_doubleclick", () => { if (this.shifted) return; Now.set(Now.t, { a: null }); this.zoom([0, Data.view.duration]); });
    }
    this.onRange?.(this.range, true);
    if (target !== this.range) this.zoom(this.range); // zoomed while it was drawn
  }

  // The same curves at once, for paper of `width` pixels: a drawing for every five rows, so that no sheet cuts one.
  print(width) {
    if (!this.drawn) return;
    const curves = this.perRow(this.curves), most = 5;
    this.sheets = [];
    for (let i = 0; i < this.rows.length; i += most) {
      const part = new Figure(i ? document.createElement("div") : this.element);
      Object.assign(part, { rows: this.rows.slice(i, i + most), curves: curves.slice(i, i + most).flat(), shades: this.shades, range: this.range });
      if (i) {
        part.element.className = "sheet";
        (this.sheets.at(-1) || this.element).after(part.element);
        this.sheets.push(part.element);
      }
      Plotly.react(part.element, part.traces(part.curves), part.layout(width));
    }
  }

  redraw() {
    for (const e of this.sheets || []) { Plotly.purge(e); e.remove(); }
    this.sheets = [];
    return this.drawn ? this.draw(this.rows, this.shades, this.range) : undefined;
  }

  clip([a, b]) {
    const least = 4 * Data.view.dt, end = Data.view.t0 + Data.view.n * Data.view.dt;
    if (!(b - a >= least)) b = a + least;
    return [Math.max(Math.min(0, Data.view.t0), a), Math.min(Math.max(end, Data.view.duration), b)];
  }

  async zoom(range) {
    this.range = this.clip(range);
    this.onRange?.(this.range);
    if (!this.drawn) return; // what is being drawn looks for its range when it is done
    if (this.busy) { this.again = true; return; }
    this.busy = true;
    try {
      do {
        this.again = false;
        const target = [...this.range], { rows } = this, curves = await this.fetch(target);
        if (rows !== this.rows) return;
        const heads = Object.fromEntries(this.headings(curves).map((h, i) => [`annotations[${i}].text`, h.text]));
        this.curves = curves;
        const coarse = this.coarseness(curves), shapes = coarse === this.coarse ? {} : { shapes: this.layout().shapes };
        this.coarse = coarse;
        const axes = {};
        if (this.robust || this.tall > 1) this.perRow(curves).forEach((part, i) => Object.entries(Figure.ranged(this.heights(this.rows[i], part), this.rows[i])).forEach(([k, v]) => { axes[`yaxis${i ? i + 1 : ""}.${k}`] = v; }));
        await Plotly.update(this.element, this.restyled(curves), { "xaxis.range": target, ...heads, ...shapes, ...axes });
        this.label(curves);
        if (Now.t !== null) this.read().show();
      } while (this.again);
    } finally { this.busy = false; }
  }

  // Samples of the curves as Plotly.update takes them; areas stay without dots.
  restyled(curves) {
    const mode = this.element.data.map((d, i) => (d.fill ? "lines" : Figure.mode(curves[i])));
    const lines = this.element.data.map((d, i) => (d.fill ? { opacity: d.opacity, ...d.line } : Figure.line(Figure.style(d.meta), curves[i])));
    return {
      x: curves.map((c) => c.x), y: curves.map((c) => c.y), mode, opacity: lines.map((l) => l.opacity ?? 1),
      "line.dash": lines.map((l) => l.dash), "line.width": lines.map((l) => l.width),
    };
  }

  // Part of the range earlier (−) or later, and closer (below 1) or wider about its middle.
  pan(part) {
    const [a, b] = this.range, [first, last] = this.clip([-Infinity, Infinity]), width = b - a;
    const from = Math.min(Math.max(first, a + part * width), last - width);
    return this.zoom([from, from + width]);
  }

  scale(factor) {
    const [a, b] = this.range, middle = (a + b) / 2, half = factor * (b - a) / 2;
    return this.zoom([middle - half, middle + half]);
  }

  // Address of a picture of the figure on the page's background, with a line above that says what it shows.
  image(form, words) {
    const { data, layout, clientWidth } = this.element, width = Math.max(600, clientWidth), height = layout.height + 26;
    const paper = Figure.colour("surface"), margin = { ...layout.margin, t: 26 };
    const title = { text: Figure.text(words), x: 0.01, xanchor: "left", y: 1, yref: "container", yanchor: "top", pad: { t: 7 }, font: { size: 13 } };
    const whole = { ...layout, width, height, margin, title, autosize: false, paper_bgcolor: paper, plot_bgcolor: paper };
    return Plotly.toImage({ data, layout: whole }, { format: form, width, height, scale: form === "png" ? 2 : 1 });
  }

  csv() {
    const columns = new Map();
    for (const row of this.rows) {
      for (const t of row.traces) if (t.other !== undefined) columns.set(t.other, { c: t.other, k: Data.view.channels[t.other].k, unit: Data.view.channels[t.other].unit });
      for (const t of row.traces) columns.set(t.c, t.op ? { c: t.c, k: Data.view.channels[t.c].k, unit: Data.view.channels[t.c].unit } : { c: t.c, k: t.k, unit: t.unit ?? (t.right ? row.rightUnit.unit : row.unit) });
      for (const c of row.band || []) columns.set(c, { c, k: row.bandScale, unit: row.unit });
      if (row.threshold !== undefined) columns.set(row.threshold, { c: row.threshold, k: row.bandScale, unit: row.unit });
    }
    return Data.csv([...columns.values()], ...this.range);
  }
}
