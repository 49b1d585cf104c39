"use strict";
// The page's time on timeline, driven path and picture of the machine; made when a time is first asked for.
class Pictures {
  constructor(root) {
    Object.assign(this, { root, last: null, machines: [...root.querySelectorAll("svg.machine")], maps: [...root.querySelectorAll("svg.map")] });
    this.lines = [...root.querySelectorAll("#timeline .track")].map((track) => {
      const line = document.createElement("i");
      line.className = "now";
      track.append(line);
      return line;
    });
    this.names = new Map(Data.view.channels.map((c, i) => [c.name, i]));
    for (const map of this.maps) map.append(map.here = Pictures.svg("circle", { r: 6, class: "here" }));
    this.wheels = this.machines.flatMap((m) => [...m.querySelectorAll("[data-c]")]).map((g) => this.wheel(g));
  }

  remove() { for (const e of [...this.lines, ...this.maps.map((m) => m.here), ...this.wheels.map((w) => w.live)]) e.remove(); }

  static svg(name, attributes) {
    const e = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v);
    return e;
  }

  wheel(g) {
    const c = g.dataset.c, rect = g.querySelector("rect"), [x, y, w, h] = ["x", "y", "width", "height"].map((k) => +rect.getAttribute(k)), inner = x + w / 2 < 186 ? 1 : -1, steer = rect.matches(".axle");
    const kind = steer ? "steer" : "wheel", of = (name) => this.names.get(`${kind}.${c}.${name}`), live = Pictures.svg("g", { class: "live", "aria-hidden": "true" });
    const bars = [[of(steer ? "phi" : "v"), "v"], [of("u"), "u"]].filter(([k]) => k !== undefined).map(([channel, name], i) => {
      const bar = Pictures.svg("rect", { x: inner > 0 ? x + w + 3 + 7 * i : x - 8 - 7 * i, width: 5, class: name });
      if (!steer) live.append(bar);
      return { channel, name, bar };
    });
    const words = Pictures.svg("text", { x: x + w / 2, y: y + h + (steer ? 11 : 12) });
    live.append(words);
    g.append(live);
    const says = g.closest("#stage") && !steer ? Pictures.svg("text", { x: x + w / 2, y: y + h / 2 + 8, class: "says" }) : null;
    if (says) live.append(says);
    return { c, live, bars, words, says, rect, middle: y + h / 2, half: h / 2, steer, usual: rect.getAttribute("class") };
  }

  // Largest size of a channel over the mission: what a full bar means.
  async full(channel) {
    this.sizes ??= new Map();
    if (!this.sizes.has(channel)) {
      const { y } = await Data.curve(channel, Data.view.t0, Data.view.duration, 300);
      this.sizes.set(channel, y.reduce((m, v) => (Math.abs(v) > m ? Math.abs(v) : m), 1e-9));
    }
    return this.sizes.get(channel);
  }

  // The worst fault of a part at a time.
  static fault(c, t) { return Data.view.faults.find((f) => f.component === c && f.start <= t && t < f.stop); }

  // Its mode, else what the part's lane says.
  state(c, t) {
    const fault = Pictures.fault(c, t);
    if (fault) return fault.mode;
    const at = 2000 * t / Data.view.duration;
    for (const path of this.root.querySelectorAll(`.lane[data-c="${CSS.escape(c)}"] path.ln`)) {
      for (const [, a, b] of path.getAttribute("d").matchAll(/M([\d.]+) 5H([\d.]+)/g)) if (+a <= at && at < +b) return path.getAttribute("class").split(" ")[1];
    }
    return "not_assessed";
  }

  // Place on a path: its points stand at even times from the first of each stretch.
  static place(map, t) {
    const track = map.querySelector(".track"), [start, step, ...runs] = (track?.dataset.times ?? "").split(" ").map(Number), k = Math.round((t - start) / step);
    track.points ??= track.getAttribute("d").split("M").slice(1).map((part) => part.split("L").map((p) => p.split(",").map(Number)));
    return track.points.map((points, i) => points[k - runs[i]]).find(Boolean);
  }

  async show() {
    const { t } = Now, off = t === null, job = this.job = (this.job || 0) + 1;
    for (const line of this.lines) Object.assign(line, { hidden: off }).style.left = `${100 * t / Data.view.duration}%`;
    for (const map of this.maps) {
      const place = off ? null : Pictures.place(map, t);
      map.here.setAttribute("visibility", place ? "visible" : "hidden");
      if (place) { map.here.setAttribute("cx", place[0]); map.here.setAttribute("cy", place[1]); }
    }
    for (const w of this.wheels) {
      w.live.setAttribute("visibility", off ? "hidden" : "visible");
      const state = off ? "" : this.state(w.c, t);
      w.rect.setAttribute("class", off ? w.usual : w.usual.replace(/ \w+$/, ` ${state}`));
      if (w.says) w.says.textContent = off ? "" : Pictures.fault(w.c, t)?.words ?? state.replaceAll("_", " ");
      const texts = [];
      for (const { channel, name, bar } of off ? [] : w.bars) {
        const { k, unit } = Data.view.channels[channel], [low, high] = await Data.at(channel, t), value = (low + high) / 2, part = Math.max(-1, Math.min(1, value / await this.full(channel))) || 0;
        if (job !== this.job) return;
        bar.setAttribute("y", w.middle - Math.max(0, part) * w.half);
        bar.setAttribute("height", Math.abs(part) * w.half);
        if (!w.steer || name === "v") texts.push(`${name === "u" ? "u " : ""}${Now.number(+(value * k).toPrecision(2))}${unit === "1" ? "" : unit === "°" ? unit : ` ${unit.replace("% of opening", "%")}`}`);
      }
      w.words.textContent = texts.join(" · ");
    }
  }
}
