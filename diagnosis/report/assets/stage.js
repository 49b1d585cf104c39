"use strict";
// What the clock moves: plots, pictures, and the stage of the replay, which is set up when it is first played or scrubbed.
class Stage {
  constructor(one, figures, failed) {
    Object.assign(this, { one, figures, failed, pictures: null, replay: null, ready: null });
    const root = document.documentElement, timeline = one("#timeline");
    root.addEventListener("now", () => this.show());
    one("#scrub")?.addEventListener("input", (e) => { Now.set(+e.target.value, { held: true }); this.reach(0.5); this.open(); });
    one("#events")?.addEventListener("click", (e) => {
      const b = e.target.closest("button");
      if (b) { Now.set(+b.dataset.at, { held: true }); this.reach(0.5); }
    });
    // The cursor may as well be led along the timeline.
    timeline?.addEventListener("pointermove", (e) => {
      const box = e.target.closest(".track")?.getBoundingClientRect();
      if (box && Data.view.n) Now.set(Data.view.duration * Math.min(1, Math.max(0, (e.clientX - box.left) / box.width)));
    });
    timeline?.addEventListener("pointerleave", () => Now.leave());
  }

  play() { return this.one("#replay") && this.open().then(() => this.replay.play()); }

  // Machine, path and plots on one stage.
  open() {
    return (this.ready ??= Data.later().then(() => {
      this.replay = new Replay(this.one);
      this.pictures?.remove();
      this.pictures = new Pictures(document);
      this.figures.stage = this.replay.figure;
      this.replay.open().catch(this.failed("#events-none"));
    }));
  }

  show() {
    for (const f of Object.values(this.figures)) if (f?.drawn) f.read().show();
    if (Now.playing) this.reach(0);
    Data.later().then(() => { (this.pictures ??= new Pictures(document)).show(); return this.replay?.show(); });
  }

  // Plots whose time in view does not hold the clock's move there, with the clock at a place of the view: 0 its beginning, 0.5 its middle.
  reach(place) {
    const { evidence } = this.figures, [a, b] = evidence?.drawn && Now.t !== null ? evidence.range : [Now.t, Now.t];
    if (Now.t < a || Now.t > b) evidence.pan((Now.t - a) / (b - a) - place);
  }
}
