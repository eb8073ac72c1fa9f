// Charts that go on: the last minute of ticks, and temperatures over some minutes. Drawn by the engine of the plots.

/** How far back ticks are shown (s). */
const LIVE_S = 60;
const AXES = ["x", "y", "z"];

/** A chart whose numbers change. */
class RunningChart extends Chart {
  list(numbers) { return numbers; }

  /** Room for the labels at the left (px). */
  get margin() { return 52; }

  /** Draws the numbers as they are now, from `low` to `high` of the axis. */
  renew(low, high) {
    for (const panel of this.panels) panel.read();
    this.whole = this.data = this.range = [low, high];
    this.draw();
  }
}

/** Lists of one curve: places, and what a bin holds. */
class Curve {
  constructor() { this.clear(); }
  clear() { Object.assign(this, { x: [], min: [], mean: [], max: [] }); }
}

/** Raw and corrected ticks of a unit, one over the other. */
class LiveTicks {
  constructor(serial) {
    this.serial = serial;
    this.bins = [];
    this.quantity = "rad_per_s";
    this.paused = false;
    this.status = make("p", { className: "hint", role: "status" });
    this.means = figureTable(["Mean of 10 s", "Raw", "Corrected", "Removed"]);
    const choose = make("select", { "aria-label": "Quantity", onchange: () => { this.quantity = choose.value; this.build(); } },
      make("option", { value: "rad_per_s" }, "Angular rate, °/h"), make("option", { value: "m_per_s2" }, "Specific force, mg"));
    this.pause = make("button", { type: "button", "aria-pressed": "false", onclick: () => {
      this.paused = !this.paused;
      this.pause.setAttribute("aria-pressed", String(this.paused));
      say(this.pause, this.paused ? "Go on" : "Hold");
    } }, "Hold");
    this.place = make("div");
    this.element = card("Raw and corrected", "wide live", make("div", { className: "controls" }, choose, this.pause), this.place, this.means,
      this.status);
    this.build();
  }

  /** A chart for the chosen quantity. */
  build() {
    this.curves = AXES.map(() => ({ raw: new Curve(), corrected: new Curve() }));
    const panels = this.curves.map((curves, axis) => ({
      title: "About case " + AXES[axis], unit: "°/h", height: 92,
      series: ["raw", "corrected"].map(name => ({ name, ink: name, form: "line", samples: curves[name] })),
    }));
    if (this.quantity === "m_per_s2") panels.forEach((panel, axis) => Object.assign(panel, { title: "Along case " + AXES[axis], unit: "mg" }));
    const figure = make("figure", { className: "chart", "aria-label": "Raw and corrected, the last minute" });
    this.place.replaceChildren(figure);
    this.chart = new RunningChart(figure, { x: { label: "", unit: "s", logarithmic: false }, panels, marks: [] });
    this.draw();
  }

  /** Half a second of ticks after the other. */
  async start(signal) {
    while (!signal.aborted) {
      if (document.visibilityState !== "visible" || this.paused) { await pause(500, signal); continue; }
      try {
        const { bins } = await ask(unitPath(this.serial, "live"), undefined, signal);
        const now = performance.now() / 1000;
        this.bins.push(...bins.map(bin => ({ ...bin, at: now - bin.age_s })));
        this.bins = this.bins.filter(bin => bin.at > now - LIVE_S - 1);
        say(this.status, bins.length ? "" : "No tick was corrected in the last half second.");
        this.draw();
      } catch (error) {
        if (signal.aborted) return;
        say(this.status, reason(error));
        await pause(1000, signal);
      }
    }
  }

  draw() {
    const now = performance.now() / 1000;
    const scale = this.quantity === "rad_per_s" ? DEG_PER_H : MILLI_G;
    for (const name of ["raw", "corrected"]) {
      AXES.forEach((_, axis) => {
        const curve = this.curves[axis][name];
        curve.clear();
        let before = null;
        for (const bin of this.bins) {
          const [min, mean, max] = bin[name + "_" + this.quantity]?.[axis] ?? [null, null, null];
          // Where nothing came for a while the line has a gap.
          if (before !== null && bin.at - before > 1) put(curve, before - now + 0.01, NaN, NaN, NaN);
          put(curve, bin.at - now, min ?? NaN, mean ?? NaN, max ?? NaN, scale);
          before = bin.at;
        }
      });
    }
    this.chart.renew(-LIVE_S, 0);
    this.means.show(AXES.map((axis, index) => {
      const [raw, corrected] = ["raw", "corrected"].map(name => this.mean(name, index, now - 10));
      const both = raw !== null && corrected !== null;
      return [axis, ...[raw, corrected, both ? raw - corrected : null].map(value => value === null ? NONE : signed(value * scale))];
    }));
  }

  /** Mean of one axis since then, each tick with the same weight; null where ticks began, or went on, later. */
  mean(name, axis, since) {
    let [sum, ticks] = [0, 0];
    const bins = this.bins.filter(bin => bin.at >= since);
    if (!(bins[0]?.at < since + 1)) return null;
    for (const bin of bins) {
      const value = bin[name + "_" + this.quantity]?.[axis][1];
      if (!isNumber(value)) continue;
      sum += value * bin.ticks;
      ticks += bin.ticks;
    }
    return ticks ? sum / ticks : null;
  }
}

function put(curve, x, min, mean, max, scale = 1) {
  curve.x.push(x);
  curve.min.push(min * scale);
  curve.mean.push(mean * scale);
  curve.max.push(max * scale);
}

const INKS_OF_CHANNELS = ["first", "second", "third", "fourth", "fifth", "sixth"];

/** Temperatures of all channels over the last minutes. */
class Temperatures {
  constructor() {
    this.table = figureTable(["Channel", "Calibrated, °C", "", "Now", "°C/min", ""]);
    this.bars = new Map();
    this.place = make("div");
    this.element = card("Temperatures", "temperatures", this.table, this.place);
  }

  /** @param {Instance} instance */
  show(instance) {
    const { channels } = instance.status;
    this.table.show(channels.map(channel => {
      const odd = channel.stale || channel.place === "above" || channel.place === "below";
      if (!this.bars.has(channel.name)) this.bars.set(channel.name, rangeBar());
      const bar = this.bars.get(channel.name);
      bar.show(channel.temperature_deg_c, channel.calibrated_range_deg_c, odd);
      const words = channel.stale ? "stale" : channel.place && channel.place !== "inside" ? channel.place : channel.warming_up ? "warming up" : "";
      const range = channel.calibrated_range_deg_c;
      return [channel.name, range ? range.map(end => grouped(String(end))).join(" … ") : NONE, bar, celsius(channel.temperature_deg_c), perMinute(channel.rate_deg_c_per_s), words];
    }));
    const names = channels.map(channel => channel.name);
    if (names.join("\n") !== this.names) this.build(names);
    const past = instance.past.filter(one => one.length === names.length + 1);
    this.curves.forEach((curve, index) => {
      curve.clear();
      for (const one of past) { const value = one[index + 1] ?? NaN; put(curve, -one[0], value, value, value); }
    });
    this.place.hidden = past.length < 2;
    if (past.length > 1) this.chart.renew(-Math.max(past[0][0], 30), 0);
  }

  build(names) {
    this.names = names.join("\n");
    this.curves = names.map(() => new Curve());
    const series = names.map((name, index) => ({
      name, ink: INKS_OF_CHANNELS[index % INKS_OF_CHANNELS.length], form: "line", samples: this.curves[index],
      // After as many channels as there are colours, the lines are broken ones.
      dashes: Math.floor(index / INKS_OF_CHANNELS.length),
    }));
    const figure = make("figure", { className: "chart", "aria-label": "Temperatures of the last minutes" });
    this.place.replaceChildren(figure);
    const panels = [{ title: "", unit: "°C", height: 130, series }];
    this.chart = new RunningChart(figure, { x: { label: "", unit: "s", logarithmic: false }, panels, marks: [] });
  }
}
