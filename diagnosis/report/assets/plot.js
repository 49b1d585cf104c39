"use strict";
// One figure: rows of panels over one time axis. Zooming thins the samples anew and restyles once.
class Figure extends FigureLooks {
  constructor(element, badge, onRange) {
    super();
    Object.assign(this, { element, badge, onRange, rows: [], shades: [], range: [0, 1], drawn: false, busy: false, again: false, job: 0, held: new Map() });
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
    element.addEventListener("wheel", (e) => { if (e.shiftKey && this.drawn) { e.preventDefault(); this.stretch(e.deltaY + e.deltaX < 0 ? 2 : 0.5, e); } }, { passive: false });
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

  // Values so many times as tall: about the pointer in the panel below it, without one about the middle of every panel.
  stretch(by, pointer) {
    const down = pointer && pointer.clientY - this.element.getBoundingClientRect().top;
    this.rows.forEach((row, i) => {
      const axis = this.element._fullLayout[`yaxis${i ? i + 1 : ""}`], part = pointer ? (down - axis._offset) / axis._length : 0.5;
      if (part < 0 || part > 1) return;
      const held = this.held.get(Figure.named(row)), [low, high] = held?.range ?? axis.range, [least, most] = held?.whole ?? axis.range;
      const height = Math.max((high - low) / by, (most - least) / 64), still = high - part * (high - low), top = Math.min(most, still + part * height), range = [Math.max(least, top - height), top];
      if (height < most - least) this.held.set(Figure.named(row), { range, whole: [least, most] });
      else this.held.delete(Figure.named(row));
    });
    return this.redraw();
  }

  // Every panel's values as tall as they are without a choice.
  release() { this.held.clear(); }

  pixels() { return Math.max(200, (this.paper || this.element.clientWidth) - 70); }

  // Curves of all rows for the current range, in the order of `traces`.
  async fetch(range) {
    const pixels = this.pixels(), [t0, t1] = range;
    const made = (t) => Figure.computed(t, t0, t1).then((d) => Data.thinned(d, pixels));
    const one = (c, k) => Data.curve(c, t0, t1, pixels).then((d) => (k === 1 ? d : { ...d, y: d.y.map((v) => v * k) }));
    const curves = [];
    for (const row of this.rows) {
      if (row.band) {
        const [low, high] = await Promise.all(row.band.map((c) => one(c, row.bandScale)));
        curves.push(Figure.polygon(low, high, row.steps));
      }
      if (row.threshold !== undefined) {
        const d = await one(row.threshold, row.bandScale);
        curves.push(d, { ...d, y: d.y.map((v) => -v) });
      }
      for (const t of row.traces) curves.push(await (t.op ? made(t) : one(t.c, t.k)));
    }
    return curves;
  }

  // What is drawn in the current view, and where every sample is to be had.
  label(curves) {
    if (!this.badge) return;
    const { dt } = Data.view, parts = this.perRow(curves), exact = parts.filter((p) => p.every((c) => c.exact)).length, every = exact === parts.length;
    this.badge.classList.toggle("full", every);
    if (every) {
      this.badge.textContent = `every sample drawn · ${Now.number(1 / dt)} Hz`;
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
      this.element.on("plotly_doubleclick", () => { if (this.shifted) return; Now.set(Now.t, { a: null }); this.release(); this.zoom([0, Data.view.duration]).then(() => this.redraw()); });
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
      Object.assign(part, { rows: this.rows.slice(i, i + most), curves: curves.slice(i, i + most).flat(), shades: this.shades, range: this.range, held: this.held, paper: width });
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
        this.perRow(curves).forEach((part, i) => Object.entries(Figure.ranged(this.heights(this.rows[i], part), this.rows[i])).forEach(([k, v]) => { axes[`yaxis${i ? i + 1 : ""}.${k}`] = v; }));
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
