// Everything of one unit.

// generated from protocol/layout.toml: flags
const SENSOR_FLAGS = { VALID: 1, OVERRANGE: 2, CLAMPED_TEMPERATURE: 4, STALE_TEMPERATURE: 8, NOT_FINITE: 16, EXCLUDED: 32, CLAMPED_RATE: 64 };
// generated from protocol/layout.toml: end of flags

/** What is wrong with a sensor's last tick; a flag without words of its own shows its name. */
const WORDS_OF_FLAGS = { OVERRANGE: "overrange", CLAMPED_TEMPERATURE: "temperature outside range", STALE_TEMPERATURE: "temperature stale",
  NOT_FINITE: "not finite", EXCLUDED: "excluded", CLAMPED_RATE: "rate outside range" };

class UnitPage {
  constructor(app, serial) {
    this.app = app;
    this.serial = serial;
    const line = () => "isotherm status " + quoted(serial) + this.options();
    this.mark = make("span");
    this.state = make("span", { className: "pill" });
    this.remarks = make("ul", { className: "remarks" });
    this.live = new LiveTicks(serial);
    this.temperatures = new Temperatures();
    this.calibration = facts();
    this.change = new ChangePart(this);
    this.commands = new CommandPart(this);
    this.history = new HistoryPart(this);
    this.instances = figureTable(["Instance", "State", "Rev.", "Document", "Last tick", "Published", "p99", ""]);
    this.instancesCard = card("Instances", "wide", make("p", { className: "hint" },
      "More than one service has this unit. Swaps and commands go to all of them."), this.instances);
    this.pair = figureTable(["Service", "Role", "Priority", "Takeovers", "Ticks compared", "Ticks different", ""]);
    this.pairCard = card("Pair", "wide pairs", this.pair);
    this.drift = figureTable(["Gyro", "Drift, °/h", "σ, °/h", "Updates", "Refused", ""]);
    this.driftCard = card("Drift in addition to the calibrated bias", "drift", this.drift);
    this.sensors = figureTable(["Sensor", "Now", "Ticks", "Invalid", "Overrange", "Not finite", "Clamped", "Stale", "Excluded"]);
    this.latency = new LatencyPart();
    this.rates = facts();
    this.counters = facts();
    this.idle = make("details", { className: "idle" }, make("summary", {}, "Counters that are zero"));
    this.zero = make("p", { className: "hint" });
    this.idle.append(this.zero);
    this.tests = make("div");
    this.testsCard = card("Self-test and pre-launch calibration", "wide", this.tests);
    this.problem = make("p", { className: "empty" }, "Waiting for the unit…");
    this.body = make("div", { className: "grid", hidden: true },
      this.instancesCard, this.pairCard, this.live.element,
      make("div", { className: "column" }, this.temperatures.element, this.driftCard, this.latency.element),
      make("div", { className: "column" }, card("Calibration", "calibration", this.calibration, this.change.element), this.commands.element,
        card("Input and counters", "counters", this.rates, this.counters, this.idle)),
      card("Sensors", "wide", this.sensors), this.testsCard, this.history.element);
    const report = make("button", { type: "button", onclick: () => this.app.report(unitPath(serial, "bundle"), serial) }, "Fault report of this unit");
    this.element = make("article", { className: "unit" },
      make("p", { className: "back" }, make("a", { href: "#/" }, "← All units")),
      make("div", { className: "title" }, this.mark, make("h1", {}, serial), this.state,
        make("span", { className: "tools" }, copyButton("Copy as command", line, "The line that shows the same in a terminal"), report)),
      this.remarks, this.problem, this.body);
  }

  get title() { return this.serial; }

  options() { return this.app.overview?.options ?? ""; }

  writes() { return this.app.overview?.write === true; }

  start(signal) {
    const looks = watch(1000, signal, async () => {
      try {
        const sheet = await ask(unitPath(this.serial), undefined, signal);
        this.app.heard();
        this.draw(sheet);
      } catch (error) {
        if (signal.aborted) return;
        if (!(error instanceof Refused) || error.status !== 404) return this.app.lost(error);
        this.app.heard();
        say(this.problem, error.message + ". It appears with its first raw message.");
        this.problem.hidden = false;
        this.body.hidden = true;
      }
    });
    this.history.load();
    return Promise.all([looks, watch(5000, signal, () => this.app.look(signal)), this.live.start(signal)]);
  }

  /** @param {Sheet} sheet */
  draw(sheet) {
    const instance = sheet.instances[0];
    const { status } = instance;
    const first = !this.instance;
    this.instance = instance;
    this.problem.hidden = true;
    this.body.hidden = false;
    const running = status.state.startsWith("running") && instance.gone_s === null;
    setMark(this.mark, instance.level, running);
    say(this.state, status.state);
    this.state.className = "pill " + (running ? "running" : "");
    this.showRemarks(instance.remarks);
    this.live.element.hidden = !instance.own;
    this.temperatures.show(instance);
    this.showCalibration(status);
    this.showInstances(sheet);
    this.commands.show(instance);
    this.change.show();
    this.driftCard.hidden = !status.drift.length;
    this.drift.show(status.drift.map(one => [one.gyro, signed(degPerHour(one.rate_rad_per_s)), digits(degPerHour(one.sigma_rad_per_s)),
      count(one.updates), count(one.refused), one.subtracted ? "subtracted" : "published only"]));
    this.latency.show(status.latency);
    this.showCounters(status);
    this.showSensors(status);
    this.showTests(status);
    const done = JSON.stringify([status.calibration?.revision.counter, status.swaps, status.state, status.pending]);
    if (!first && done !== this.done) this.history.load();
    this.done = done;
  }

  /** @param {Instance["remarks"]} remarks */
  showRemarks(remarks) {
    const key = JSON.stringify(remarks);
    if (key === this.remarked) return;
    this.remarked = key;
    this.remarks.replaceChildren(...remarks.map(({ level, words }) => {
      const mark = make("span");
      setMark(mark, level);
      return make("li", { className: level }, mark, make("span", {}, words));
    }));
  }

  /** @param {Status} status */
  showCalibration(status) {
    const { calibration, pending, swaps } = status;
    const output = { calibrated: null, "pass-through": "none: raw readings pass through", held: "none: nothing is published" }[status.output];
    this.calibration.show([
      ["In force", calibration ? "revision " + calibration.revision.counter : output ?? NONE],
      ["Document", calibration ? head(calibration.digest ?? calibration.revision.digest) : null],
      ["Made", calibration && isNumber(calibration.age_s) ? age(calibration.age_s, calibration.created_unix_s) : null],
      ["From", calibration?.source || null],
      ["Waiting", pending ? "revision " + pending.revision.counter : null],
      ["Swaps", count(swaps.accepted) + " accepted, " + count(swaps.refused) + " refused"],
      ["Last refusal", swaps.last_refusal ?? null],
    ]);
  }

  /** @param {Sheet} sheet */
  showInstances(sheet) {
    this.instancesCard.hidden = sheet.instances.length < 2;
    this.instances.show(sheet.instances.map(({ status, own, gone_s }) => [
      status.instance.slice(0, 8), gone_s === null ? status.state : "gone for " + since(gone_s),
      String(status.calibration?.revision.counter ?? NONE), head(status.calibration?.digest),
      status.last_tick ? count(status.last_tick.sequence) : NONE, count(valueOf(status, "ticks_out")), latency(status.latency.p99_ns),
      own ? "this service" : "",
    ]));
    this.pairCard.hidden = sheet.pair.length < 2;
    this.pair.show(sheet.pair.map(one => [one.name, one.role, String(one.priority), count(one.takeovers), count(one.ticks_compared),
      count(one.ticks_differing), [one.own ? "this service" : "", one.last_difference].filter(Boolean).join("; ")]));
  }

  /** @param {Status} status */
  showCounters(status) {
    const rates = status.input_rates;
    this.rates.show([["Raw gyro ticks", hertz(rates.gyro_ticks_per_s) + " Hz"], ["Accelerometer ticks", hertz(rates.accel_ticks_per_s) + " Hz"],
      ["Temperature readings", hertz(rates.temperature_readings_per_s) + " /s"], ["Messages", hertz(rates.messages_per_s) + " /s"]]);
    const name = text => text.replaceAll("_", " ");
    this.counters.show(status.counters.filter(one => one.value).map(one => [name(one.name), count(one.value)]));
    say(this.zero, status.counters.filter(one => !one.value).map(one => name(one.name)).join(", "));
  }

  /** @param {Status} status */
  showSensors(status) {
    this.sensors.show(status.sensors.map(sensor => {
      const wrong = Object.keys(SENSOR_FLAGS).filter(name => name !== "VALID" && sensor.flags & SENSOR_FLAGS[name])
        .map(name => WORDS_OF_FLAGS[name] ?? name.toLowerCase().replaceAll("_", " "));
      const figures = ["ticks", "invalid", "overrange", "not_finite", "clamped", "stale", "excluded"].map(name => count(sensor[name]));
      return [(sensor.kind === "gyro" ? "gyro " : "accelerometer ") + sensor.name, wrong.join(", ") || "good", ...figures];
    }));
  }

  /** @param {Status} status */
  showTests(status) {
    const { self_test: test, pre_launch: progress, pre_launch_outcome: outcome } = status;
    this.testsCard.hidden = !test && !progress && !outcome;
    const key = JSON.stringify([test, progress, outcome]);
    if (key === this.tested) return;
    this.tested = key;
    const parts = [];
    if (progress) {
      parts.push(make("p", {}, "Pre-launch calibration: " + since(progress.elapsed_s) + " of " + since(progress.duration_s)),
        make("progress", { max: progress.duration_s, value: progress.elapsed_s, "aria-label": "Progress" }));
    }
    if (outcome) parts.push(make("p", {}, "Last pre-launch calibration: " + verdict(outcome.verdict)));
    if (test) {
      const table = figureTable(["Item", "Value", "Limits", "Unit", ""]);
      table.show(test.items.map(item => [item.name, isNumber(item.value) ? plain(item.value, 5) : NONE, limits(item), item.unit_of_measure,
        item.passed ? "passed" : "failed"]));
      parts.push(make("p", { className: test.passed ? "good" : "bad" }, "Self-test " + (test.passed ? "passed" : "failed")), table);
    }
    this.tests.replaceChildren(...parts);
  }

  key(event) {
    if (event.key !== "u" && event.key !== "Backspace") return false;
    location.hash = "#/";
    return true;
  }
}

/** @type {(status: Status, name: string) => number} */
const valueOf = (status, name) => status.counters.find(one => one.name === name)?.value ?? 0;

/** @param {Verdict} verdict */
function verdict(verdict) {
  if (verdict === "aborted") return "aborted";
  if ("refused" in verdict) return "refused: " + verdict.refused.join("; ");
  const words = verdict.accepted.map(one => one.gyro + " C0 " + signed(degPerHour(one.static_bias_change_rad_per_s)) + " ± " +
    digits(degPerHour(one.static_bias_sigma_rad_per_s)) + " °/h");
  return "accepted: " + words.join(", ");
}

/** @param {TestItem} item */
function limits({ at_least: low, at_most: high }) {
  const [l, h] = [low, high].map(value => isNumber(value) ? plain(value, 4) : null);
  return l !== null && h !== null ? l + " … " + h : l !== null ? "≥ " + l : h !== null ? "≤ " + h : NONE;
}

/** The time that the service adds. */
class LatencyPart {
  constructor() {
    this.facts = facts();
    this.bars = make("div", { className: "bars", role: "img" });
    this.element = card("Added latency", "latency", this.facts, this.bars);
  }

  /** @param {Latency} latencies */
  show(latencies) {
    const names = { p50_ns: "Median", p99_ns: "99 %", p999_ns: "99.9 %", max_ns: "Longest" };
    this.facts.show(Object.entries(names).map(([key, name]) => [name, latency(latencies[key])]));
    const buckets = latencies.buckets;
    const used = buckets.map((bucket, index) => bucket.count ? index : -1).filter(index => index >= 0);
    const shown = used.length ? buckets.slice(used[0], used[used.length - 1] + 1) : [];
    const most = Math.max(1, ...shown.map(bucket => bucket.count));
    while (this.bars.children.length > shown.length) this.bars.lastChild.remove();
    shown.forEach((bucket, index) => {
      const bar = this.bars.children[index] ?? this.bars.appendChild(make("i"));
      // A few among millions are to be seen: the scale is logarithmic.
      bar.style.height = bucket.count ? 100 * Math.log1p(bucket.count) / Math.log1p(most) + "%" : "0";
      bar.title = "up to " + latency(bucket.up_to_ns) + ": " + count(bucket.count);
    });
    this.bars.setAttribute("aria-label", "Histogram of the added latency, logarithmic");
  }
}
