"use strict";
// Lanes without a fault, opened: what the part was judged by over the whole mission, and where it came nearest to a threshold, or furthest beyond one.
const Lanes = {
  rows(component, side) {
    const names = new Map(Data.view.channels.map((c, i) => [c.name, i])), base = `evidence.${component}.${side}.`, kind = ["wheel", "steer"].find((k) => names.has(`${k}.${component}.u`) || names.has(`${k}.${component}.v`) || names.has(`${k}.${component}.phi`));
    const trace = (name, words, role) => {
      const c = names.get(name);
      return c === undefined ? [] : [{ c, name: words, role, k: Data.view.channels[c].k, unit: Data.view.channels[c].unit }];
    };
    const own = side === "sensor" ? ["v", "phi"] : ["u_applied", "u"], read = own.map((n) => `${kind}.${component}.${n}`).find((n) => names.has(n)), rows = [];
    const expected = trace(`${base}expected`, "expected", "expected"), measured = read ? trace(read, "measured", "measured") : [];
    if (expected.length && measured.length && expected[0].unit === measured[0].unit) rows.push({ key: "value", title: "Expected and measured", traces: [...expected, ...measured] });
    const residual = trace(`${base}residual`, "residual", "measured");
    if (residual.length) rows.push({ key: "residual", title: "Residual", traces: residual, threshold: names.get(`${base}threshold`), bandScale: residual[0].k });
    const probability = trace(`${base}probability`, "at all, also by less than counts as a fault", "measured");
    if (probability.length) rows.push({ key: "probability", title: "Probability that it deviates", traces: probability, limits: [-0.03, 1.03] });
    return rows.map((r) => ({ ...r, unit: r.traces[0].unit, component }));
  },

  // The largest multiple of its threshold that a residual reached, and when.
  async nearest(row) {
    const { duration, t0 } = Data.view, [r, h] = await Promise.all([Data.samples(row.traces[0].c, t0, duration, 1), Data.samples(row.threshold, t0, duration)]);
    // A threshold that is huge for a moment, as at the first sample, does not flatten what is drawn.
    const sizes = Float64Array.from(h.y).filter(Number.isFinite).map(Math.abs).sort(), most = r.y.reduce((m, v) => Math.max(m, Number.isFinite(v) ? Math.abs(v) : 0), 0);
    let best = { part: -1, span: 1.1 * row.bandScale * Math.max(most, sizes[Math.floor(0.99 * (sizes.length - 1))] || 0) };
    for (let i = 0; i < r.y.length; i++) {
      const limit = h.y[Math.min(h.y.length - 1, Math.max(0, Math.round((r.t + i * r.dt - h.t) / h.dt)))], part = Math.abs(r.y[i]) / limit;
      if (limit > 0 && part > best.part) best = { ...best, part, time: r.t + i * r.dt, residual: r.y[i] * row.traces[0].k, limit: limit * row.bandScale };
    }
    return best;
  },

  async draw(figure, key, words) {
    const dot = key.lastIndexOf("."), component = key.slice(0, dot), rows = Lanes.rows(component, key.slice(dot + 1));
    if (!rows.length) { words.textContent = "No residual of this part was recorded."; figure.element.hidden = true; return; }
    const row = rows.find((r) => r.threshold !== undefined);
    if (row) {
      const { part, time, residual, limit, span } = await Lanes.nearest(row), unit = row.unit === "1" ? "" : row.unit === "°" ? "°" : ` ${row.unit}`;
      if (span > 0) row.limits = [-span, span];
      words.textContent = part < 0 ? "Its residual was never held against a threshold." : part < 1 ? `Nearest to its threshold at ${Now.clock(time)}: residual ${Now.number(residual)}${unit}, ${Now.number(100 * part, 2)} % of the threshold of ${Now.number(limit)}${unit}.` : `Furthest beyond its threshold at ${Now.clock(time)}: residual ${Now.number(residual)}${unit}, ${Now.number(part, 2)} times the threshold of ${Now.number(limit)}${unit}. That alone is no fault: one lasts for longer.`;
    }
    await figure.draw(rows, Data.view.faults.filter((f) => f.component === component).slice(0, 40).map((f) => ({ ...f, main: false })), [0, Data.view.duration]);
  },
};
