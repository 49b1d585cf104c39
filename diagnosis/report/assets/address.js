"use strict";
// What the address asks for: fault, event of the machine, time, chosen signals; and what of it the page does not have.
const Address = {
  text(fault, range, plots, view) {
    const parts = fault ? [`fault=${encodeURIComponent(fault)}`] : [];
    if (range) parts.push(`t=${range.map((v) => v.toFixed(4)).join(",")}`);
    if (plots.length) parts.push(`plots=${plots.map((p) => p.map(encodeURIComponent).join(",")).join(";")}`);
    if (plots.length && view !== "time") parts.push(`view=${view}`);
    return `#${parts.join("&")}`;
  },

  // `has` is the fault as it stands there, `id` its name; `range` is not there where the time is none.
  read(hash) {
    const read = (key) => new RegExp(`[#&]${key}=([^&]*)`).exec(hash)?.[1] ?? "";
    const plain = (s) => { try { return decodeURIComponent(s); } catch { return ""; } };
    const t = read("t") ? read("t").split(",").map(Number) : [], around = t.length === 1 ? [t[0] - 0.5, t[0] + 0.5] : t;
    const range = around.length === 2 && around.every(Number.isFinite) && around[1] > around[0] ? around : undefined, plots = read("plots");
    return { event: plain(read("event")), has: read("fault"), id: plain(read("fault")), t: plain(read("t")) || read("t"), range, plots: plots ? plots.split(";").map((p) => p.split(",").map(plain)) : null, view: read("view") };
  },

  cut: (s) => (s.length > 60 ? `${s.slice(0, 60)}…` : s),

  // What the address asks for and the page does not have, until the next address.
  tell(words) {
    let note = document.querySelector("#missing");
    if (!words) { note?.remove(); return; }
    if (!note) {
      note = document.createElement("p");
      Object.assign(note, { id: "missing", className: "note" });
      document.querySelector("main").before(note);
    }
    note.textContent = words;
    document.querySelector("#live").textContent = words;
  },
};
