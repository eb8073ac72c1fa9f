// One panel: its heading, its two canvases, its drawing and its tooltip.

const RIGHT = 10, TOP = 6, BELOW = 24, ROW = 22;

function element(tag, className, parent, text) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  if (parent) parent.append(made);
  return made;
}

class Panel {
  constructor(chart, shape, parent, own) {
    this.chart = chart;
    this.shape = shape;
    this.element = element("section", "panel", parent);
    this.head = element("div", "head", this.element);
    element("h3", "", this.head, [shape.title, shape.unit].filter(Boolean).join(", "));
    for (const [name, { ink, dashes }] of own) chart.toggle(this.head, name, ink, "line", dashes);
    const box = element("div", "plot", this.element);
    this.canvas = element("canvas", "", box);
    this.over = element("canvas", "over", box);
    this.read();
    this.height = shape.lanes ? this.lanes.length * ROW : shape.height;
  }

  /** Reads the numbers; again where they have changed. */
  read() {
    const { chart, shape } = this;
    const read = samples => resolved(samples, ref => chart.list(ref));
    this.series = (shape.series ?? []).map(one => ({ ...one, samples: read(one.samples) }));
    const shared = new Map();
    this.lanes = (shape.lanes ?? []).map(lane => {
      if (!lane.samples) return lane;
      const key = JSON.stringify(lane.samples);
      if (!shared.has(key)) shared.set(key, read(lane.samples));
      return { ...lane, samples: shared.get(key) };
    });
  }

  shown() { return this.series.filter(one => !this.chart.hidden.has(one.name)); }

  extent() {
    let [low, high] = [Infinity, -Infinity];
    const widen = ([l, h]) => { low = Math.min(low, l); high = Math.max(high, h); };
    for (const one of [...this.series, ...this.lanes]) {
      if (one.samples) widen(extentOf(one.samples));
      for (const part of one.stretches ?? []) widen([part.from, part.to]);
    }
    return [low, high];
  }

  resize(width, density) {
    this.density = density;
    for (const canvas of [this.canvas, this.over]) {
      canvas.width = Math.round(width * density);
      canvas.height = Math.round((this.height + TOP + BELOW) * density);
      canvas.style.height = this.height + TOP + BELOW + "px";
    }
    this.width = width;
    // Room for the names of rows, where there is any.
    this.least = this.chart.margin ?? (width > 800 ? 168 : this.chart.paper ? 132 : 72);
  }

  /** Makes the vertical axis; the room that its labels and the names of rows need. */
  measured() {
    this.axis = this.shape.lanes ? null : this.verticalAxis(this.shown());
    const g = this.canvas.getContext("2d");
    g.font = FONT;
    // On a phone names of rows are cut.
    const labels = [...(this.axis?.ticks ?? []).map(tick => tick.label), ...(this.width > 640 ? this.lanes.map(lane => lane.name) : [])];
    const widest = Math.max(0, ...labels.map(label => g.measureText(label).width));
    return Math.max(this.least, Math.min(Math.ceil(widest) + 10, 0.5 * this.width));
  }

  draw(left) {
    const { chart, density } = this;
    this.left = left;
    this.head.style.marginLeft = left + "px";
    const g = this.canvas.getContext("2d");
    g.setTransform(density, 0, 0, density, 0, 0);
    g.clearRect(0, 0, this.width, this.height + TOP + BELOW);
    const view = this.view = { left: this.left, top: TOP, width: this.width - this.left - RIGHT, height: this.height, range: chart.range };
    const logarithmic = chart.shape.x.logarithmic;
    Object.assign(view, mapping(chart.range, view.width, logarithmic));
    const shown = this.shown();
    const y = this.axis;
    drawAxes(g, view, chart.xTicks(view.width), y, chart.colours);
    if (this.shape.lanes) {
      clipped(g, view, () => drawLanes(g, view, this.lanes, ROW, chart.colours, density));
      this.laneNames(g);
    } else if (y) {
      clipped(g, view, () => {
        const { paper } = chart.colours;
        const lines = shown.map(one => drawSeries(g, view, y, one.samples, one.form,
          { colour: chart.colours[one.ink], paper, density, dashes: one.dashes }));
        for (const line of lines) line();
      });
    }
    clipped(g, view, () => drawMarks(g, view, chart.visibleMarks(), chart.colours));
  }

  verticalAxis(shown) {
    const logarithmic = this.shape.logarithmic;
    let range = valueRange(shown.map(one => one.samples), this.chart.range, this.chart.withoutOutliers);
    if (!range) return null;
    let [low, high] = range;
    if (logarithmic) {
      low = Math.max(low, high * 1e-12);
      [low, high] = high > 0 ? [low / 1.15, high * 1.15] : [0.1, 1];
    } else {
      // What varies by less than a ten-millionth of itself is level, and its rounding no curve.
      const size = Math.max(Math.abs(low), Math.abs(high));
      const room = high - low > 1e-7 * size ? 0.06 * (high - low) : Math.max(0.05 * size, 1e-9);
      [low, high] = [low - room, high + room];
    }
    const most = Math.max(2, Math.round(this.height / 27));
    const { values, decimals } = logarithmic ? logTicks(low, high, most) : linearTicks(low, high, most);
    const ticks = values.map(value => ({ value, label: tickLabel(value, decimals) }));
    return { ticks, ...mapping([low, high], this.height, logarithmic) };
  }

  /** Names of the rows, left of them; what does not fit is cut, and whole in the tooltip. */
  laneNames(g) {
    g.font = FONT;
    g.fillStyle = this.chart.colours.faint;
    g.textAlign = "right";
    g.textBaseline = "middle";
    this.lanes.forEach((lane, row) => {
      let name = lane.name;
      while (name.length > 3 && g.measureText(name).width > this.left - 10) name = name.slice(0, -2) + "\u2026";
      g.fillText(name, this.left - 6, TOP + (row + 0.5) * ROW);
    });
  }

  /** The crosshair and the selection; `x` is a place on the axis or null. */
  drawOver(x, selection) {
    const g = this.over.getContext("2d");
    g.setTransform(this.density, 0, 0, this.density, 0, 0);
    g.clearRect(0, 0, this.width, this.height + TOP + BELOW);
    const { view, chart } = this;
    if (selection) {
      const [a, b] = selection.map(place => view.left + view.to(place));
      g.fillStyle = chart.colours.corrected;
      g.globalAlpha = 0.18;
      g.fillRect(Math.min(a, b), view.top, Math.abs(b - a), view.height);
      g.globalAlpha = 1;
    }
    if (x === null) return;
    g.strokeStyle = chart.colours.faint;
    const p = Math.round(view.left + view.to(x)) + 0.5;
    if (p >= view.left && p <= view.left + view.width) line(g, p, view.top, p, view.top + view.height);
  }

  /** Lines of the tooltip at a place of the axis: name, value, colour. */
  said(x, slack) {
    const lines = [];
    for (const one of this.shown()) {
      const s = one.samples, i = nearest(s, x);
      if (i < 0 || Math.abs(placeOf(s, i) - x) > slack + (s.width ?? 0)) continue;
      const value = s.mean.list[i] + s.mean.middle;
      let words = plain(value, 7) + (this.shape.unit ? " " + this.shape.unit : "");
      const [low, high] = [s.min.list[i] + s.min.middle, s.max.list[i] + s.max.middle];
      if (!s.single && high > low) words += " (" + plain(low, 6) + " \u2026 " + plain(high, 6) + ")";
      if (isFinite(value)) lines.push({ name: one.name, words, ink: one.ink, dashes: one.dashes });
    }
    const noted = [];
    for (const lane of this.lanes) {
      const part = lane.stretches?.find(part => part.from <= x && x <= part.to);
      if (part) lines.push({ name: lane.name, words: part.label, ink: part.ink });
      if (!lane.samples) continue;
      const i = nearest(lane.samples, x);
      if (i >= 0 && lane.samples.bits[i] >>> lane.bit & 1) noted.push(lane);
    }
    for (const lane of noted) lines.push({ name: lane.name, words: "", ink: lane.ink });
    return lines;
  }
}
