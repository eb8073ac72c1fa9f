// All units, those that need somebody first.

/** Groups of the filter, by level. */
const GROUPS = [["fault", "Faults"], ["warning", "Warnings"], ["gone", "Gone"], ["fine", "Fine"]];
const groupOf = level => level === "note" ? "fine" : level;

class UnitsPage {
  constructor(app) {
    this.app = app;
    this.rows = new Map();
    this.group = null;
    this.chips = make("div", { className: "chips", role: "group", "aria-label": "Show" });
    this.search = make("input", {
      type: "search", placeholder: "Filter by serial, state or reason", "aria-label": "Filter units", spellcheck: false,
      oninput: () => this.draw(),
    });
    this.body = make("tbody");
    const heads = ["", "Unit", "State", "Why", "Temperature", "°C/min", "Correction, °/h", "Raw, Hz", "p99", "Rev."];
    const table = make("table", { className: "units" },
      make("thead", {}, make("tr", {}, ...heads.map((name, at) => make("th", { scope: "col", className: at > 4 ? "number" : "" },
        name || make("span", { className: "offscreen" }, "Level"))))), this.body);
    this.empty = make("p", { className: "empty", hidden: true });
    this.element = make("div", { className: "overview" }, make("h1", { className: "offscreen" }, "Units"),
      make("div", { className: "filter" }, this.chips, this.search), table, this.empty);
    for (const [group, name] of [[null, "All"], ...GROUPS]) {
      const number = make("b"), mark = make("i", { ariaHidden: "true" });
      if (group) setMark(mark, group);
      const chip = make("button", { type: "button", className: "chip", onclick: () => { this.group = group; this.draw(); } },
        group ? mark : null, name + " ", number);
      chip.renew = units => {
        const count = group ? units.filter(unit => groupOf(unit.level) === group).length : units.length;
        say(number, String(count));
        chip.setAttribute("aria-pressed", String(this.group === group));
        chip.hidden = count === 0 && group !== null && this.group !== group;
      };
      this.chips.append(chip);
    }
  }

  get title() { return "Units"; }

  start(signal) { return watch(1000, signal, () => this.app.look(signal)); }

  /** Shows the last look again, or a new one. */
  draw(/** @type {Overview | undefined} */ look = this.look) {
    this.look = look;
    if (!look) return;
    for (const chip of this.chips.children) chip.renew(look.units);
    const text = this.search.value.trim().toLowerCase();
    const has = unit => !text || [unit.unit, unit.state, ...unit.reasons].some(words => words.toLowerCase().includes(text));
    const shown = look.units.filter(unit => (!this.group || groupOf(unit.level) === this.group) && has(unit));
    const doubled = new Set();
    const seen = new Set();
    for (const { unit } of look.units) (seen.has(unit) ? doubled : seen).add(unit);
    const kept = new Set();
    shown.forEach((unit, index) => {
      const key = unit.unit + "\n" + unit.instance;
      if (!this.rows.has(key)) this.rows.set(key, new UnitRow());
      const row = this.rows.get(key);
      row.show(unit, doubled.has(unit.unit) && unit.instance);
      kept.add(key);
      if (this.body.rows[index] !== row.element) this.body.insertBefore(row.element, this.body.rows[index] ?? null);
    });
    for (const [key, row] of this.rows) {
      if (kept.has(key)) continue;
      row.element.remove();
      this.rows.delete(key);
    }
    this.empty.hidden = shown.length > 0;
    say(this.empty, look.units.length ? "No unit fits the filter."
      : "No unit has appeared yet. One appears with its first raw message, or with its calibration.");
  }

  key(event) {
    const links = [...this.body.querySelectorAll("a")];
    const at = links.indexOf(document.activeElement);
    if (event.key === "/") this.search.focus();
    else if (event.key === "j" || event.key === "ArrowDown") links[Math.min(at + 1, links.length - 1)]?.focus();
    else if (event.key === "k" || event.key === "ArrowUp") links[Math.max(at - 1, 0)]?.focus();
    else return false;
    return true;
  }
}

class UnitRow {
  constructor() {
    const cell = (className, ...children) => make("td", { className }, ...children);
    this.mark = make("span");
    this.link = make("a");
    this.instance = make("small");
    this.state = cell("state");
    this.why = cell("why");
    this.temperature = make("span", { className: "value" });
    this.bar = rangeBar();
    this.numbers = ["rate", "correction", "hz", "p99", "revision"].map(name => cell("number " + name));
    ["°C/min", "°/h", "Hz", "p99", "rev."].forEach((unit, at) => this.numbers[at].setAttribute("data-unit", unit));
    this.element = make("tr", { onclick: event => { if (!event.target.closest("a")) this.link.click(); } },
      cell("level", this.mark), make("th", { scope: "row" }, this.link, this.instance), this.state, this.why,
      cell("temperature", make("span", { className: "pair" }, this.bar, this.temperature)), ...this.numbers);
  }

  /** @type {(unit: Row, instance: string | false) => void} */
  show(unit, instance) {
    setMark(this.mark, unit.level, unit.running);
    this.element.className = unit.level;
    say(this.link, unit.unit);
    const target = "#/unit/" + encodeURIComponent(unit.unit);
    if (this.link.getAttribute("href") !== target) this.link.href = target;
    say(this.instance, instance ? instance.slice(0, 8) : "");
    say(this.state, unit.state);
    const [first, ...others] = unit.reasons;
    say(this.why, first ? first + (others.length ? " (and " + others.length + " more)" : "") : "");
    this.why.title = unit.reasons.join("\n");
    say(this.temperature, celsius(unit.temperature_deg_c));
    this.bar.show(unit.temperature_deg_c, unit.calibrated_range_deg_c, ["above", "below", "stale"].includes(unit.range));
    const figures = [perMinute(unit.temperature_rate_deg_c_per_s), digits(unit.correction_deg_per_h), hertz(unit.raw_ticks_per_s),
      latency(unit.p99_ns), unit.revision === null ? NONE : String(unit.revision)];
    figures.forEach((text, index) => say(this.numbers[index], text));
  }
}
