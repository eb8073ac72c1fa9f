// A chart that can be zoomed and moved, and printed.

const HELP = "Ctrl and wheel, or + and \u2212: zoom. Drag: zoom to a part. Shift and drag, or \u2190 and \u2192: move. Double click or Home: all of it.";

/** All lists of the page by the names of their elements. */
const lists = new Map();

class ZoomChart extends Chart {
  /** The numbers behind a reference. */
  list({ list }) { return lists.get("data" + list); }

  toolbar() {
    const bar = super.toolbar();
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

  drawNow() {
    super.drawNow();
    const step = (this.range[1] - this.range[0]) / 1000;
    this.readout.textContent = this.shape.x.label + " " +
      this.range.map(x => this.place(Math.min(Math.max(x, this.data[0]), this.data[1]), step)).join(" to ");
  }

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
    super.listen();
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
    stack.addEventListener("pointerup", event => this.release(event));
    stack.addEventListener("pointercancel", () => { this.drag = this.selection = null; this.drawOver(); });
    stack.addEventListener("dblclick", () => this.show(this.whole));
    figure.addEventListener("keydown", event => this.key(event));
    figure.addEventListener("focusout", () => this.hide());
    addEventListener("beforeprint", () => this.forPaper(true));
    addEventListener("afterprint", () => this.forPaper(false));
  }

  /** Printing is in light colours, whatever the screen has. */
  forPaper(paper) {
    this.paper = paper;
    document.documentElement.classList.toggle("paper", paper);
    this.colours = this.readColours();
    this.resize();
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
    if (this.drag) {
      const found = this.find(event);
      const { view } = this.panels[0];
      if (this.drag.pan) {
        const by = (event.clientX - this.drag.client) / view.width * (this.drag.range[1] - this.drag.range[0]);
        this.show([this.drag.range[0] - by, this.drag.range[1] - by]);
      } else if (found) {
        this.selection = [this.drag.from, Math.min(Math.max(found.x, this.range[0]), this.range[1])];
      }
    }
    super.moved(event);
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

async function begin() {
  const figures = [...document.querySelectorAll("figure.chart")];
  const notes = figures.map(figure => {
    const note = element("p", "help", null, "Unpacking the curves\u2026");
    figure.prepend(note);
    return note;
  });
  try {
    for (const holder of document.querySelectorAll("script[data-type]")) {
      lists.set(holder.id, await unpacked(holder.textContent, holder.dataset.type));
      holder.remove();
    }
  } catch (error) {
    for (const note of notes) note.textContent = "The curves cannot be unpacked: " + error;
    throw error;
  }
  for (const note of notes) note.remove();
  for (const figure of figures) new ZoomChart(figure);
}
begin();
