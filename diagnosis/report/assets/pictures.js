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

  // Two bars within a wheel, speed on the left and opening on the right: filled where it is measured, a line or a hollow bar where it is
  // only asked for. Words stand outward on the stage, where nothing else does, else below.
  wheel(g) {
    const c = g.dataset.c, svg = g.ownerSVGElement, rect = g.querySelector("rect"), [x, y, w, h] = ["x", "y", "width", "height"].map((k) => +rect.getAttribute(k)), steer = rect.matches(".axle"), middle = y + h / 2;
    const kind = steer ? "steer" : "wheel", of = (name) => this.names.get(`${kind}.${c}.${name}`), live = Pictures.svg("g", { class: "live", "aria-hidden": "true" });
    const names = steer ? ["phi"] : ["v", ...(of("u_applied") === undefined ? ["u"] : ["u_applied", "u"])];
    const bars = names.map((name, i) => {
      const channel = of(name), line = name === "u" && names.length > 2, bar = Pictures.svg("rect", { x: i ? x + w - 10 : x + 4, width: 6, height: 2, class: name === "u" && !line ? "asked" : name });
      if (channel !== undefined && !steer) live.append(bar);
      return { channel, name, bar, line };
    }).filter((b) => b.channel !== undefined);
    const beside = [...svg.querySelectorAll(".tyre")].filter((e) => e.getAttribute("y") === rect.getAttribute("y")), stage = g.closest("#stage") && !steer, out = stage && beside.length < 3, left = beside.length > 1 && x + w / 2 < 186;
    const at = out ? { x: left ? x - 9 : x + w + 9, class: left ? "left" : "right" } : { x: x + w / 2, class: "" };
    const words = Pictures.svg("text", { ...at, y: out ? middle : y + h + (steer ? 11 : 12) });
    live.append(words);
    g.append(live);
    const says = stage ? Pictures.svg("text", { ...at, y: out ? middle - 17 : y + h / 2 + 8, class: `says ${at.class}` }) : null;
    if (says) live.append(says);
    const drive = (document.querySelector(`.lane[data-c="${CSS.escape(c)}"][data-side=actuator] .what`)?.textContent ?? "").trim().split(" ").at(-1);
    return { c, live, bars, words, says, out, drive, rect, middle, half: h / 2 - 6, steer, usual: rect.getAttribute("class") };
  }

  // Largest size of a signal of all parts over the mission: what a full bar means.
  async full(name) {
    const kind = name === "u_applied" ? "u" : name;
    this.sizes ??= new Map();
    if (!this.sizes.has(kind)) {
      let most = 1e-9;
      for (const { channel, name: other } of this.wheels.flatMap((w) => w.bars)) if (other === kind || (kind === "u" && other === "u_applied")) most = (await Data.curve(channel, Data.view.t0, Data.view.duration, 300)).y.reduce((m, v) => (Math.abs(v) > m ? Math.abs(v) : m), most);
      this.sizes.set(kind, most);
    }
    return this.sizes.get(kind);
  }

  // The worst fault of a part at a time.
  static fault(c, t) { return Data.view.faults.find((f) => f.component === c && f.start <= t && t < f.stop); }

  // Its mode, else what the part's lane says.
  state(c, t) {
    const fault = Pictures.fault(c, t);
    if (fault) return fault.mode;
    return ["sensor", "actuator"].map((side) => Pictures.lane(c, side, t)).find((s) => s !== "not_assessed") ?? "not_assessed";
  }

  // What the lane of a part says at a time.
  static lane(c, side, t) {
    const at = 2000 * t / Data.view.duration;
    for (const path of document.querySelectorAll(`.lane[data-c="${CSS.escape(c)}"][data-side="${side}"] path.ln`)) {
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
      for (const { channel, name, bar, line } of off ? [] : w.bars) {
        const { k, unit } = Data.view.channels[channel], [low, high] = await Data.at(channel, t), value = (low + high) / 2, part = Math.max(-1, Math.min(1, value / await this.full(name))) || 0, tall = Math.abs(part) * w.half;
        if (job !== this.job) return;
        bar.setAttribute("y", line ? w.middle - part * w.half - 1 : w.middle - Math.max(0, part) * w.half);
        if (!line) bar.setAttribute("height", Math.max(1, tall));
        const size = `${Now.number(value * k, 2)}${unit === "1" ? "" : unit === "°" ? unit : ` ${unit.replace("% of opening", "%")}`}`;
        if (w.out || !line) texts.push(name === "u" ? `asked ${size}` : name === "u_applied" ? `${w.drive} ${size}` : size);
      }
      w.words.replaceChildren(...texts.map((text, i) => { const line = Pictures.svg("tspan", { x: w.words.getAttribute("x"), dy: i ? (w.out ? 15 : 11) : 0 }); line.textContent = text; return line; }));
    }
  }
}
