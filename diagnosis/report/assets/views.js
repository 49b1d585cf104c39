"use strict";
// Chosen signals against each other, and their spectra, over the time in view.
const Views = {
  MOST: 20000,

  // Fast Fourier transform of a power of two of values, in place.
  fft(re, im) {
    const n = re.length;
    for (let i = 1, j = 0; i < n; i++) {
      let bit = n >> 1;
      for (; j & bit; bit >>= 1) j ^= bit;
      j ^= bit;
      if (i < j) { [re[i], re[j]] = [re[j], re[i]]; [im[i], im[j]] = [im[j], im[i]]; }
    }
    for (let size = 2; size <= n; size *= 2) {
      for (let k = 0; k < size / 2; k++) {
        const c = Math.cos(-2 * Math.PI * k / size), s = Math.sin(-2 * Math.PI * k / size);
        for (let i = k; i < n; i += size) {
          const j = i + size / 2, a = re[j] * c - im[j] * s, b = re[j] * s + im[j] * c;
          re[j] = re[i] - a; im[j] = im[i] - b; re[i] += a; im[i] += b;
        }
      }
    }
  },

  // Power density by Welch: segments of a power of two that overlap by half, less their means, under a Hann window.
  welch(y, dt) {
    let n = 64;
    while (2 * n <= Math.min(4096, y.length / 4)) n *= 2;
    const window = Float64Array.from({ length: n }, (_, i) => 0.5 - 0.5 * Math.cos(2 * Math.PI * i / n)), power = window.reduce((a, w) => a + w * w, 0), p = new Float64Array(n / 2 + 1);
    let count = 0;
    for (let from = 0; from + n <= y.length; from += n / 2) {
      const part = y.slice(from, from + n), mean = part.reduce((a, b) => a + b, 0) / n;
      if (!Number.isFinite(mean)) continue;
      const re = Float64Array.from(part, (v, i) => (v - mean) * window[i]), im = new Float64Array(n);
      Views.fft(re, im);
      for (let k = 0; k <= n / 2; k++) p[k] += (re[k] * re[k] + im[k] * im[k]) * (k && k < n / 2 ? 2 : 1) * dt / power;
      count += 1;
    }
    return { f: Array.from(p, (_, k) => k / (n * dt)), p: Array.from(p, (v) => (count ? v / count : NaN)), segments: count, length: n };
  },

  values: (t, range) => (t.op ? Figure.computed(t, ...range) : Data.samples(t.c, ...range).then((d) => ({ ...d, y: d.y.map((v) => v * t.k) }))),

  async draw(element, kind, rows, range) {
    const Plotly = await Data.plotly(), [text, muted, line, grid] = ["text", "muted", "line", "line2"].map(Figure.colour), traces = [], notes = [], named = (t) => `${t.name.replace(/ →$/, "")}${t.unit === "1" ? "" : ` (${t.unit})`}`;
    const used = kind === "xy" ? rows.filter((r) => r.traces.length > 1) : rows, one = used.length, axes = {};
    for (const [i, row] of used.entries()) {
      const all = await Promise.all(row.traces.map((t) => Views.values(t, range))), n = i ? i + 1 : "", top = 1 - i / one, coarse = Math.max(...all.map((d) => d.stride)), parts = kind === "xy" ? all.slice(1) : all;
      let said = "";
      parts.forEach((d, j) => {
        const t = row.traces[kind === "xy" ? j + 1 : j], s = Figure.style(`free-${j % 6}`), look = { name: Figure.text(t.name), xaxis: `x${n}`, yaxis: `y${n}`, hoverinfo: "skip" };
        if (kind === "xy") {
          const a = all[0], every = Math.max(1, Math.ceil(a.y.length / Views.MOST)), x = [], y = [];
          for (let k = 0; k < a.y.length; k += every) { x.push(a.y[k]); y.push(d.y[Math.min(d.y.length - 1, Math.max(0, Math.round((a.t + k * a.dt - d.t) / d.dt)))]); }
          said = every > 1 ? `1 of ${every} samples` : "every sample";
          traces.push({ ...look, type: "scatter", mode: "markers", marker: { size: 3, color: Figure.colour(s.colour), opacity: 0.6 }, x, y });
        } else {
          const { f, p, segments, length } = Views.welch(d.y, d.dt);
          said = `Welch, ${segments} segments of ${length} samples`;
          traces.push({ ...look, type: "scatter", mode: "lines", line: { color: Figure.colour(s.colour), width: 1.4, dash: s.dash || "solid" }, x: f.slice(1), y: p.slice(1) });
        }
      });
      if (coarse > 1) said += `, middles of ${coarse} samples`;
      const log = kind === "xy" ? {} : { type: "log" }, shared = { gridcolor: grid, linecolor: line, zerolinecolor: line, fixedrange: true, ...log };
      axes[`xaxis${n}`] = { ...shared, anchor: `y${n}`, title: { text: Figure.text(kind === "xy" ? named(row.traces[0]) : "frequency (Hz)"), font: { size: 12, color: muted }, standoff: 3 } };
      axes[`yaxis${n}`] = { ...shared, anchor: `x${n}`, domain: [top - 1 / one + 58 / (300 * one), top - 34 / (300 * one)], exponentformat: "power" };
      const names = parts.map((_, j) => { const s = Figure.style(`free-${j % 6}`); return `<span style="color:${Figure.colour(s.colour)}">${s.sign}</span> ${Figure.text(named(row.traces[kind === "xy" ? j + 1 : j]))}`; });
      notes.push({ xref: "paper", yref: "paper", x: 0, y: top - 30 / (300 * one), xanchor: "left", yanchor: "bottom", showarrow: false, align: "left", font: { size: 12 }, text: `<b>${Figure.text(row.title)}</b>${kind === "xy" ? "" : " power density (unit²/Hz)"}   ${names.join("   ")}   <span style="color:${muted}"><i>${said}</i></span>` });
    }
    const layout = { ...axes, annotations: notes, height: Math.max(80, 300 * one), showlegend: false, hovermode: false, dragmode: false, margin: { l: 64, r: 14, t: 0, b: 10 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: text, size: 12, family: getComputedStyle(document.body).fontFamily } };
    if (!one) notes.push({ xref: "paper", yref: "paper", x: 0, y: 0.5, xanchor: "left", showarrow: false, text: "Put two signals into a plot: the first is drawn across, the others upwards." });
    await Plotly.react(element, traces, layout, { responsive: true, displayModeBar: false });
    element.dataset.view = kind;
  },
};
