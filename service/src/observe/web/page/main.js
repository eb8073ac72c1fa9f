// The page as a whole: which part is shown, whether the service answers, keys.

class App {
  constructor() {
    this.main = document.getElementById("main");
    this.link = document.getElementById("link");
    this.service = document.getElementById("service");
    this.troubles = document.getElementById("troubles");
    document.getElementById("report").addEventListener("click", () => this.report("bundle", "isotherm"));
    document.getElementById("help").addEventListener("click", () => this.help());
    addEventListener("hashchange", () => this.open());
    document.addEventListener("keydown", event => this.key(event));
    setInterval(() => this.showLink(), 1000);
    takeToken();
    this.open();
  }

  /** Shows the page that the address names. */
  open() {
    if (takeToken()) this.refused = null;
    this.stop?.abort();
    this.stop = new AbortController();
    document.querySelectorAll("dialog").forEach(open => open.close());
    if (!sessionStorage.getItem(TOKEN)) return this.askToken("");
    const serial = unitOf(location.hash);
    this.page = serial ? new UnitPage(this, serial) : new UnitsPage(this);
    document.title = this.page.title + " – isotherm";
    this.main.replaceChildren(this.page.element);
    if (this.overview) this.page instanceof UnitsPage ? this.page.draw(this.overview) : null;
    this.main.focus({ preventScroll: true });
    scrollTo(0, 0);
    return this.page.start(this.stop.signal);
  }

  /** One look at all units. */
  async look(signal) {
    try {
      const overview = await ask("units", undefined, signal);
      if (signal.aborted) return;
      this.overview = overview;
      this.heard();
      this.showServices(overview);
      if (this.page instanceof UnitsPage) this.page.draw(overview);
    } catch (error) {
      if (!signal.aborted) this.lost(error);
    }
  }

  heard() {
    this.heardAt = Date.now();
    this.silent = null;
    document.body.classList.remove("lost");
    this.showLink();
  }

  lost(error) {
    if (error instanceof Refused && error.status === 401) {
      this.stop.abort();
      sessionStorage.removeItem(TOKEN);
      return this.askToken("The token is not the service's.");
    }
    this.silent ??= { since: this.heardAt ?? Date.now(), words: error instanceof Refused ? error.message : "no answer" };
    document.body.classList.add("lost");
    return this.showLink();
  }

  showLink() {
    if (this.silent) {
      this.link.className = "bad";
      say(this.link, "Connection lost " + since((Date.now() - this.silent.since) / 1000) + " ago: what is shown is old");
    } else if (this.heardAt) {
      this.link.className = "good";
      say(this.link, "Live");
    }
  }

  /** @param {Overview} overview */
  showServices({ services, instance, write, pair }) {
    const own = services.find(service => service.instance === instance);
    const others = services.length - 1;
    say(this.service, own ? [own.name, "version " + own.version, "up " + since(own.uptime_s), write ? "" : "read-only",
      others > 0 ? plural(others, "other service") : ""].filter(Boolean).join(" · ") : "");
    const troubles = services.flatMap(service => {
      const name = services.length > 1 ? service.name + ": " : "";
      const folder = service.calibrations;
      return [
        service.gone ? ["gone", "the service does not answer any more"] : null,
        folder?.state === "gone" ? ["fault", "calibrations " + folder.path + ": " + (folder.reason ?? "cannot be read") + "; calibrations in force stay"] : null,
        ...service.faults.map(fault => ["warning", fault.kind.replaceAll("_", " ") + " " + count(fault.count) + "×: " + fault.first]),
        ...service.bad_documents.map(bad => ["warning", (bad.problem.startsWith(bad.file) ? "" : bad.file + ": ") + bad.problem +
          (bad.problems > 1 ? " (and " + (bad.problems - 1) + " more)" : "")]),
      ].filter(Boolean).map(([level, words]) => [level, name + words]);
    }).concat(pair.map(({ level, columns }) => [level, columns.join(" · ")]));
    const key = JSON.stringify(troubles);
    if (key === this.troubled) return;
    this.troubled = key;
    this.troubles.replaceChildren(...troubles.map(([level, words]) => {
      const mark = make("span");
      setMark(mark, level);
      return make("p", { className: level }, mark, words);
    }));
  }

  askToken(words) {
    const input = make("input", { type: "password", autocomplete: "off", required: true, spellcheck: false });
    const form = make("form", { className: "card token" }, make("h1", {}, "Token"),
      make("p", {}, "The console asks for the token of its service. In a terminal on that machine:"),
      make("p", { className: "line" }, make("code", {}, "isotherm web --config service.toml")),
      field("Token", input), words ? make("p", { className: "bad", role: "alert" }, words) : null,
      make("button", { className: "primary" }, "Open"));
    form.addEventListener("submit", event => {
      event.preventDefault();
      sessionStorage.setItem(TOKEN, input.value.trim().replace(/^.*#token=/, ""));
      this.open();
    });
    this.page = null;
    document.title = "isotherm";
    this.main.replaceChildren(form);
    input.focus();
  }

  async report(path, name) {
    const time = new Date().toISOString().slice(0, 19).replace(/[-:]/g, "");
    try {
      await download(path, name + "-report-" + time + ".tar.gz");
    } catch (error) {
      dialog("Fault report", make("p", { className: "bad" }, reason(error)));
    }
  }

  key(event) {
    const typing = /^(INPUT|TEXTAREA|SELECT)$/.test(event.target.tagName);
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (event.key === "Escape" && typing) return void event.target.blur();
    if (typing) return;
    if (event.key === "?") this.help();
    else if (!this.page?.key(event)) return;
    event.preventDefault();
  }

  help() {
    const keys = [["/", "filter units"], ["j, ↓", "next unit"], ["k, ↑", "previous unit"], ["Enter", "open the unit"], ["u", "back to all units"],
      ["Esc", "leave a field, close a window"], ["?", "this"]];
    const list = facts();
    list.show(keys.map(([key, words]) => [key, words]));
    const marks = facts();
    marks.show([["! fault", "there now, or within the last minute"], ["× gone", "nobody answers for it"],
      ["▲ warning", "outside the calibrated range, stale, without calibration"], ["● running", "±: with reversal of the lasing mode"],
      ["○ not running", "standby, self-test, pre-launch calibration"]]);
    dialog("Keys and marks", list, make("h3", {}, "Marks"), marks);
  }
}

/** Serial of the unit that an address names; "" where it names none, or cannot be read. */
function unitOf(hash) {
  try {
    return decodeURIComponent(hash.match(/^#\/unit\/(.+)$/)?.[1] ?? "");
  } catch {
    return "";
  }
}

new App();
