// A chart: its panels, its legend, the tooltip.

const INKS = ["paper", "ink", "faint", "rule", "raw", "corrected", "other", "truth", "first", "second", "third", "fourth", "fifth", "sixth", "alert"];

class Chart {
  constructor(figure, shape = JSON.parse(figure.querySelector("script[type='application/json']").textContent)) {
    this.figure = figure;
    this.shape = shape;
    this.hidden = new Set();
    this.withoutOutliers = false;
    this.at = null;
    this.keys = new Map();
    this.legends = legends(this.shape.panels);
    this.toolbar();
    const stack = element("div", "stack");
    figure.insertBefore(stack, figure.querySelector("figcaption"));
    this.stack = stack;
    this.panels = this.shape.panels.map((panel, index) => new Panel(this, panel, stack, this.legends.own[index]));
    this.tip = element("div", "tip", stack);
    this.tip.hidden = true;
    this.whole = this.wholeRange();
    this.range = [...this.whole];
    this.listen();
    this.colours = this.readColours();
    this.resize();
  }

  wholeRange() {
    let [low, high] = [Infinity, -Infinity];
    for (const panel of this.panels) {
      const [l, h] = panel.extent();
      [low, high] = [Math.min(low, l), Math.max(high, h)];
    }
    const [first, last] = this.shape.x.within ?? [low, high];
    [low, high] = this.data = [Math.max(low, first), Math.min(high, last)];
    if (!(low <= high)) return [0, 1];
    if (!(high > low)) return [low - 0.5, high + 0.5];
    // Dots at either end are not to be cut in two by the frame.
    const dots = this.shape.panels.some(panel => (panel.series ?? []).some(one => one.form === "dots"));
    return dots ? widened([low, high], 0.02, this.shape.x.logarithmic) : [low, high];
  }

  /** The legend: a button for each curve and kind of mark, that shows and hides it. */
  toolbar() {
    const bar = element("div", "bar");
    this.figure.prepend(bar);
    const kinds = new Map(this.shape.marks.map(mark => [mark.kind, mark]));
    for (const [all, form] of [[this.legends.shared, "line"], [kinds, "dash"]]) {
      for (const [name, { ink, dashes }] of all) this.toggle(bar, name, ink, form, dashes);
    }
    return bar;
  }

  toggle(bar, name, ink, form, dashes) {
    const made = element("button", "key", bar);
    made.type = "button";
    made.setAttribute("aria-pressed", "true");
    element("i", form + " " + ink, made).style.background = dashed(dashes);
    made.append(name);
    this.keys.set(name, [...(this.keys.get(name) ?? []), made]);
    made.addEventListener("click", () => {
      const gone = !this.hidden.delete(name);
      if (gone) this.hidden.add(name);
      for (const key of this.keys.get(name)) key.setAttribute("aria-pressed", String(!gone));
      this.draw();
    });
  }

  readColours() {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(INKS.map(ink => [ink, style.getPropertyValue("--" + ink).trim()]));
  }

  resize() {
    // Paper is about this wide; the text on it is then as large as that of the page.
    const width = this.paper ? 720 : Math.max(this.stack.clientWidth, 280);
    const density = Math.min(Math.max(window.devicePixelRatio || 1, this.paper ? 2 : 1), 3);
    for (const panel of this.panels) panel.resize(width, density);
    // At once: what has a new size is empty, and would be shown so.
    this.drawNow();
  }

  visibleMarks() { return this.shape.marks.filter(mark => !this.hidden.has(mark.kind)); }

  xTicks(width) {
    const [low, high] = this.range;
    const { logarithmic, unit } = this.shape.x;
    const most = Math.max(2, Math.floor(width / (width < 500 ? 62 : 95)));
    if (unit !== "s" || logarithmic) {
      const { values, decimals } = logarithmic ? logTicks(low, high, most) : linearTicks(low, high, most);
      const marked = unit ? values : values.filter(value => Math.abs(value - Math.round(value)) < 1e-9);
      return marked.map(value => ({ value, label: tickLabel(value, unit ? decimals : 0) }));
    }
    const { values } = timeTicks(low, high, most);
    const step = values.length > 1 ? values[1] - values[0] : high - low;
    return values.map(value => ({ value, label: clock(value, step) }));
  }

  place(x, step) {
    const { unit, logarithmic } = this.shape.x;
    if (unit === "s" && !logarithmic) return clock(x, step);
    return unit ? placed(x, logarithmic ? Math.abs(x) / 200 : step) + " " + unit : placed(x, 1);
  }

  draw() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = null;
      this.drawNow();
    });
  }

  drawNow() {
    // All panels have the room at their left that the widest label needs.
    const wanted = Math.max(...this.panels.map(panel => panel.measured()));
    for (const panel of this.panels) panel.draw(wanted);
    this.drawOver();
  }

  drawOver() { for (const panel of this.panels) if (panel.view) panel.drawOver(this.at, this.selection); }

  listen() {
    const { stack } = this;
    stack.addEventListener("pointermove", event => this.moved(event));
    // What a tap shows stays: the finger that leaves has not gone elsewhere.
    stack.addEventListener("pointerdown", event => this.moved(event));
    stack.addEventListener("pointerleave", event => { if (event.pointerType !== "touch") this.hide(); });
    stack.addEventListener("pointercancel", () => this.hide());
    new ResizeObserver(() => { if (!this.paper) this.resize(); }).observe(stack);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
  }

  recolour() {
    this.colours = this.readColours();
    this.draw();
  }

  /** The panel and the place of the axis under the pointer, or null. */
  find(event) {
    for (const panel of this.panels) {
      const box = panel.canvas.getBoundingClientRect();
      if (event.clientY < box.top || event.clientY >= box.bottom || !panel.view) continue;
      const p = event.clientX - box.left - panel.view.left;
      return p < -2 || p > panel.view.width + 2 ? null : { panel, x: panel.view.from(p), pixel: p };
    }
    return null;
  }

  moved(event) {
    const found = this.find(event);
    this.at = found ? found.x : null;
    this.drawOver();
    if (found) this.tell(event, found); else this.tip.hidden = true;
  }

  hide() {
    this.at = null;
    this.tip.hidden = true;
    this.drawOver();
  }

  tell(event, { panel, x }) {
    const perPixel = (this.range[1] - this.range[0]) / panel.view.width;
    const tip = this.tip;
    tip.replaceChildren();
    element("b", "", tip, this.place(x, perPixel));
    for (const { name, words, ink, dashes } of panel.said(x, 6 * perPixel)) {
      const row = element("div", "", tip);
      element("i", "line " + ink, row).style.background = dashed(dashes);
      row.append(name + (words ? ": " + words : ""));
    }
    const near = this.visibleMarks().filter(mark => Math.abs(mark.x - x) < 4 * perPixel);
    for (const mark of near.slice(0, 6)) element("div", "mark " + mark.ink, tip, mark.words);
    if (near.length > 6) element("div", "", tip, "and " + (near.length - 6) + " more");
    tip.hidden = false;
    const box = this.stack.getBoundingClientRect();
    const left = event.clientX - box.left;
    tip.style.top = event.clientY - box.top + 16 + "px";
    tip.style.left = (left + 16 + tip.offsetWidth > box.width ? Math.max(left - 16 - tip.offsetWidth, 0) : left + 16) + "px";
  }
}
