"use strict";
// Time series of the report: decoded from the page's own text when first needed, thinned per pixel for drawing.
const Data = (() => {
  const view = JSON.parse(document.getElementById("view").textContent);
  const BLOCK = 64, HELD = 32e6;
  const decoded = new Map();
  let held = 0;

  function fromBase64(text) {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return bytes;
  }

  async function inflated(id, once) {
    const element = document.getElementById(id);
    const stream = new Response(fromBase64(element.textContent)).body.pipeThrough(new DecompressionStream("deflate"));
    if (once) element.textContent = "";
    return new Response(stream);
  }

  // Byte planes → zigzag → running sum; a level of 0 means no sample.
  function levels(bytes, from, n, planes) {
    const out = new Int32Array(n);
    let sum = 0;
    for (let i = 0; i < n; i++) {
      let z = bytes[from + i];
      if (planes > 1) z |= bytes[from + n + i] << 8;
      if (planes > 2) z |= bytes[from + 2 * n + i] << 16;
      if (planes > 3) z |= bytes[from + 3 * n + i] << 24;
      sum = (sum + ((z >>> 1) ^ -(z & 1))) | 0;
      out[i] = sum;
    }
    return out;
  }

  function extremes(q) {
    const m = Math.ceil(q.length / BLOCK), low = new Int32Array(m), high = new Int32Array(m);
    for (let b = 0; b < m; b++) {
      let lo = 0x7fffffff, hi = 0;
      for (let i = b * BLOCK, e = Math.min(q.length, i + BLOCK); i < e; i++) {
        const v = q[i];
        if (v) { if (v < lo) lo = v; if (v > hi) hi = v; }
      }
      low[b] = hi ? lo : 0;
      high[b] = hi;
    }
    return { low, high };
  }

  const bytes = ([, count, stride]) => 4 * count * (stride > 1 ? 2 : 1);

  // A segment's levels. What was not drawn for longest is let go: its text stays in the page.
  function segment(c, j) {
    const shape = view.channels[c].segments[j], [start, count, stride, planes, block] = shape;
    let entry = decoded.get(block);
    if (entry) decoded.delete(block);
    else {
      held += bytes(shape);
      const levelled = inflated(`b${block}`).then((r) => r.arrayBuffer()).then((buffer) => {
        const raw = new Uint8Array(buffer), low = levels(raw, 0, count, planes);
        if (stride > 1) return { start, count, stride, low, high: levels(raw, count * planes, count, planes) };
        return { start, count, stride, q: low, ...extremes(low) };
      });
      entry = { shape, levelled };
    }
    decoded.set(block, entry);
    for (const [key, { shape: oldest }] of decoded) {
      if (held <= HELD || key === block) break;
      decoded.delete(key);
      held -= bytes(oldest);
    }
    return entry.levelled;
  }

  // The segment with every sample that covers [a, b), else the extremes of the whole mission.
  function covering(c, a, b) {
    const all = view.channels[c].segments;
    const full = all.findIndex(([start, count, stride]) => stride === 1 && start <= a && start + count >= b);
    return full >= 0 ? full : 0;
  }

  // Whether every sample of a channel is stored at a time, or somewhere between two.
  function full(c, t0, t1 = t0) {
    const a = (t0 - view.t0) / view.dt, b = (t1 - view.t0) / view.dt;
    return view.channels[c].segments.some(([start, count, stride]) => stride === 1 && start <= b && start + count > a);
  }

  const range = (t0, t1) => [
    Math.max(0, Math.floor((t0 - view.t0) / view.dt) - 1),
    Math.min(view.n, Math.ceil((t1 - view.t0) / view.dt) + 2),
  ];

  // Smallest and largest level among samples [a, b) and their places, by whole blocks where possible.
  function scan(s, a, b) {
    let lo = 0x7fffffff, hi = 0, at = a, top = a, gap = false;
    const samples = (i, e) => {
      for (; i < e; i++) {
        const v = s.q[i];
        if (!v) gap = true;
        else { if (v < lo) { lo = v; at = i; } if (v > hi) { hi = v; top = i; } }
      }
    };
    const first = Math.ceil(a / BLOCK), last = Math.floor(b / BLOCK);
    if (last - first < 2) samples(a, b);
    else {
      samples(a, first * BLOCK);
      let lowest = -1, highest = -1;
      for (let k = first; k < last; k++) {
        if (!s.high[k]) { gap = true; continue; }
        if (s.low[k] < lo) { lo = s.low[k]; lowest = k; }
        if (s.high[k] > hi) { hi = s.high[k]; highest = k; }
      }
      if (lowest >= 0) at = s.q.indexOf(lo, lowest * BLOCK);
      if (highest >= 0) top = s.q.indexOf(hi, highest * BLOCK);
      samples(last * BLOCK, b);
    }
    return { lo, hi, at, top, gap };
  }

  // Curve over [t0, t1] for about `pixels` pixels: every sample where few enough, else the extremes per pixel.
  async function curve(c, t0, t1, pixels) {
    const { step, base } = view.channels[c], [a, b] = range(t0, t1);
    const x = [], y = [], s = await segment(c, covering(c, a, b));
    const time = (i) => view.t0 + i * view.dt, value = (v) => (v ? (base + v) * step : NaN);
    const per = s.stride, i0 = Math.max(0, Math.floor((a - s.start) / per));
    const i1 = Math.min(s.count, Math.ceil((b - s.start) / per)), n = i1 - i0;
    const exact = per === 1 && n <= 2 * pixels;
    if (exact) {
      for (let i = i0; i < i1; i++) { x.push(time(s.start + i)); y.push(value(s.q[i])); }
      return { x, y, exact, stride: 1 };
    }
    const buckets = Math.min(n, pixels), width = n / buckets;
    let before = 0;
    for (let k = 0; k < buckets; k++) {
      const p = i0 + Math.floor(k * width), e = i0 + Math.floor((k + 1) * width);
      if (per === 1) {
        const { lo, hi, at, top, gap } = scan(s, p, e);
        if (!hi) { x.push(time(s.start + p)); y.push(NaN); continue; }
        if (lo === hi) { x.push(time(s.start + at)); y.push(value(lo)); }
        else if (at <= top) { x.push(time(s.start + at), time(s.start + top)); y.push(value(lo), value(hi)); }
        else { x.push(time(s.start + top), time(s.start + at)); y.push(value(hi), value(lo)); }
        if (gap) { x.push(time(s.start + e - 1)); y.push(NaN); }
      } else {
        let lo = 0x7fffffff, hi = 0;
        for (let i = p; i < e; i++) if (s.high[i]) { lo = Math.min(lo, s.low[i]); hi = Math.max(hi, s.high[i]); }
        // In which order they came is not known: the one nearer to what was drawn before stands first.
        x.push(time(s.start + p * per));
        if (!hi) { y.push(NaN); before = 0; continue; }
        const [u, w] = before && Math.abs(hi - before) < Math.abs(lo - before) ? [hi, lo] : [lo, hi];
        y.push(value(u));
        if (u !== w) { x.push(time(s.start + (p + e) / 2 * per)); y.push(value(w)); }
        before = w;
      }
    }
    return { x, y, exact, stride: Math.max(per, Math.round(width * per)), stored: per };
  }

  // Parts of the mission one after another, and whether every sample of a channel is stored in them.
  function parts(c) {
    const time = (i) => view.t0 + i * view.dt, out = [];
    let at = 0;
    for (const [start, count, stride] of [...view.channels[c].segments].sort(([a], [b]) => a - b)) {
      if (stride > 1) continue;
      if (start > at) out.push({ from: time(at), to: time(start), every: false });
      out.push({ from: time(Math.max(at, start)), to: time(start + count - 1), every: true });
      at = start + count;
    }
    if (at < view.n) out.push({ from: time(at), to: time(view.n - 1), every: false });
    return out;
  }

  // Every value of a channel over [t0, t1], or of each block the middle of its extremes, the one of the larger size (`of` 1), or the
  // least size that the whole block has (−1).
  async function samples(c, t0, t1, of = 0) {
    const { step, base } = view.channels[c], [a, b] = range(t0, t1), s = await segment(c, covering(c, a, b)), value = (v) => (v ? (base + v) * step : NaN);
    const i0 = Math.max(0, Math.floor((a - s.start) / s.stride)), i1 = Math.min(s.count, Math.ceil((b - s.start) / s.stride)), y = new Float64Array(Math.max(0, i1 - i0));
    for (let i = i0; i < i1; i++) y[i - i0] = s.stride === 1 ? value(s.q[i]) : block(value(s.low[i]), value(s.high[i]), of);
    return { y, t: view.t0 + (s.start + i0 * s.stride) * view.dt, dt: s.stride * view.dt, stride: s.stride };
  }

  function block(low, high, of) {
    if (!of) return (low + high) / 2;
    if (of < 0 && low < 0 && high > 0) return 0;
    return Math.abs(low) > Math.abs(high) === of > 0 ? low : high;
  }

  // Smallest and largest value of a channel at a time: the same where every sample is stored.
  async function at(c, t) {
    const { step, base } = view.channels[c], i = Math.round((t - view.t0) / view.dt), s = await segment(c, covering(c, i, i + 1)), k = Math.floor((i - s.start) / s.stride);
    return [s.q || s.low, s.q || s.high].map((q) => (q[k] ? (base + q[k]) * step : NaN));
  }

  // Values at even times as a curve: every one where few enough, else the extremes per pixel.
  function thinned({ y: all, t, dt, stride }, pixels) {
    const x = [], y = [], exact = all.length <= 2 * pixels, width = exact ? 1 : all.length / pixels;
    for (let k = 0; k * width < all.length - 0.5; k++) {
      let lo = -1, hi = -1;
      for (let i = Math.floor(k * width); i < Math.min(all.length, Math.floor((k + 1) * width)); i++) {
        if (!(all[i] >= all[lo])) lo = Number.isFinite(all[i]) ? i : lo;
        if (!(all[i] <= all[hi])) hi = Number.isFinite(all[i]) ? i : hi;
      }
      for (const i of lo < 0 ? [-1] : lo === hi ? [lo] : [Math.min(lo, hi), Math.max(lo, hi)]) { x.push(t + dt * (i < 0 ? Math.floor(k * width) : i)); y.push(i < 0 ? NaN : all[i]); }
    }
    return { x, y, exact: exact && stride === 1, stride: Math.max(stride, Math.round(width * stride)), stored: stride };
  }

  // Text as a cell that no spreadsheet takes for a formula.
  const guard = (s) => `"${(/^[=+\-@\t\r]/.test(s) ? "'" : "") + s.replaceAll('"', '""')}"`;

  const ROWS = 200_000;

  // Values of some channels over [t0, t1] as CSV text: every sample where any channel has it, else extremes of blocks.
  async function csv(columns, t0, t1) {
    const [a, b] = range(t0, t1), parts = await Promise.all(columns.map(({ c }) => segment(c, covering(c, a, b))));
    const every = parts.some((s) => s.stride === 1) && (b - a <= ROWS || parts.every((s) => s.stride === 1));
    const stride = every ? 1 : Math.max(...parts.map((s) => s.stride)), two = parts.map((s) => stride > 1 || s.stride > 1), lines = [];
    const heads = columns.flatMap(({ c, unit }, j) => {
      const name = `${view.channels[c].name} [${unit}]`;
      return two[j] ? [`${name} min of ${Math.max(stride, parts[j].stride)}`, `${name} max of ${Math.max(stride, parts[j].stride)}`] : [name];
    });
    lines.push(["t [s]", ...heads].map(guard).join(","));
    const cell = (v, c, k) => (v ? ((view.channels[c].base + v) * view.channels[c].step * k).toPrecision(7) : "");
    const digits = Math.max(3, Math.ceil(-Math.log10(view.dt)) + 1), half = view.dt / 2;
    for (let i = Math.floor(a / stride) * stride; i < b; i += stride) {
      const t = view.t0 + i * view.dt;
      if (t + (stride - 1) * view.dt < t0 - half || t > t1 + half) continue;
      const row = [t.toFixed(digits)], first = lines.length === 1;
      parts.forEach((s, j) => {
        const { c, k } = columns[j];
        if (!two[j]) { row.push(cell(s.q[i - s.start], c, k)); return; }
        let lo = 0, hi = 0;
        if (s.stride === 1) {
          const r = scan(s, Math.max(0, i - s.start), Math.min(s.count, i - s.start + stride));
          if (r.hi) { lo = r.lo; hi = r.hi; }
        } else if (first || (i - s.start) % s.stride === 0) {
          const p = Math.floor((i - s.start) / s.stride), e = Math.ceil((i - s.start + stride) / s.stride);
          for (let q = p; q < Math.min(e, s.count); q++) if (s.high[q]) { lo = lo ? Math.min(lo, s.low[q]) : s.low[q]; hi = Math.max(hi, s.high[q]); }
        }
        const [p, q] = k < 0 ? [hi, lo] : [lo, hi];
        row.push(cell(p, c, k), cell(q, c, k));
      });
      lines.push(row.join(","));
    }
    return lines.join("\n") + "\n";
  }

  // Scripts that are expanded from the page's own text, plotly.js among them; their hashes stand in the page's policy.
  const expanded = (id) => inflated(id, true).then((r) => r.text()).then((source) => {
    const script = document.createElement("script");
    script.textContent = source;
    document.head.append(script);
    script.remove();
  });
  let loading = null, more = null;
  const later = () => (more ??= expanded("later"));
  function plotly() {
    loading ??= Promise.all([expanded("plotlyjs"), later()]).then(() => {
      if (!window.Plotly) throw new Error("plotly.js did not start");
      return window.Plotly;
    });
    return loading;
  }

  // Every fault as in report.json, by its name.
  let reading = null;
  function intervals() {
    reading ??= inflated("intervals", true).then((r) => r.json());
    return reading;
  }

  return { view, full, parts, curve, samples, at, thinned, csv, plotly, later, expanded, intervals, guard, fromBase64 };
})();

// One time for the whole page, and two markers.
const Now = {
  t: null, a: null, b: null, asked: false,
  set(t, more) {
    const { t0, dt, n } = Data.view;
    if (!n) return; // without time series there is no time to show
    const sample = (v) => (v === null ? null : t0 + dt * Math.min(n - 1, Math.max(0, Math.round((v - t0) / dt))));
    Object.assign(this, more, { t: sample(t) });
    Object.assign(this, { a: sample(this.a), b: sample(this.b) });
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; document.documentElement.dispatchEvent(new Event("now")); });
  },
  leave() { if (this.t !== null && this.a === null && !this.held) this.set(null); },
  // Numbers and times as all of the page has them: `labels.number`, `labels.clock` and `labels.span`, which round a half to the even digit.
  number: (v, digits = 4) => (Number.isFinite(v) ? `${+v.toPrecision(digits)}`.replaceAll("-", "−") : "–"),
  clock(seconds, digits = 3) {
    const exact = Math.abs(seconds) * 10 ** digits, ticks = exact % 1 === 0.5 ? 2 * Math.round(exact / 2) : Math.round(exact), whole = Math.floor(ticks / 10 ** digits);
    const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60], two = (n) => String(n).padStart(2, "0"), rest = digits ? `.${String(ticks % 10 ** digits).padStart(digits, "0")}` : "";
    return `${seconds < 0 && ticks ? "−" : ""}${h ? `${h}:${two(m)}` : m}:${two(s)}${rest}`;
  },
  seconds: (t) => t.toFixed(3), // as sentences and axes count a mission's time
  span(seconds) {
    const v = +seconds.toFixed(6), [x, digits, unit] = v < 1 ? [1e3 * v, 0, "ms"] : v < 120 ? [v, 1, "s"] : v < 7200 ? [v / 60, 1, "min"] : [v / 3600, 1, "h"];
    const up = x.toFixed(digits), half = /^50*$/.test(x.toFixed(60).split(".")[1].slice(digits));
    return `${half && +up.at(-1) % 2 ? (x - 0.25 / 10 ** digits).toFixed(digits) : up} ${unit}`;
  },
};

// All else that the page does; where the browser cannot expand it, the page is as without scripts.
Data.expanded("main").catch(() => document.documentElement.classList.remove("js"));
