"use strict";
// What if a fault were another: the equations of the injected faults and of the wheel, on the recorded mission around it.
const WhatIf = {
  // L4, L8 (7): (1 − ε)·accurate + ε·saturation.
  affected: (accurate, epsilon, saturation) => accurate.map((v, i) => (epsilon[i] ? (1 - epsilon[i]) * v + epsilon[i] * saturation[i] : v)),

  // ε at each time: 0 outside the fault.
  strength: (n, t, dt, { start, stop, epsilon }) => Float64Array.from({ length: n }, (_, i) => (t + i * dt >= start - 1e-9 && t + i * dt < stop - 1e-9 ? epsilon : 0)),

  // Opening beyond the dead zone.
  opened: (u, dead) => u.map((v) => Math.sign(v) * Math.max(Math.abs(v) - dead, 0)),

  // First-order lag: y[k] = a·y[k−1] + (1 − a)·x[k−1], a = exp(−dt/τ).
  lag(x, tau, dt, from = 0) {
    const a = Math.exp(-dt / tau), y = new Float64Array(x.length);
    for (let k = 0, state = from; k < x.length; k++) { y[k] = state; state = a * state + (1 - a) * (Number.isFinite(x[k]) ? x[k] : 0); }
    return y;
  },

  // Change of a wheel's speed where another opening works than the log's: K·lag(opened(other) − opened(log)).
  respond(u, other, { K, tau, dead }, dt) {
    const a = WhatIf.opened(u, dead), b = WhatIf.opened(other, dead);
    return WhatIf.lag(b.map((v, i) => v - a[i]), tau, dt).map((v) => K * v);
  },

  // K, τ and dead zone with which the wheel model follows the speed best, over samples that count.
  fit(u, v, counts, dt) {
    let best = null, total = 0, mean = 0, n = 0;
    for (let i = 0; i < v.length; i++) if (counts[i]) { mean += v[i]; n += 1; }
    mean /= n || 1;
    for (let i = 0; i < v.length; i++) if (counts[i]) total += (v[i] - mean) ** 2;
    if (n < 50 || !(total > 0)) return null;
    for (const dead of [0, 0.02, 0.04, 0.08]) {
      const x = WhatIf.opened(u, dead);
      for (let tau = 0.02; tau < 4; tau *= 1.25) {
        const y = WhatIf.lag(x, tau, dt, x[0] || 0);
        let xx = 0, xv = 0, vv = 0;
        for (let i = 0; i < y.length; i++) if (counts[i]) { xx += y[i] * y[i]; xv += y[i] * v[i]; vv += v[i] * v[i]; }
        const K = xv / xx, misfit = vv - K * xv;
        if (xx > 0 && (!best || misfit < best.misfit)) best = { K, tau, dead, misfit };
      }
    }
    return best && { ...best, explains: 1 - best.misfit / total };
  },

  // Even noise of a standard normal kind, the same each time.
  noise(n) {
    let seed = 1;
    const even = () => { seed = (seed * 1664525 + 1013904223) >>> 0; return (seed + 0.5) / 4294967296; };
    return Float64Array.from({ length: n }, () => Math.sqrt(-2 * Math.log(even())) * Math.cos(2 * Math.PI * even()));
  },

  // Root mean square of a ratio over half a second, as the evidence grows with it.
  rms(ratio, dt) {
    const w = Math.max(1, Math.round(0.5 / dt)), y = new Float64Array(ratio.length);
    for (let i = 0, sum = 0; i < y.length; i++) {
      sum += (ratio[i] || 0) ** 2 - (i >= w ? (ratio[i - w] || 0) ** 2 : 0);
      y[i] = Math.sqrt(Math.max(0, sum) / Math.min(w, i + 1));
    }
    return y;
  },

  // Recorded channels around a fault, on the grid of the first.
  async load(f, row) {
    const names = new Map(Data.view.channels.map((c, i) => [c.name, i])), kind = row.kind, c = f.component, sensor = row.side !== "actuator", end = Math.min(Data.view.duration, f.stop + 60), begin = Math.max(Data.view.t0, f.start - 60);
    const own = names.get(`${kind}.${c}.${sensor ? (kind === "steer" ? "phi" : "v") : "u"}`);
    if (own === undefined) return null;
    const base = await Data.samples(own, begin, end), n = base.y.length, on = async (name) => {
      const at = names.get(name);
      if (at === undefined) return null;
      const d = await Data.samples(at, begin, end);
      return Float64Array.from({ length: n }, (_, i) => d.y[Math.min(d.y.length - 1, Math.max(0, Math.round((base.t + i * base.dt - d.t) / d.dt)))]);
    };
    const evidence = `evidence.${c}.${sensor ? "sensor" : "actuator"}.`, [second, expected, residual, threshold, speed, applied] = await Promise.all([`${kind}.${c}.${kind === "steer" ? "phi" : "v"}_true`, `${evidence}expected`, `${evidence}residual`, `${evidence}threshold`, kind === "wheel" ? `wheel.${c}.v` : "", `${kind}.${c}.u_applied`].map(on));
    const accurate = sensor ? second ?? expected : base.y, channel = Data.view.channels[own], r = names.get(`${evidence}residual`);
    if (!accurate) return null;
    const limit = names.get(`${evidence}threshold`), passes = r === undefined || limit === undefined ? null : (await Replay.passing(r, 0, limit)).find((s) => s.stop > f.start && s.start < f.stop);
    const sick = Data.view.faults.filter((g) => g.component === c), counts = Float64Array.from({ length: n }, (_, i) => { const t = base.t + i * base.dt; return speed && Number.isFinite(speed[i]) && Number.isFinite(base.y[i]) && !sick.some((g) => t >= g.start - 0.5 && t < g.stop + 0.5) ? 1 : 0; });
    return { f, own, sensor, n, t: base.t, dt: base.dt, stride: base.stride, log: sensor ? base.y : applied ?? base.y, accurate, residual, threshold, speed, channel, same: r !== undefined && Data.view.channels[r].unit === channel.unit, rk: r === undefined ? 1 : Data.view.channels[r].k, runit: r === undefined ? "" : Data.view.channels[r].unit, r, passes, plant: sensor || !speed ? null : WhatIf.fit(base.y, speed, counts, base.dt), second: Boolean(second), v: names.get(`wheel.${c}.v`) };
  },

  // The mission with another fault: what the part gives, what the wheel does, and the residual.
  run(d, { mode, epsilon, sat, start }) {
    const eps = mode === "stuck" || mode === "no_signal" ? 1 : epsilon, spec = { start, stop: Math.max(d.f.stop, start + d.dt), epsilon: eps }, strong = WhatIf.strength(d.n, d.t, d.dt, spec), level = mode === "no_signal" || mode === "inefficient" ? 0 : sat;
    const noise = mode === "noisy" ? WhatIf.noise(d.n).map((v) => v * level) : null, saturation = noise ?? new Float64Array(d.n).fill(level), given = WhatIf.affected(d.accurate, strong, saturation);
    const speed = d.plant ? WhatIf.respond(d.accurate, given, d.plant, d.dt) : null, residual = d.same ? given.map((v, i) => v - d.accurate[i]) : speed;
    return { given, residual, speed, ratio: residual && d.threshold ? residual.map((v, i) => v / d.threshold[i]) : null, spec };
  },

  rows(d, w) {
    const k = d.channel.k, of = (y, name, role, scale = k, unit = d.channel.unit) => ({ c: d.own, op: "given", name, role, k: scale, unit, data: { y, t: d.t, dt: d.dt, stride: d.stride } });
    const rows = [{ key: "given", title: d.sensor ? "Measured" : "Applied opening", unit: d.channel.unit, traces: [of(d.accurate, d.sensor ? (d.second ? "second measurement" : "expected") : "command", "reference"), of(d.log, "log", "measured"), of(w.given, "what if", "replayed")] }];
    if (w.speed) { const c = Data.view.channels[d.v]; rows.push({ key: "speed", title: "Change of the wheel’s speed", unit: c.unit, traces: [of(w.speed, "what if", "replayed", c.k, c.unit)] }); }
    if (d.residual && w.residual) rows.push({ key: "residual", title: "Residual", unit: d.runit, threshold: d.threshold ? Data.view.channels.findIndex((c) => c.name === Data.view.channels[d.r].name.replace(/residual$/, "threshold")) : undefined, bandScale: d.rk, traces: [of(d.residual, "log", "measured", d.rk, d.runit), of(w.residual, "what if", "replayed", d.rk, d.runit)] });
    if (w.ratio && d.residual) rows.push({ key: "evidence", title: "Evidence: residual ÷ threshold, r.m.s. of 0.5 s", unit: "1", levels: [1], traces: [of(WhatIf.rms(d.residual.map((v, i) => v / d.threshold[i]), d.dt), "log", "measured", 1, "1"), of(WhatIf.rms(w.ratio, d.dt), "what if", "replayed", 1, "1")] });
    return rows;
  },

  // In a sentence: how large the residual is, as the evidence has it, and when it was first beyond its threshold.
  words(d, w) {
    if (!d.residual) return "No residual of this part was recorded in which the change could be seen.";
    if (!w.ratio) return `What a changed ${d.sensor ? "reading" : "opening"} does to the residual of this part (${d.runit || "no unit"}, drawn above) is not computed here: no model of the ${d.channel.name.startsWith("steer.") ? "axle" : "wheel"} was found in the readings around it.`;
    const size = (ratio, residual, { start, stop }) => {
      let sum = 0, n = 0, over = 0;
      for (let i = 0; i < d.n; i++) {
        const t = d.t + i * d.dt;
        if (t >= start && t < stop && Number.isFinite(ratio[i])) { sum += (d.rk * residual[i]) ** 2; n += 1; over += Math.abs(ratio[i]) > 1 ? 1 : 0; }
      }
      const share = 100 * over / (n || 1), part = over === n ? "all the time" : `in ${share < 1 ? "less than 1" : share > 99 ? "more than 99" : Now.number(Math.round(share))} % of the fault`;
      return { over, words: `${Now.number(Math.sqrt(sum / (n || 1)), 3)} ${d.runit} r.m.s.`, part };
    };
    // As the sentences of the replay have it: some samples on end.
    const beyond = Replay.stretches({ y: w.ratio, t: d.t, dt: d.dt, stride: d.stride }, (i) => Replay.over(Math.abs(w.ratio[i]), 1)).find((s) => s.stop > w.spec.start && s.start < w.spec.stop);
    const late = (s, onset, { over, part }) => { if (!s) return over ? `beyond its threshold ${part}, in single readings only` : "never beyond its threshold"; const ms = 1000 * (s.start - onset), is = `${Now.number(Math.abs(ms), 3)} ms`; return `beyond its threshold ${part}, first at ${Now.clock(s.start)}, ${Math.abs(ms) < 0.5 ? "the onset" : ms > 0 ? `${is} after the onset` : `${is} before the onset stated`}`; };
    const seen = d.f.detected, other = seen !== null && d.passes && Math.abs(seen - d.passes.start) > 2 * d.dt ? ` The fault was detected at ${Now.clock(seen)} by its probability, which weighs the readings together; the residual is one of them.` : "";
    const then = size(w.ratio, w.residual, w.spec), log = size(d.residual.map((v, i) => v / d.threshold[i]), d.residual, d.f);
    return `What if: residual ${then.words}, ${late(beyond, w.spec.start, then)}${beyond && d.stride > 1 ? `, to ${Figure.duration(d.dt)}` : ""}. Log: ${log.words}, ${late(d.passes, d.f.start, log)}.${other}${d.plant ? ` Wheel model found here: K = ${Now.number(d.plant.K, 3)} m/s, τ = ${Now.number(d.plant.tau, 2)} s, dead zone ${Now.number(100 * d.plant.dead)} %; it explains ${Now.number(100 * d.plant.explains, 3)} % of the healthy speed.` : ""}`;
  },
};

// The sliders below a fault's plots.
class WhatIfPanel {
  constructor(one) {
    Object.assign(this, { one, figure: new Figure(one("#whatif-figure"), null, null) });
    one("#whatif").addEventListener("input", () => this.change());
    one("#whatif-reset").addEventListener("click", () => this.open(this.f));
  }

  async open(f) {
    if (this.f !== f) this.figure.release();
    this.f = f;
    const { one } = this, row = (await Data.intervals())[f.id], d = this.data = await WhatIf.load(f, row), none = !d;
    if (this.f !== f) return;
    for (const e of this.one("#whatif").querySelectorAll("select, input, button")) e.disabled = none;
    one("#whatif-figure").hidden = none;
    if (none) { one("#whatif-words").textContent = "The log has no channel of this part that could be changed."; return; }
    const { k, unit } = d.channel, most = d.accurate.reduce((m, v) => (Math.abs(v) > m ? Math.abs(v) : m), 1e-6) * k, known = ["stuck", "no_signal", "inefficient", "noisy"].includes(f.mode);
    const set = (id, low, high, value) => Object.assign(one(id), { min: low, max: high, step: "any", value });
    one("#whatif-mode").value = known ? f.mode : "inefficient";
    set("#whatif-epsilon", 0, 1, row.epsilon?.value ?? 0.5);
    const spread = f.mode === "noisy" ? row.sat?.rms : row.sat?.mean;
    set("#whatif-sat", -most, most, (spread ?? 0) * k);
    set("#whatif-onset", Math.max(d.t, f.start - 2), f.stop, f.start);
    this.unit = unit;
    return this.change();
  }

  change() {
    const { one, data: d, f } = this, value = (id) => +one(id).value, mode = one("#whatif-mode").value, fixed = mode === "stuck" || mode === "no_signal";
    if (!d) return undefined;
    one("#whatif-epsilon").disabled = fixed;
    one("#whatif-sat").disabled = mode === "no_signal" || mode === "inefficient";
    const say = (id, words) => { one(`${id} + output`).textContent = words; one(id).setAttribute("aria-valuetext", words); };
    say("#whatif-epsilon", fixed ? "1" : Now.number(value("#whatif-epsilon"), 3));
    say("#whatif-sat", one("#whatif-sat").disabled ? "0" : `${Now.number(value("#whatif-sat"), 3)} ${this.unit}`);
    say("#whatif-onset", Now.clock(value("#whatif-onset")));
    const w = WhatIf.run(d, { mode, epsilon: value("#whatif-epsilon"), sat: value("#whatif-sat") / d.channel.k, start: value("#whatif-onset") });
    one("#whatif-words").textContent = WhatIf.words(d, w);
    const room = Math.max(1, (f.stop - f.start) / 2);
    return this.figure.draw(WhatIf.rows(d, w), [{ ...f, main: true }], [f.start - room - 1, f.stop + room]);
  }
}
