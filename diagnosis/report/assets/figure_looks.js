"use strict";
// How a figure looks: colours and dashes of its curves, their areas, headings, axes and shaded faults.
class FigureLooks {
  // Range of a row's axis, or null for all values; and what it cuts off.
  heights(row, curves) {
    const left = curves.filter((_, i) => !row.traces[i - curves.length + row.traces.length]?.right), held = this.held.get(Figure.named(row));
    if (!held) return row.limits ? null : Figure.robust ? Looks.robust(left) : Looks.asked(row, curves);
    const y = left.flatMap((c) => c.y.filter(Number.isFinite));
    return { range: held.range, least: y.reduce((a, b) => Math.min(a, b), Infinity), most: y.reduce((a, b) => Math.max(a, b), -Infinity) };
  }

  // Whether all figures of the page leave a few outliers outside.
  static robust = false;

  // What tells a row from the others of its figure.
  static named(row) { return `${row.key} ${row.title}`; }

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

  // Closed outlines between two curves, one for each stretch without a gap.
  static polygon(low, high, steps) {
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
    // What holds until it changes is drawn as steps.
    const corners = (run) => (steps ? run.flatMap(([a, b], i) => (i ? [[a, run[i - 1][1]], [a, b]] : [[a, b]])) : run);
    for (let i = 0; i < Math.min(lows.length, highs.length); i++) {
      for (const [a, b] of [...corners(highs[i]), ...corners(lows[i]).reverse()]) { x.push(a); y.push(b); }
      x.push(NaN); y.push(NaN);
    }
    return { x, y, exact: low.exact, stride: low.stride, stored: low.stored };
  }

  traces(curves) {
    const list = [], add = (i, role, name, unit, right, more) => {
      const s = Figure.style(role), d = curves[list.length], { opacity, ...line } = Figure.line(s, d);
      list.push({ opacity,
        type: "scatter", mode: Figure.mode(d), marker: { size: 4 }, x: d.x, y: d.y, name: Figure.text(name), connectgaps: false, xaxis: "x",
        yaxis: right ? `y${100 + i}` : `y${i ? i + 1 : ""}`, line: { color: Figure.colour(s.colour), ...line, shape: this.rows[i].steps && role !== "band" ? "hv" : "linear" }, meta: role,
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

  static duration(s) { return s < 1 ? `${Now.number(s * 1e3, 2)} ms` : `${Now.number(s, 2)} s`; }

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
    if (row.unknown) entries.push([{ colour: "muted", sign: "▂▂" }, "not identifiable"]);
    if (row.small) entries.push([{ colour: "healthy", sign: "▒▒" }, "healthy: less than counts as a fault"]);
    if (row.untold) entries.push([{ colour: "stuck", sign: "▒▒" }, "most probably stuck or silent, though no fault is stated"]);
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
      if (row.rightUnit) layout[`yaxis${100 + i}`] = { overlaying: `y${i ? i + 1 : ""}`, side: "right", anchor: "x", showgrid: false, zeroline: false, fixedrange: true, tickmode: "auto", nticks: 4, tickfont: { color: muted }, tickformat: ".3~g", title: { text: Figure.text(`${row.rightUnit.title} (${row.rightUnit.unit})`), font: { size: 11, color: muted }, standoff: 2 } };
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
    this.rows.forEach((row, i) => {
      // What is not known is a strip at the foot: a band as high as a panel is a fault's, some of which are as grey.
      for (const [stretches, colour, y1, opacity] of [[row.unknown, "muted", 0.09, 0.6], [row.small, "healthy", 1, 0.22], [row.untold, "stuck", 1, 0.22]]) for (const [x0, x1] of stretches || []) layout.shapes.push({ type: "rect", xref: "x", yref: `y${i ? i + 1 : ""} domain`, x0, x1, y0: 0, y1, fillcolor: Figure.colour(colour), opacity, line: { width: 0 }, layer: "below" });
    });
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
}
