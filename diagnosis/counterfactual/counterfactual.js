"use strict";
// Speed and command of a wheel as recorded and under each law, around one fault or through the mission.
(() => {
  const COLOURS = ["accent", "stuck-line", "teal", "alt", "inefficient-line", "no_signal-line", "noisy-line", "peer"];
  const DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "solid", "dash", "dot"];
  const byId = (id) => document.getElementById(id);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  async function inflated(id) {
    const raw = atob(byId(id).textContent), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return new Response(new Response(bytes).body.pipeThrough(new DecompressionStream("deflate"))).text();
  }

  let data = null, shown = null;

  function style(k) { return { color: colour(COLOURS[k % COLOURS.length]) || colour("muted"), dash: DASHES[k % DASHES.length], width: 1.6 }; }

  function traces(view) {
    const x = view.v_ref.map((_, i) => view.start + (i + 0.5) * view.step), list = [];
    const add = (y, name, line, axis) => list.push({ type: "scatter", mode: "lines", x, y, name, line, yaxis: axis, connectgaps: false, hovertemplate: `%{y:.4f}<extra>${name}</extra>` });
    add(view.v_ref, "commanded", { color: colour("text"), dash: "dot", width: 1.4 }, "y");
    add(view.v[0], "recorded", { color: colour("muted"), width: 2.6 }, "y");
    add(view.read, "recorded reading", { color: colour("peer"), width: 1 }, "y");
    add(view.u[0], "recorded", { color: colour("muted"), width: 2.6 }, "y2");
    data.laws.forEach((law, k) => {
      if (!shown.has(law)) return;
      add(view.v[k + 1], law, style(k), "y");
      add(view.u[k + 1], law, style(k), "y2");
    });
    return list;
  }

  function layout(view) {
    const axis = { gridcolor: colour("line2"), zerolinecolor: colour("line"), linecolor: colour("line") };
    const shapes = view.fault ? [{ type: "rect", xref: "x", yref: "paper", x0: view.fault[0], x1: view.fault[1], y0: 0, y1: 1, fillcolor: colour("stuck"), opacity: 0.1, line: { width: 0 } }] : [];
    return {
      height: 520, margin: { l: 62, r: 14, t: 10, b: 42 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", showlegend: false,
      font: { color: colour("text"), size: 12 }, hovermode: "x unified", hoverlabel: { bgcolor: colour("surface"), font: { color: colour("text") } }, shapes,
      xaxis: { ...axis, title: { text: "mission time (s)" }, anchor: "y2" },
      yaxis: { ...axis, domain: [0.44, 1], title: { text: "speed (m/s)" } },
      yaxis2: { ...axis, domain: [0, 0.4], title: { text: "valve command (1)" } },
    };
  }

  function draw() {
    const view = data.views[byId("view").value];
    Plotly.react(byId("figure"), traces(view), layout(view), { responsive: true, displaylogo: false });
    byId("drawn").textContent = (view.samples > 1 ? `Each point is the mean of ${view.samples} samples. ` : "Every sample is drawn. ") + (view.fault ? "Shaded: the fault." : "");
  }

  function choices() {
    const box = byId("choices");
    data.laws.forEach((law, k) => {
      const button = document.createElement("button"), line = document.createElement("i"), s = style(k);
      button.className = "btn";
      button.setAttribute("aria-pressed", shown.has(law));
      line.style.borderTopColor = s.color;
      line.style.borderTopStyle = s.dash === "solid" ? "solid" : s.dash === "dot" ? "dotted" : "dashed";
      button.append(line, law);
      button.addEventListener("click", () => {
        if (!shown.delete(law)) shown.add(law);
        button.setAttribute("aria-pressed", shown.has(law));
        draw();
      });
      box.append(button);
    });
  }

  async function start() {
    data = JSON.parse(await inflated("data"));
    shown = new Set(data.laws.filter((law) => law !== "printed").slice(0, 4));
    const script = document.createElement("script");
    script.textContent = await inflated("plotlyjs");
    document.head.append(script);
    choices();
    byId("view").addEventListener("change", draw);
    document.documentElement.addEventListener("theme", draw);
    draw();
  }
  start();
})();
