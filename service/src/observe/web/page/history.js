// What was done to a unit, by whom and when.

class HistoryPart {
  constructor(page) {
    this.page = page;
    this.all = make("input", { type: "checkbox", onchange: () => this.load() });
    this.table = figureTable(["No.", "Time (UTC)", "What", "Rev.", "By", "Detail"]);
    this.table.classList.add("words");
    this.note = make("p", { className: "hint" });
    const line = () => "isotherm history " + quoted(page.serial) + (this.all.checked ? " --all" : "") + page.options();
    this.element = card("History", "wide history", make("div", { className: "controls" },
      make("label", { className: "check" }, this.all, "Refusals, commands and first ticks too"), copyButton("Copy as command", line)),
      this.table, this.note);
  }

  async load() {
    try {
      const entries = await ask(unitPath(this.page.serial, "history?limit=" + (this.all.checked ? 50 : 1000)));
      entries.sort((a, b) => b.number - a.number);
      const shown = entries.filter(entry => this.all.checked || ["accepted", "withdrawn"].includes(entry.event)).slice(0, 50);
      this.table.hidden = !shown.length;
      this.table.show(shown.map(row));
      say(this.note, shown.length ? "" : "Nothing yet.");
    } catch (error) {
      say(this.note, reason(error));
    }
  }
}

function row(entry) {
  const time = moment(entry.time);
  const [what, revision, detail] = {
    "accepted": () => ["accepted", entry.revision, [cameFrom(entry.source), head(entry.digest), ...(entry.changed ?? []).slice(0, 3),
      (entry.changed ?? []).length > 3 ? "and " + (entry.changed.length - 3) + " more" : ""].filter(Boolean).join("; ")],
    "in-force": () => ["in force", entry.revision, "from tick " + entry.first_sequence],
    "withdrawn": () => ["withdrawn", entry.revision, entry.why === "superseded" ? "replaced by revision " + entry.by_revision : "called off"],
    "refused": () => ["refused", "", plural(entry.count, "problem") + ": " + (entry.problems[0] ?? "")],
    "command": () => ["command", "", entry.command + (entry.accepted ? " → " : " refused: ") + (entry.reason ?? entry.state_after)],
  }[entry.event]?.() ?? [entry.event.replaceAll("-", " "), "", ""];
  return [String(entry.number), time, what, String(revision), entry.by, detail];
}

function cameFrom(source) {
  const file = source.path?.split("/").pop();
  return { "folder": file, "start": file, "bus": "bus", "rollback": "rollback to " + source.to, "pre-launch": "pre-launch" }[source.from] ?? source.from;
}
