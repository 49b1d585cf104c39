"use strict";
// Free choice of signals: plots over one time axis, each with the signals that the user put there.
class Explorer {
  constructor(onChange, onRange) {
    const one = (s) => document.querySelector(s);
    Object.assign(this, { one, onChange, plots: [], names: Explorer.ordered() });
    this.figure = new Figure(one("#signals-figure"), one("#signals-badge"), onRange);
    one("#find").addEventListener("input", () => this.list());
    one("#find").addEventListener("keydown", (e) => {
      if (e.key === "Enter") { e.preventDefault(); this.add(); }
      else if (e.key === "ArrowDown") { e.preventDefault(); one("#columns").focus(); }
    });
    one("#columns").addEventListener("keydown", (e) => { if (e.key === "Enter") { e.preventDefault(); this.add(); } });
    one("#columns").addEventListener("dblclick", () => this.add());
    one("#preset").addEventListener("change", (e) => {
      const preset = this.presets()[e.target.value];
      if (!preset) return;
      one("#signals-view").value = preset.view ?? "time";
      this.set(preset.plots);
      e.target.value = "";
    });
    one("#preset").append(...Object.keys(this.presets()).map((k) => new Option(k, k)));
    one("#signals-view").addEventListener("change", () => this.onChange());
    one("#plots").addEventListener("click", (e) => {
      const b = e.target.closest("button");
      if (b) this.remove(+b.dataset.plot, b.dataset.name);
    });
    this.list();
  }

  // Channels by their names: recorded ones first, then replayed ones, then evidence.
  static ordered() {
    const rank = (n) => (n.startsWith("evidence.") ? 2 : n.startsWith("replay.") ? 1 : 0), list = Data.view.channels.map((c, i) => [c.name, i]);
    return new Map(list.sort(([a], [b]) => rank(a) - rank(b) || (a < b ? -1 : 1)));
  }

  // Signals whose name holds every word of the search.
  list() {
    const words = this.one("#find").value.toLowerCase().split(/\s+/), found = [...this.names.keys()].filter((n) => words.every((w) => n.toLowerCase().includes(w)));
    const parts = new Map();
    for (const n of found) { const part = Explorer.part(n); parts.set(part, [...(parts.get(part) ?? []), n]); }
    this.one("#columns").replaceChildren(...[...parts].map(([part, names]) => {
      const group = document.createElement("optgroup");
      group.label = part;
      group.append(...names.map((n) => new Option(n, n)));
      return group;
    }));
    if (found.length) this.one("#columns").selectedIndex = 0;
    this.one("#found").textContent = `${found.length} of ${this.names.size}`;
  }

  // Part of the machine that a channel is of.
  static part(name) {
    const p = name.split("."), own = p[0] === "evidence" || p[0] === "replay" || p[0] === "wheel" || p[0] === "steer";
    return own && p.length > 2 ? p[1] : "machine";
  }

  // What is drawn under a name: a channel, its change per second, or its difference from another; or nothing.
  meaning(name) {
    const of = (n) => { const c = this.names.get(n); return c === undefined ? null : { c, k: Data.view.channels[c].k, unit: Data.view.channels[c].unit }; };
    const plain = of(name);
    if (plain) return plain;
    if (name.startsWith("d:")) { const t = of(name.slice(2)); return t && { ...t, op: "slope", unit: t.unit === "1" ? "1/s" : t.unit.endsWith("/s") ? `${t.unit}²` : `${t.unit}/s`, words: `d/dt ${name.slice(2)}` }; }
    for (let i = name.indexOf("|"); i > 0; i = name.indexOf("|", i + 1)) {
      const t = of(name.slice(0, i)), other = this.names.get(name.slice(i + 1));
      if (t && other !== undefined) return { ...t, op: "minus", other, words: `${name.slice(0, i)} − ${name.slice(i + 1)}` };
    }
    return null;
  }

  // Ready choices: the paper's figures, every wheel's speed, one part, opening against speed.
  presets() {
    if (this.ready) return this.ready;
    const has = (n) => this.names.has(n), all = [...this.names.keys()], wheels = [...new Set(all.filter((n) => n.startsWith("wheel.")).map(Explorer.part))], own = (...list) => list.map((p) => p.filter(has)).filter((p) => p.length), out = {};
    const add = (title, plots, view) => { if (plots.length) out[title] = { plots, view }; };
    for (const g of Data.view.loop) add(`Paper’s figure: ${g.title}`, g.rows.map((r) => r.traces.map((t) => Data.view.channels[t.c].name)));
    add("All speeds", own(wheels.map((w) => `wheel.${w}.v`)));
    add("All openings", own(wheels.map((w) => `wheel.${w}.u`)));
    add("Opening against speed", wheels.filter((w) => has(`wheel.${w}.u`) && has(`wheel.${w}.v`)).map((w) => [`wheel.${w}.u`, `wheel.${w}.v`]), "xy");
    for (const w of wheels) add(`One wheel: ${w}`, own([`replay.${w}.v_ref`, `wheel.${w}.v_true`, `wheel.${w}.v`], [`wheel.${w}.u`, `replay.${w}.u`], [`evidence.${w}.sensor.residual`, `evidence.${w}.sensor.threshold`], [`evidence.${w}.sensor.probability`, `evidence.${w}.actuator.probability`]));
    return (this.ready = out);
  }

  // Puts the selected signals into a plot; `how`: their difference or their change per second instead.
  add(how) {
    let names = [...this.one("#columns").selectedOptions].map((o) => o.value);
    if (how === "minus" && names.length !== 2) { this.one("#live").textContent = this.one("#found").textContent = "Select two signals: hold Ctrl, or Shift and an arrow."; return; }
    if (how === "minus") names = this.meaning(names[0]).unit === this.meaning(names[1]).unit ? [names.join("|")] : [];
    if (how === "slope") names = names.map((n) => `d:${n}`);
    if (!names.length) { this.one("#live").textContent = this.one("#found").textContent = "These have different units: there is no difference."; return; }
    const into = this.one("#into").value, plot = this.plots[into === "" ? NaN : +into];
    if (into === "each") this.plots.push(...names.map((n) => [n]));
    else if (plot) plot.push(...names.filter((n) => !plot.includes(n)));
    else this.plots.push(names.slice(0, 20));
    this.plots.splice(20);
    this.changed(into)?.then(() => this.one("#signals-figure").scrollIntoView({ block: "nearest" }));
  }

  remove(at, name) {
    this.plots[at] = name === undefined ? [] : this.plots[at].filter((n) => n !== name);
    this.plots = this.plots.filter((p) => p.length);
    this.changed("");
    (this.one("#plots button") || this.one("#find")).focus();
  }

  set(plots) {
    this.plots = plots.slice(0, 20).map((p) => [...new Set(p)].filter((n) => this.meaning(n)).slice(0, 20)).filter((p) => p.length);
    this.changed("");
  }

  changed(into) {
    const { one } = this, button = (text, plot, name, label) => {
      const b = document.createElement("button");
      Object.assign(b, { className: "chip", textContent: text });
      b.dataset.plot = plot;
      if (name !== undefined) b.dataset.name = name;
      b.setAttribute("aria-label", label);
      const cross = document.createElement("i");
      cross.textContent = "×";
      b.append(cross);
      return b;
    };
    one("#plots").replaceChildren(...this.plots.map((names, i) => {
      const item = document.createElement("li"), head = document.createElement("b");
      head.textContent = `Plot ${i + 1}`;
      item.append(head, ...names.map((n) => button(this.meaning(n).words ?? n, i, n, `Remove ${this.meaning(n).words ?? n} from plot ${i + 1}`)));
      if (names.length > 1) item.append(button("all", i, undefined, `Remove plot ${i + 1}`));
      return item;
    }));
    one("#into").replaceChildren(new Option("a new plot", ""), new Option("a plot for each", "each"), ...this.plots.map((_, i) => new Option(`plot ${i + 1}`, i)));
    one("#into").value = into;
    if (one("#into").selectedIndex < 0) one("#into").value = "";
    for (const s of ["#signals-figure", "#signals-badge", "#signals-tools"]) one(s).hidden = !this.plots.length;
    one("#none").hidden = this.plots.length > 0;
    this.figure.release();
    return this.onChange();
  }

  rows() {
    return this.plots.map((names, i) => {
      const traces = names.map((name, j) => { const t = this.meaning(name); return { ...t, name: t.words ?? name, role: `free-${j % 6}` }; });
      const units = [...new Set(traces.map((t) => t.unit))], parts = new Set(names.map(Explorer.part)), two = units.length === 2;
      if (two) for (const t of traces) if (t.unit === units[1]) Object.assign(t, { right: true, name: `${t.name} →` });
      return { key: `plot-${i}`, title: `Plot ${i + 1}`, unit: two ? units[0] : units.join(", "), rightUnit: two ? { title: "→", unit: units[1] } : undefined, traces, component: parts.size === 1 ? [...parts][0] : "\0" };
    });
  }

  get view() { return this.one("#signals-view").value; }

  async draw(shades, range) {
    const other = this.one("#signals-other"), plain = this.view === "time";
    other.hidden = plain || !this.plots.length;
    if (!this.plots.length) return;
    await this.figure.draw(this.rows(), shades, range);
    await this.across();
  }

  // The other view of the signals, drawn anew after the time in view has stood for a moment.
  async across() {
    if (this.view === "time" || !this.plots.length) return;
    const job = this.job = (this.job || 0) + 1;
    await new Promise((done) => setTimeout(done, this.figure.busy ? 200 : 0));
    if (job === this.job) await Views.draw(this.one("#signals-other"), this.view, this.rows(), this.figure.range);
  }

  get active() { return this.figure.drawn && this.plots.length > 0; }
}
