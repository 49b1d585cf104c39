"use strict";
// Files and text that leave the page: CSV, pictures, JSON, the clipboard.
const Export = (() => {
  const faults = Object.fromEntries(Data.view.faults.map((f) => [f.id, f.title]));
  const safe = (name) => name.replace(/[^\w.-]+/g, "_").slice(0, 120);

  function save(name, type, content) {
    const url = URL.createObjectURL(new Blob([content], { type })), a = document.createElement("a");
    a.href = url;
    a.download = safe(name);
    a.click();
    setTimeout(() => URL.revokeObjectURL(url), 60_000); // a browser on a busy machine fetches it late
  }

  async function image(figure, name, form) {
    const times = figure.range.map((v) => Now.clock(v)).join(" to "), fault = name in faults ? `${name} ${faults[name]}` : name;
    const address = await figure.image(form, `${Data.view.name} · ${fault} · ${times}`), data = address.slice(address.indexOf(",") + 1);
    if (form === "svg") save(`${name}.svg`, "image/svg+xml", decodeURIComponent(data));
    else save(`${name}.png`, "image/png", Data.fromBase64(data));
  }

  async function json(id) {
    const faults = await Data.intervals();
    save(`${id}.json`, "application/json", JSON.stringify(faults[id], null, 2) + "\n");
  }

  // All faults, a line for each.
  async function table() {
    const columns = {
      id: (f) => f.id, component: (f) => f.component, side: (f) => f.side, mode: (f) => f.mode, "start [s]": (f) => f.start_s, "stop [s]": (f) => f.stop_s,
      epsilon: (f) => f.epsilon?.value, "epsilon low": (f) => f.epsilon?.low, "epsilon high": (f) => f.epsilon?.high,
      saturation: (f) => f.sat?.mean, "saturation unit": (f) => f.sat?.unit, probability: (f) => f.probability, severity: (f) => f.severity, advice: (f) => f.advice,
    };
    const cell = (v) => (typeof v === "number" ? String(v) : v == null ? "" : Data.guard(String(v))), list = Object.values(await Data.intervals());
    const lines = [Object.keys(columns).map(Data.guard), ...list.map((f) => Object.values(columns).map((read) => cell(read(f))))];
    save("faults.csv", "text/csv", lines.map((l) => l.join(",")).join("\n") + "\n");
  }

  // What the article of a fault says, as lines of text; spaces that keep a line together are plain ones elsewhere.
  async function copy(article, button) {
    const lines = `${Data.view.name}\n${article.dataset.text}\n` + [...article.querySelectorAll("li, .advice, p.how")].map((e) => `- ${e.textContent.trim()}`).join("\n") + `\n${location.hash}\n`, text = lines.replaceAll("\u00a0", " ");
    try { await navigator.clipboard.writeText(text); } catch {
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    button.dataset.copied = text;
    const words = "Copy as text";
    button.textContent = "Copied";
    setTimeout(() => { button.textContent = words; }, 1500);
  }

  return { save, image, json, table, copy };
})();
