"use strict";
// The cursor and the markers of one figure, and every curve's value in the heading of its row.
class Reading {
  constructor(figure) {
    this.figure = figure;
    this.box = document.createElement("div");
    this.box.className = "reading";
    this.box.setAttribute("aria-hidden", "true");
    figure.element.append(this.box);
  }

  axis() { return this.figure.element._fullLayout?.xaxis; }

  time(e) { const x = this.axis(); return x.p2d(e.clientX - this.figure.element.getBoundingClientRect().left - x._offset); }

  inside(e) {
    const x = this.axis(), at = e.clientX - this.figure.element.getBoundingClientRect().left - (x?._offset ?? 0);
    return x && at >= 0 && at <= x._length;
  }

  async show() {
    const { figure, box } = this, job = this.job = (this.job || 0) + 1, x = this.axis();
    if (Now.t === null || !x || figure.element.hidden) { box.replaceChildren(); return; }
    const values = await Promise.all(figure.rows.map((row) => Promise.all(row.traces.map(async (t) => {
      const [low, high] = await Figure.at(t, Now.t), [a, b] = Now.b === null || Now.a === null ? [] : await Promise.all([Now.a, Now.b].map((m) => Figure.at(t, m)));
      return { low, high, delta: a && (b[0] + b[1] - a[0] - a[1]) / 2 };
    }))));
    if (job !== this.job) return;
    const parts = [], line = (t, name) => {
      const at = x.l2p(t);
      if (t === null || !(at >= 0 && at <= x._length)) return;
      const e = document.createElement("i");
      e.className = name ? "mk" : "";
      e.textContent = name;
      e.style.left = `${x._offset + at}px`;
      parts.push(e);
    };
    line(Now.t, "");
    line(Now.a, "A");
    line(Now.b, "B");
    figure.rows.forEach((row, i) => parts.push(this.heading(row, i, values[i])));
    box.replaceChildren(...parts);
    for (const head of box.querySelectorAll("p")) head.style.top = `${Math.max(parseFloat(head.style.top), head.offsetHeight + 2)}px`; // none above the figure
    this.values = values;
  }

  heading(row, i, values) {
    const { figure } = this, layout = figure.element._fullLayout, head = document.createElement("p"), title = document.createElement("b");
    title.textContent = row.title;
    head.append(title, ` (${row.unit}) `);
    if (!i) head.append(` ${Now.clock(Now.t, 4)}${Now.t < 60 ? "" : ` = ${Now.seconds(Now.t)} s`}${Now.a === null || Now.b === null ? "" : `, Δt ${Now.number(Now.b - Now.a)} s`} `);
    row.traces.forEach((t, j) => {
      const span = document.createElement("span"), sign = document.createElement("u"), s = Figure.style(t.role);
      sign.textContent = s.sign;
      sign.style.color = Figure.colour(s.colour);
      span.append(sign, ` ${t.name} `);
      const value = document.createElement("b");
      value.textContent = Reading.words(values[j]);
      span.append(value);
      head.append(span, " ");
    });
    head.style.top = `${layout[`yaxis${i ? i + 1 : ""}`]._offset - 2}px`;
    head.style.minHeight = `${16 * this.figure.lines[i] + 2}px`;
    head.style.left = `${layout.xaxis._offset}px`;
    return head;
  }

  static words({ low, high, delta }) {
    return (low === high || !(high > low) ? Now.number(low) : `${Now.number(low)} … ${Now.number(high)}`) + (delta === undefined ? "" : ` Δ ${Now.number(delta)}`);
  }

  // What the first row shows at the cursor, for who hears it.
  spoken() {
    const row = this.figure.rows[0];
    return `${Now.clock(Now.t)}: ${row.traces.map((t, j) => `${t.name} ${Reading.words(this.values[0][j])} ${row.unit}`).join(", ")}`;
  }
}

// Other looks at the rows of a figure.
const Looks = {
  // The part's name in each channel of a row for another part's, or nothing where a channel is missing.
  moved(row, from, to, names) {
    const other = (c) => names.get(Data.view.channels[c].name.replace(`.${from}.`, `.${to}.`)), traces = row.traces.map((t) => ({ ...t, c: other(t.c), name: t.name === from ? to : t.name })).filter((t) => t.c !== undefined);
    if (!traces.length || !row.traces.some((t) => Data.view.channels[t.c].name.includes(`.${from}.`))) return null;
    const band = row.band?.map(other), threshold = row.threshold === undefined ? undefined : other(row.threshold);
    return { ...row, traces, band: band?.includes(undefined) ? undefined : band, threshold, title: `${row.title.replace(` ${from}`, "")} ${to}`, component: to };
  },

  // One panel for every part of a kind: `own` first, as the others stand in the machine.
  peers(row, own) {
    const names = new Map(Data.view.channels.map((c, i) => [c.name, i])), kind = Data.view.channels.find((c) => c.name.includes(`.${own}.`) && /^(wheel|steer)\./.test(c.name))?.name.split(".")[0];
    const parts = new Set([own, ...Data.view.channels.map((c) => c.name.split(".")).filter((p) => p[0] === kind).map((p) => p[1])]);
    return [...parts].map((p) => Looks.moved(row, own, p, names)).filter(Boolean);
  },

  // Residuals as multiples of their thresholds.
  ratio(row) {
    if (row.threshold === undefined) return row;
    const traces = row.traces.map((t) => ({ ...t, op: "over", other: row.threshold, k: t.k / row.bandScale, name: `${t.name} ÷ threshold` }));
    return { ...row, traces, threshold: undefined, unit: "1", title: `${row.title} ÷ threshold`, levels: [1, -1] };
  },

  // Range that a few outliers of a command do not stretch, while all of what is measured stays in sight.
  asked(row, curves) {
    const of = (c) => row.traces[curves.indexOf(c) - curves.length + row.traces.length], own = (f) => curves.filter((c) => of(c) && !of(c).right && f(of(c)));
    const cut = Looks.robust(own((t) => t.role === "commanded")), rest = own((t) => t.role !== "commanded").flatMap((c) => c.y.filter(Number.isFinite));
    if (!cut || !rest.length) return null;
    const [low, high] = rest.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], cut.range);
    return high - low < 0.6 * (Math.max(high, cut.most) - Math.min(low, cut.least)) ? { range: [low, high], least: Math.min(low, cut.least), most: Math.max(high, cut.most) } : null;
  },

  // Range that a few outliers do not stretch, or null where there are none; and what is cut.
  robust(curves) {
    const all = curves.flatMap((c) => c.y.filter(Number.isFinite)).sort((a, b) => a - b), at = (q) => all[Math.floor(q * (all.length - 1))];
    if (all.length < 20) return null;
    const [least, low, high, most] = [0, 0.02, 0.98, 1].map(at), room = 0.25 * (high - low) || 0.1 * Math.abs(high) || 1;
    if (least > low - 2 * room && most < high + 2 * room) return null;
    return { range: [low - room, high + room], least, most };
  },
};
