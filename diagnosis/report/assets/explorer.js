"use strict";
// Free choice of signals: plots over one time axis, each with the signals that the user put there.
class Explorer {
  constructor(onChange, onRange) {
    const one = (s) => document.querySelector(s);
    Object.assign(this, { one, onChange, plots: [], names: Explorer.ordered() });
    this.figure = new Figure(one("#signals-figure"), one("#signals-badge"), onRange);
    one("#find").addEventListener("input", () => this.list());
    one("#find").addEventListener("keydown", (e) => {
      if (e.key === "Enter") { e.preventDefault(); this.add(one("#columns").value); }
      else if (e.key === "ArrowDown") { e.preventDefault(); one("#columns").focus(); }
    });
    one("#columns").addEventListener("keydown", (e) => { if (e.key === "Enter") { e.preventDefault(); this.add(e.target.value); } });
    one("#columns").addEventListener("dblclick", (e) => this.add(e.target.value));
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
    this.one("#columns").replaceChildren(...found.map((n) => new Option(n, n)));
    if (found.length) this.one("#columns").selectedIndex = 0;
    this.one("#found").textContent = `${found.length} of ${this.names.size}`;
  }

  add(name) {
    if (!this.names.has(name)) return;
    const into = this.one("#into").value, plot = into === "" ? null : this.plots[+into];
    if (!plot) this.plots.push([name]);
    else if (!plot.includes(name)) plot.push(name);
    this.changed(into);
  }

  remove(at, name) {
    this.plots[at] = name === undefined ? [] : this.plots[at].filter((n) => n !== name);
    this.plots = this.plots.filter((p) => p.length);
    this.changed("");
    (this.one("#plots button") || this.one("#find")).focus();
  }

  set(plots) {
    this.plots = plots.slice(0, 20).map((p) => [...new Set(p)].filter((n) => this.names.has(n)).slice(0, 20)).filter((p) => p.length);
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
      item.append(head, ...names.map((n) => button(n, i, n, `Remove ${n} from plot ${i + 1}`)));
      if (names.length > 1) item.append(button("all", i, undefined, `Remove plot ${i + 1}`));
      return item;
    }));
    one("#into").replaceChildren(new Option("a new plot", ""), ...this.plots.map((_, i) => new Option(`plot ${i + 1}`, i)));
    one("#into").value = into;
    for (const s of ["#signals-figure", "#signals-badge", "#signals-tools"]) one(s).hidden = !this.plots.length;
    one("#none").hidden = this.plots.length > 0;
    this.onChange();
  }

  rows() {
    return this.plots.map((names, i) => {
      const traces = names.map((name, j) => {
        const c = this.names.get(name), { k, unit } = Data.view.channels[c];
        return { c, name, role: `free-${j % 6}`, k, unit };
      });
      const units = [...new Set(traces.map((t) => t.unit))].join(", "), parts = new Set(names.map((n) => n.replace(/^evidence\./, "x.").split(".")[1]));
      return { key: `plot-${i}`, title: `Plot ${i + 1}`, unit: units, traces, component: parts.size === 1 ? [...parts][0] : "\0" };
    });
  }

  draw(shades, range) { return this.plots.length ? this.figure.draw(this.rows(), shades, range) : undefined; }

  get active() { return this.figure.drawn && this.plots.length > 0; }
}
