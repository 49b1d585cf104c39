"use strict";
// The mission played: one clock for machine, path, plots and mode probabilities, and a sentence at each crossing of a threshold.
class Replay {
  static APART = 0.5;
  static MOST = 300;
  static BESIDE = 2; // of a fault [s]

  constructor(one) {
    Object.assign(this, { one, stage: one("#stage"), names: new Map(Data.view.channels.map((c, i) => [c.name, i])), events: [], frame: 0 });
    this.parts = [...document.querySelectorAll("#timeline .lane[data-side]")].filter((l) => l.dataset.side).map((l) => ({ c: l.dataset.c, side: l.dataset.side, words: l.querySelector(".what").textContent.trim(), base: `evidence.${l.dataset.c}.${l.dataset.side}.` }));
    for (const [from, to] of [["svg.machine", "#stage-machine"], ["svg.map", "#stage-path"]]) {
      const copy = document.querySelector(from)?.cloneNode(true);
      if (!copy) { one(to).hidden = true; continue; }
      for (const e of copy.querySelectorAll(".live, .here, .ring ~ .bg, [data-c] > .side, [data-c] > .bg, [data-c] > title")) e.remove(); // what they say is of the whole mission
      for (const e of copy.querySelectorAll("[tabindex]")) { e.removeAttribute("tabindex"); e.removeAttribute("role"); e.removeAttribute("data-f"); }
      copy.setAttribute("role", "img");
      one(to).append(copy);
    }
    one("#stage-modes").append(...this.bars());
    this.stage.hidden = false;
    this.figure = new Figure(one("#stage-figure"), null, null);
  }

  bars() {
    return this.parts.flatMap((part) => {
      const modes = Object.keys(Data.view.words[part.side] ?? {});
      part.modes = modes.map((m) => ({ m, channel: this.names.get(`${part.base}p_${m}`) })).filter((x) => x.channel !== undefined);
      // without probabilities over time: those of its faults, as they are stated
      part.faults = part.modes.length ? [] : Data.view.faults.filter((f) => Replay.of(f, part));
      if (part.faults.length) part.modes = [...new Set(part.faults.map((f) => f.mode))].map((m) => ({ m }));
      const row = document.createElement("div"), name = document.createElement("span"), bar = document.createElement("span");
      name.textContent = part.words;
      bar.className = "stack";
      bar.setAttribute("role", "img");
      bar.append(...part.modes.map(({ m }) => Object.assign(document.createElement("i"), { className: m })));
      part.bar = bar;
      part.says = document.createElement("span");
      part.says.className = "small muted";
      row.append(name, bar, part.says);
      return [row];
    });
  }

  // A fault as it is stated, which weighs more than the readings of one moment: ``stuck 96 %``, ``faulty, kind unclear``.
  static stated(f) { return f.unclear ? f.words : `${f.words} ${Math.round(100 * f.p)}\u00a0%`; }

  // Whether a fault is, or may be, of a part.
  static of(f, part) { return f.component === part.c && (f.side === part.side || f.side === "sensor_or_actuator"); }

  // Rows of the plot beside the pictures: every wheel in one panel.
  rows() {
    const row = (key, title, test) => {
      const traces = Data.view.channels.map((c, i) => ({ c: i, name: c.name, k: c.k, unit: c.unit })).filter((t) => test.test(t.name)).map((t) => ({ ...t, name: t.name.split(".")[1] }));
      const order = this.parts.map((part) => part.c);
      traces.sort((a, b) => order.indexOf(a.name) - order.indexOf(b.name));
      traces.splice(6);
      traces.forEach((t, i) => { t.role = `free-${i}`; });
      return traces.length ? [{ key, title, traces, unit: traces[0].unit, component: "\0" }] : [];
    };
    return [...row("v", "Speed", /^wheel\.[^.]+\.v$/), ...row("u", "Asked of the drives", /^wheel\.[^.]+\.u$/), ...row("phi", "Steering angle", /^steer\.[^.]+\.phi$/)];
  }

  async open() {
    const rows = this.rows();
    this.one("#stage-figure").hidden = !rows.length;
    if (rows.length) await this.figure.draw(rows, Data.view.faults.slice(0, 40).map((f) => ({ ...f, main: false })), [0, Data.view.duration]);
    const found = [];
    for (const part of this.parts) found.push(...(await this.crossings(part)).map((e) => ({ ...e, part })));
    // Those of probabilities, and those beside a fault; where there are none, all, up to some.
    const all = found.length, rank = (e) => (e.sure ? 2 : e.near ? 1 : 0), most = found.some(rank) ? found.filter(rank).length : all;
    found.sort((a, b) => rank(b) - rank(a) || a.t - b.t);
    found.splice(Math.min(most, Replay.MOST));
    const left = all - found.length;
    found.sort((a, b) => a.t - b.t);
    this.one("#events").replaceChildren(...found.map((e) => {
      const item = document.createElement("li"), b = document.createElement("button");
      Object.assign(b, { className: "link", textContent: e.words });
      b.dataset.at = e.t;
      item.append(b);
      e.item = item;
      return item;
    }));
    this.events = found;
    this.looked = true;
    this.one("#events-none").hidden = found.length > 0 && !left;
    this.one("#events-none").textContent = left ? `${left} more crossing${left > 1 ? "s" : ""} of residuals, which led to no finding, ${left > 1 ? "are" : "is"} left out.` : "No residual or probability passes its threshold in this mission.";
    return this.show();
  }

  // Stretches in which values are beyond a limit for some readings on end, those that are close to each other as one. What is not known
  // (null), as between the readings of a slower channel, breaks no run unless it lasts.
  static stretches(d, beyond) {
    const list = [], least = d.stride > 1 ? 1 : 5;
    for (let i = 0, run = 0, first = 0, known = 0; i < d.y.length; i++) {
      const is = beyond(i);
      if (is === null) continue;
      if ((i - known) * d.dt > Replay.APART) run = 0;
      known = i;
      run = is ? run + 1 : 0;
      if (run === 1) first = i;
      if (run < least) continue;
      const stop = d.t + i * d.dt, start = d.t + first * d.dt, last = list.at(-1);
      if (last && start - last.stop < Replay.APART) last.stop = stop;
      else list.push({ start, stop });
    }
    return list;
  }

  // Whether a size is beyond a limit; null where one of them is not known.
  static over(size, limit) { return Number.isNaN(size) || Number.isNaN(limit) ? null : size > limit; }

  // Stretches of the mission in which a channel's size is beyond a limit, or another channel: by every sample where these are stored,
  // else by blocks that are beyond it in whole.
  static async passing(c, limit, other) {
    const { dt } = Data.view, list = [];
    for (const { from, to, every } of Data.parts(c)) {
      const inside = every ? [from + 2 * dt, to - 2 * dt] : [from, to], [d, e] = await Promise.all([Data.samples(c, ...inside, -1), other === undefined ? null : Data.samples(other, ...inside)]);
      const least = (i) => (e ? e.y[Math.min(e.y.length - 1, Math.max(0, Math.round((d.t + i * d.dt - e.t) / e.dt)))] : limit);
      for (const s of Replay.stretches(d, (i) => Replay.over(Math.abs(d.y[i]), least(i)))) {
        const last = list.at(-1);
        if (last && s.start - last.stop < Replay.APART) last.stop = s.stop;
        else if (list.length < Replay.MOST) list.push({ ...s, dt: d.dt });
      }
    }
    return list;
  }

  async crossings(part) {
    const { limit } = Data.view, words = Data.view.words[part.side] ?? {}, out = [], mine = Data.view.faults.filter((f) => Replay.of(f, part)), near = (s) => mine.some((f) => f.start - Replay.BESIDE < s.stop && s.start < f.stop + Replay.BESIDE), get = (leaf) => this.names.get(part.base + leaf);
    const value = async (leaf, t) => { const c = get(leaf); if (c === undefined) return null; const { k, unit } = Data.view.channels[c], [a, b] = await Data.at(c, t); return { v: k * (a + b) / 2, text: `${Now.number(k * (a + b) / 2, 3)}${unit === "1" ? "" : unit === "°" ? unit : ` ${unit}`}` }; };
    const p = get("probability"), r = get("residual"), h = get("threshold");
    const over = r !== undefined && h !== undefined ? await Replay.passing(r, 0, h) : null;
    if (over) {
      for (const s of over) {
        const [now, top, expected] = await Promise.all(["residual", "threshold", "expected"].map((leaf) => value(leaf, s.start)));
        out.push({ t: s.start, near: near(s), words: `${Now.clock(s.start)} · ${part.words}: the residual, ${now.text}, passes its threshold of ${top.text}${expected && Number.isFinite(expected.v) ? `; ${expected.text} was expected` : ""}.` });
      }
    }
    if (p !== undefined && limit) {
      for (const s of await Replay.passing(p, limit)) {
        const t = Math.min(s.start + s.dt, s.stop), shares = (await Promise.all(part.modes.map(async ({ m }) => ({ m, p: (await value(`p_${m}`, t))?.v })))).filter((x) => x.m !== "healthy" && Number.isFinite(x.p)).sort((a, b) => b.p - a.p), [now, top] = [await value("residual", t), await value("threshold", t)];
        const ratio = now && top && top.v > 0 && Math.abs(now.v) > top.v ? `; the residual is ${Now.number(Math.abs(now.v) / top.v, 2)} times its threshold` : "";
        const whole = mine.find((f) => f.start <= t && t < f.stop), first = shares.length ? words[shares[0].m] : "";
        const then = first && whole && whole.words !== first ? ` at first; the whole of it is ${whole.words}` : "", told = over && over.length < Replay.MOST && Data.parts(r).some((x) => x.every && x.from <= s.start && s.stop <= x.to), within = told && !over.some((o) => o.start < s.stop && s.start < o.stop), little = near(s) ? "" : `; no fault is stated here${within ? ": the residual does not stay beyond its threshold" : ""}`;
        out.push({ t: s.start, sure: 1, words: `${Now.clock(s.start)} · ${part.words}: the probability that it deviates passes ${Now.number(100 * limit)}\u00a0%${first ? `, ${first} ${Math.round(100 * shares[0].p)} %${then}` : ""}${ratio}${little}.` });
        out.push({ t: s.stop, sure: 1, words: `${Now.clock(s.stop)} · ${part.words}: the probability that it deviates falls below ${Now.number(100 * limit)}\u00a0% again.` });
      }
    }
    return out;
  }

  async show() {
    const { t } = Now, { one } = this;
    this.figure.drawn && this.figure.read().show();
    if (t === null) return;
    one("#scrub").value = t;
    one("#scrub").setAttribute("aria-valuetext", Now.clock(t, 2));
    one("#clock").textContent = Now.clock(t, 2);
    // The last crossing of a part whose fault lasts here, else the last of all.
    const here = Data.view.faults.filter((f) => f.start <= t && t < f.stop), before = this.events.filter((e) => e.t <= t + 1e-9);
    for (const e of this.events) e.item.removeAttribute("aria-current");
    const last = before.findLast((e) => here.some((f) => Replay.of(f, e.part))) ?? before.at(-1) ?? null;
    if (last) {
      last.item.setAttribute("aria-current", "true");
      const box = one("#events"), y = last.item.offsetTop;
      if (y < box.scrollTop || y > box.scrollTop + box.clientHeight - 40) box.scrollTop = y - 30;
    }
    const earlier = last && t - last.t > Replay.BESIDE && !here.some((f) => Replay.of(f, last.part)) ? "Last before: " : "";
    const why = last ? earlier + last.words : (this.looked ? "Nothing has passed a threshold up to here." : "Looking for what passes its threshold.");
    if (one("#why").textContent !== why) one("#why").textContent = why;
    for (const part of this.parts) {
      if (!part.modes.length) {
        part.says.textContent = Pictures.lane(part.c, part.side, t).replaceAll("_", " ");
        part.bar.setAttribute("aria-label", `${part.words}: ${part.says.textContent}`);
        continue;
      }
      if (part.faults.length) {
        const f = part.faults.find((x) => x.start <= t && t < x.stop);
        part.modes.forEach(({ m }, i) => { part.bar.children[i].style.width = `${f?.mode === m ? 100 * f.p : 0}%`; });
        part.says.textContent = f ? Replay.stated(f) : "no fault stated";
        part.bar.setAttribute("aria-label", `${part.words}: ${part.says.textContent}`);
        continue;
      }
      const shares = await Promise.all(part.modes.map(({ channel }) => Data.at(channel, t).then(([a, b]) => (a + b) / 2)));
      let top = -1;
      shares.forEach((p, i) => { part.bar.children[i].style.width = `${100 * (p || 0)}%`; if (p > (shares[top] ?? -1)) top = i; });
      const most = top < 0 ? "not judged" : `${Data.view.words[part.side][part.modes[top].m]} ${Math.round(100 * shares[top])}\u00a0%`, fault = here.filter((f) => Replay.of(f, part)).sort((a, b) => b.p - a.p)[0], slight = top >= 0 && part.modes[top].m !== "healthy" && !fault;
      if (slight) for (const share of part.bar.children) share.style.width = "0";
      part.says.textContent = fault ? Replay.stated(fault) : slight ? "no fault stated" : most;
      part.bar.setAttribute("aria-label", `${part.words}: ${part.says.textContent}`);
    }
  }

  // Plays on from where the clock stands, or from the beginning at the end.
  play() {
    const { one } = this, button = one("[data-act=play]"), end = Data.view.t0 + (Data.view.n - 1) * Data.view.dt;
    const stop = () => { cancelAnimationFrame(this.frame); this.frame = 0; Now.playing = false; button.textContent = "Play"; };
    if (this.frame) { stop(); return; }
    let before = performance.now(), t = Now.t === null || Now.t >= end ? 0 : Now.t;
    button.textContent = "Pause";
    Now.playing = true;
    const step = (now) => {
      if (Now.t !== null && Math.abs(Now.t - t) > 2 * Data.view.dt) t = Now.t; // moved by hand meanwhile
      t = Math.min(end, t + (now - before) / 1000 * +one("#speed").value);
      before = now;
      Now.set(t, { held: true });
      if (t >= end) stop();
      else this.frame = requestAnimationFrame(step);
    };
    this.frame = requestAnimationFrame(step);
  }
}
