// Another calibration for a unit: look at the difference, then put it in force.

const BY = "isotherm-by";
const NAMELESS = "Enter your name: it goes into the audit file.";

/** Who asks, for the audit file; remembered on this computer, and the same in all fields. */
function byField() {
  const input = make("input", { type: "text", className: "by", maxLength: 64, required: true, autocomplete: "off",
    value: localStorage.getItem(BY) ?? "" });
  input.addEventListener("change", () => {
    localStorage.setItem(BY, input.value.trim());
    for (const other of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll("input.by"))) {
      if (other === input) continue;
      other.value = input.value;
      other.dispatchEvent(new Event("input"));
    }
  });
  input.named = () => {
    const name = input.value.trim();
    if (!name) input.focus();
    return name;
  };
  input.option = () => input.value.trim() ? " --by " + quoted(input.value.trim()) : "";
  return input;
}

class ChangePart {
  constructor(page) {
    this.page = page;
    const button = (words, act) => make("button", { type: "button", onclick: act }, words);
    this.back = button("Roll back…", () => rollback(page));
    this.document = button("Document", () => this.showDocument());
    this.element = make("div", { className: "controls" }, button("Swap…", () => swap(page)), this.back, this.document);
  }

  show() {
    const has = this.page.instance.status.calibration !== null;
    this.document.disabled = !has;
    this.back.disabled = !has;
  }

  async showDocument() {
    const { serial } = this.page;
    const text = make("pre", { tabIndex: 0 }, "Asking…");
    const save = make("button", { type: "button", onclick: () => download(unitPath(serial, "document"), serial + ".toml") }, "Save");
    dialog("Document in force of " + serial, make("div", { className: "controls" }, copyButton("Copy", () => text.textContent), save), text);
    try {
      text.textContent = await (await request(unitPath(serial, "document"))).text();
    } catch (error) { text.textContent = error.message; }
  }
}

/** Shows what would change, and changes it when that was seen. `question` gives path and body, or throws what is missing. */
class Proposal {
  constructor(page, by, question, line) {
    this.page = page;
    this.by = by;
    this.question = question;
    this.answer = make("div", { className: "answer", role: "status", "aria-live": "polite" });
    this.look = make("button", { type: "button", onclick: () => this.ask(true) }, "Show the difference");
    this.act = make("button", { type: "button", className: "primary", disabled: true, onclick: () => this.ask(false) }, "Put in force");
    this.line = commandLine(line);
    this.element = make("div", {}, make("div", { className: "controls" }, this.look, this.act), this.note(), this.answer, this.line);
  }

  note() {
    return this.page.writes() ? null
      : make("p", { className: "hint" }, READ_ONLY + " The difference can be seen.");
  }

  /** What was asked for is another thing now: it has to be looked at first. */
  renew() {
    this.asked = null;
    this.act.disabled = true;
    this.line.renew();
    this.answer.replaceChildren();
  }

  async ask(dryRun) {
    let asked;
    try { asked = this.question(dryRun); } catch (error) { return this.say("bad", error.message); }
    const by = dryRun ? this.by.value.trim() : this.by.named();
    if (!dryRun && !by) return this.say("bad", NAMELESS);
    this.asked = asked;
    this.look.disabled = this.act.disabled = true;
    this.say("", "Asking…");
    try {
      const [path, body] = asked;
      const reply = await ask(path, { ...body, by });
      if (dryRun && this.asked !== asked) this.say("", "That has changed meanwhile: show the difference again.");
      else this.show(reply.swap === undefined && reply.allowed ? { refused: reply.reason } : reply.swap ?? reply);
    } catch (error) {
      this.say("bad", reason(error, ": look at the unit's history before you try again"));
    }
    this.look.disabled = false;
    this.page.history.load();
  }

  say(className, ...words) { this.answer.replaceChildren(make("p", { className }, ...words)); }

  show(reply) {
    if (reply.refused !== undefined) return this.say("bad", reply.refused);
    const id = head(reply.proposed ?? reply.digest);
    const words = {
      "refused": "Refused. Revision " + reply.revision + " stays in force.",
      "unchanged": "Unchanged: revision " + reply.revision + " is this document.",
      "would-be-accepted": "Would be accepted (" + id + ") and replace revision " + reply.revision + ".",
      "accepted": "Accepted as revision " + reply.revision + " (" + id + ").",
    }[reply.outcome];
    const className = { "refused": "bad", "accepted": "good" }[reply.outcome] ?? "";
    const problems = [...reply.problems.map(one => [one, "bad"]), ...reply.warnings.map(one => [one, "warned"])];
    this.answer.replaceChildren(make("p", { className: "outcome " + className }, words),
      problems.length ? make("ul", { className: "problems" }, ...problems.map(([one, level]) => make("li", { className: level },
        one.file === null || !one.key && one.line === 1 ? null : make("b", {}, "Line " + one.line + ", column " + one.column + " "),
        (one.key ? one.key + ": " : "") + one.message))) : "",
      reply.difference && reply.outcome !== "unchanged" ? difference(reply.difference) : "");
    this.act.disabled = reply.outcome !== "would-be-accepted" || !this.page.writes();
  }
}

/** Entries of the document that change, and what comes of them at the present temperatures. */
function difference({ document: entries, correction, temperatures }) {
  const parts = [];
  if (entries.length) {
    const table = figureTable(["Entry", "Before", "After"]);
    table.classList.add("words");
    table.show(entries.map(({ key, before, after }) => [key, before ?? NONE, after ?? NONE]));
    parts.push(make("h3", {}, "Changes in the document"), table);
  } else {
    parts.push(make("p", {}, "No entry of the document differs."));
  }
  if (!temperatures.length) {
    parts.push(make("p", {}, "The unit's temperatures are not known yet, so the effect is unknown."));
  } else if (correction.length) {
    const table = figureTable(["Correction", "Before", "After", "Change", "Unit"]);
    const six = value => fixed(value, 6);
    table.show(correction.map(({ quantity, unit, before, after }) =>
      [quantity, six(before), six(after), (after > before ? "+" : "") + six(after - before), unit]));
    parts.push(make("h3", {}, "Effect on the correction now, at " + temperatures.join(", ")), table);
  } else {
    parts.push(make("p", {}, "The correction stays as it is at " + temperatures.join(", ") + "."));
  }
  return make("div", { className: "difference" }, ...parts);
}

/** The window for a swap. */
function swap(page) {
  const { serial } = page;
  const file = make("input", { type: "file", accept: ".toml,text/plain" });
  const text = make("textarea", { rows: 6, spellcheck: false, placeholder: "… or paste the document here" });
  const slew = make("input", { type: "number", min: 0, max: 3600, step: "any", placeholder: "as configured" });
  const at = make("input", { type: "number", min: 0, step: 1, placeholder: "the next tick" });
  const force = make("input", { type: "checkbox" }), any = make("input", { type: "checkbox" });
  const by = byField();
  const number = input => input.value === "" ? null : Number(input.value);
  const question = dryRun => {
    if (!text.value.trim()) throw new Error("Choose a document first.");
    return [unitPath(serial, "swap"), { document: text.value, dry_run: dryRun, force: force.checked, any_serial: any.checked,
      slew_s: number(slew), at_sequence: number(at) }];
  };
  const line = () => ["isotherm swap", quoted(serial), quoted(file.files[0]?.name ?? serial + ".toml"),
    slew.value && "--slew " + slew.value, at.value && "--at-sequence " + at.value, any.checked && "--any-serial", force.checked && "--force"]
    .filter(Boolean).join(" ") + by.option() + page.options();
  const proposal = new Proposal(page, by, question, line);
  file.addEventListener("change", async () => {
    if (file.files[0]) text.value = await file.files[0].text();
    proposal.renew();
  });
  for (const input of [text, slew, at, force, any]) input.addEventListener("input", () => proposal.renew());
  by.addEventListener("input", () => proposal.line.renew());
  dialog("Swap the calibration of " + serial,
    field("Calibration document or overlay", file), field("Text", text),
    make("details", {}, make("summary", {}, "Options"), make("div", { className: "fields" },
      field("Over, s", slew, "0 is at once"), field("From tick", at, "sequence number"),
      make("label", { className: "check" }, force, "Force: accept it despite age, range, version or jump"),
      make("label", { className: "check" }, any, "Accept a document of another serial"))),
    field("Your name", by), proposal.element).classList.add("large");
}

/** The window for a rollback. */
async function rollback(page) {
  const { serial } = page;
  const choose = make("select", {}, make("option", { value: "" }, "the one before the present one"));
  const by = byField();
  const revision = () => choose.value === "" ? null : Number(choose.value);
  const question = dryRun => [unitPath(serial, "command"), { command: "rollback", revision: revision(), dry_run: dryRun }];
  const line = () => "isotherm rollback " + quoted(serial) + (choose.value && " --to " + choose.value) + by.option() + page.options();
  const proposal = new Proposal(page, by, question, line);
  choose.addEventListener("change", () => proposal.renew());
  by.addEventListener("input", () => proposal.line.renew());
  dialog("Roll back " + serial, field("To revision", choose), field("Your name", by), proposal.element).classList.add("large");
  proposal.ask(true);
  try {
    const present = page.instance.status.calibration?.revision.counter;
    for (const entry of (await ask(unitPath(serial, "history?limit=1000"))).reverse()) {
      if (entry.event !== "accepted" || entry.revision === present) continue;
      choose.append(make("option", { value: entry.revision }, entry.revision + ": " + moment(entry.time) + ", " + head(entry.digest)));
    }
  } catch { /* the one before can be had without the list */ }
}
