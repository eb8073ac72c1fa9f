// A chart: its panels, its tool bar, zooming and moving, the tooltip.

const INKS = ["paper", "ink", "faint", "rule", "raw", "corrected", "other", "truth", "first", "second", "third", "fourth", "fifth", "sixth", "alert"];
const HELP = "Ctrl and wheel, or + and \u2212: zoom. Drag: zoom to a part. Shift and drag, or \u2190 and \u2192: move. Double click or Home: all of it.";

class Chart {
  constructor(figure) {
    this.figure = figure;
    this.shape = JSON.parse(figure.querySelector("script[type='application/json']").textContent);
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

  /** The numbers behind a reference. */
  list({ list }) { return lists.get("data" + list); }

  wholeRange() {
    let [low, high] = [Infinity, -Infinity];
    for (const panel of this.panels) {
      const [l, h] = panel.extent();
      [low, high] = [Math.min(low, l), Math.max(high, h)];
    }
    this.data = [low, high];
    if (!(low <= high)) return [0, 1];
    if (!(high > low)) return [low - 0.5, high + 0.5];
    // Dots at either end are not to be cut in two by the frame.
    const dots = this.shape.panels.some(panel => (panel.series ?? []).some(one => one.form === "dots"));
    return dots ? widened([low, high], 0.02, this.shape.x.logarithmic) : [low, high];
  }

  toolbar() {
    const bar = element("div", "bar");
    this.figure.prepend(bar);
    const kinds = new Map(this.shape.marks.map(mark => [mark.kind, mark.ink]));
    for (const [all, form] of [[this.legends.shared, "line"], [kinds, "dash"]]) {
      for (const [name, ink] of all) this.toggle(bar, name, ink, form);
    }
    const buttons = element("span", "buttons", bar);
    const button = (text, title, act) => {
      const made = element("button", "", buttons, text);
      made.type = "button";
      made.title = title;
      made.addEventListener("click", act);
      return made;
    };
    button("+", "Zoom in", () => this.zoom(0.5));
    button("\u2212", "Zoom out", () => this.zoom(2));
    button("All", "All of it", () => this.show(this.whole));
    const outliers = button("Without outliers", "Vertical axes for 98 of 100 values", () => {
      this.withoutOutliers = !this.withoutOutliers;
      outliers.setAttribute("aria-pressed", String(this.withoutOutliers));
      this.draw();
    });
    outliers.setAttribute("aria-pressed", "false");
    this.readout = element("output", "", bar);
    element("p", "help", this.figure, HELP);
  }

  toggle(bar, name, ink, form) {
    const made = element("button", "key", bar);
    made.type = "button";
    made.setAttribute("aria-pressed", "true");
    element("i", form + " " + ink, made);
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
    this.draw();
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
    const step = (this.range[1] - this.range[0]) / 1000;
    this.readout.textContent = this.shape.x.label + " " +
      this.range.map(x => this.place(Math.min(Math.max(x, this.data[0]), this.data[1]), step)).join(" to ");
    this.drawOver();
  }

  drawOver() { for (const panel of this.panels) if (panel.view) panel.drawOver(this.at, this.selection); }

  show(range) {
    this.range = held(range, this.whole);
    this.draw();
  }

  zoom(factor, at = (this.range[0] + this.range[1]) / 2) {
    const least = Math.max((this.whole[1] - this.whole[0]) * 1e-9, 1e-9);
    this.range = zoomed(this.range, at, factor, this.whole, least);
    this.draw();
  }

  move(share) {
    const by = share * (this.range[1] - this.range[0]);
    this.show([this.range[0] + by, this.range[1] + by]);
  }

  listen() {
    const { stack, figure } = this;
    stack.addEventListener("wheel", event => {
      // The bare wheel scrolls the page.
      const sideways = event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY);
      const found = event.ctrlKey || event.metaKey || sideways ? this.find(event) : null;
      if (!found) return;
      event.preventDefault();
      if (sideways) this.move((event.deltaX || event.deltaY) / 1000);
      else this.zoom(Math.exp(Math.min(Math.max(event.deltaY, -300), 300) / 400), found.x);
    }, { passive: false });
    stack.addEventListener("pointerdown", event => this.press(event));
    stack.addEventListener("pointermove", event => this.moved(event));
    stack.addEventListener("pointerup", event => this.release(event));
    stack.addEventListener("pointercancel", () => { this.drag = this.selection = null; this.drawOver(); });
    stack.addEventListener("pointerleave", () => this.hide());
    stack.addEventListener("dblclick", () => this.show(this.whole));
    figure.addEventListener("keydown", event => this.key(event));
    new ResizeObserver(() => { if (!this.paper) this.resize(); }).observe(stack);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    addEventListener("beforeprint", () => this.forPaper(true));
    addEventListener("afterprint", () => this.forPaper(false));
  }

  recolour() {
    this.colours = this.readColours();
    this.draw();
  }

  /** Printing is in light colours, whatever the screen has. */
  forPaper(paper) {
    this.paper = paper;
    document.documentElement.classList.toggle("paper", paper);
    this.colours = this.readColours();
    this.resize();
    this.drawNow();
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

  press(event) {
    const found = event.button === 0 ? this.find(event) : null;
    if (!found) return;
    this.figure.focus({ preventScroll: true });
    this.stack.setPointerCapture(event.pointerId);
    this.drag = { from: found.x, client: event.clientX, range: [...this.range], pan: event.shiftKey };
    event.preventDefault();
  }

  moved(event) {
    const found = this.find(event);
    if (this.drag) {
      const { view } = this.panels[0];
      if (this.drag.pan) {
        const by = (event.clientX - this.drag.client) / view.width * (this.drag.range[1] - this.drag.range[0]);
        this.show([this.drag.range[0] - by, this.drag.range[1] - by]);
      } else if (found) {
        this.selection = [this.drag.from, Math.min(Math.max(found.x, this.range[0]), this.range[1])];
      }
    }
    this.at = found ? found.x : null;
    this.drawOver();
    if (found) this.tell(event, found); else this.tip.hidden = true;
  }

  release(event) {
    const { drag, selection } = this;
    this.drag = this.selection = null;
    if (drag && !drag.pan && selection && Math.abs(event.clientX - drag.client) > 4) {
      this.show([Math.min(...selection), Math.max(...selection)]);
    } else {
      this.drawOver();
    }
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
    for (const { name, words, ink } of panel.said(x, 6 * perPixel)) {
      const row = element("div", "", tip);
      element("i", "line " + ink, row);
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

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const act = {
      ArrowLeft: () => this.move(-0.1), ArrowRight: () => this.move(0.1), PageUp: null, PageDown: null,
      "+": () => this.zoom(0.5), "=": () => this.zoom(0.5), "-": () => this.zoom(2),
      Home: () => this.show(this.whole), Escape: () => { this.drag = this.selection = null; this.hide(); },
    }[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }
}

/** All lists of the page by the names of their elements. */
const lists = new Map();

async function begin() {
  for (const holder of document.querySelectorAll("script[data-type]")) {
    lists.set(holder.id, await unpacked(holder.textContent, holder.dataset.type));
    holder.remove();
  }
  document.querySelectorAll("figure.chart").forEach(figure => new Chart(figure));
}
begin();
