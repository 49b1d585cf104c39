"use strict";
// What the page brings into view, and the evidence of a fault that has none in the markup.
const Sight = {
  async brief(f) {
    const article = document.querySelector("#brief");
    article.dataset.ev = f.id;
    article.querySelector("h2").textContent = `${f.id} · ${f.title}`;
    const words = (await Data.intervals())[f.id];
    if (article.dataset.ev !== f.id) return;
    const times = `${Now.clock(f.start)} to ${Now.clock(f.stop)}${f.stop < 60 ? "" : ` (${Now.seconds(f.start)} to ${Now.seconds(f.stop)} s)`} · ${Now.span(f.stop - f.start)} · severity ${f.severity}`;
    article.querySelector("p").textContent = times;
    article.dataset.text = `${f.id} ${f.title}, ${times}`;
    article.querySelector("ul").replaceChildren(...(words.evidence || []).map((s) => { const li = document.createElement("li"); li.textContent = s; return li; }));
    article.querySelector(".advice").textContent = words.advice || "Nothing was recorded.";
    article.querySelector(".how").textContent = words.check || "";
  },

  go(where, atOnce) {
    document.querySelector(where).scrollIntoView({ behavior: atOnce || matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
  },

  // What has been opened comes into view as far as it is not, its head first.
  near(where) {
    const element = typeof where === "string" ? document.querySelector(where) : where, { top, bottom } = element.getBoundingClientRect();
    if (top >= 0 && bottom <= innerHeight) return;
    element.scrollIntoView({ block: bottom - top < innerHeight - 80 && top > 0 ? "end" : "start", behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
  },

  keepInTable(row) {
    const box = row.closest(".scroll");
    if (row.offsetTop < box.scrollTop || row.offsetTop + row.offsetHeight > box.scrollTop + box.clientHeight) box.scrollTop = row.offsetTop - 60;
  },
};
