// Commands, with what the unit's state takes now.

const COMMANDS = [
  ["run", "Run", "Publish corrected increments"],
  ["standby", "Standby", "Publish nothing until further notice"],
  ["self-test", "Self-test", "Check the instrument's own voltages and counters: 10 s, from standby"],
  ["pre-launch", "Pre-launch calibration…", "Determine C0 and B0 of each gyro at rest: 10 min, from standby"],
  ["abort", "Abort", "End self-test or pre-launch calibration; nothing changes"],
  ["rest", "Rest…", "The unit is at rest: feed the drift estimator"],
  ["end-rest", "End rest", "The unit is no longer at rest"],
];
/** Commands that end with what the unit publishes: asked for twice. */
const STOPS = ["standby"];

class CommandPart {
  constructor(page) {
    this.page = page;
    this.by = byField();
    this.answer = make("p", { className: "answer", role: "status", "aria-live": "polite" });
    this.chosen = "standby";
    this.line = commandLine(() => this.words(this.chosen));
    this.note = make("p", { className: "hint" });
    this.buttons = COMMANDS.map(([name, words, title]) => {
      const button = make("button", { type: "button", title, onclick: () => this.press(name, button) }, words);
      for (const event of ["pointerenter", "focus"]) button.addEventListener(event, () => this.choose(name));
      button.words = words;
      return button;
    });
    this.by.addEventListener("input", () => this.line.renew());
    this.element = card("Commands", "commands", make("div", { className: "controls" }, ...this.buttons), this.note,
      field("Your name", this.by), this.answer, this.line);
  }

  words(name, more = "") {
    const place = name === "rest" || name === "pre-launch" ? more || " --latitude … --heading …" : more;
    return "isotherm command " + quoted(this.page.serial) + " " + name + place + this.by.option() + this.page.options();
  }

  choose(name) {
    this.chosen = name;
    this.line.renew();
  }

  /** @param {Instance} instance */
  show(instance) {
    const { allowed, status } = instance;
    const writes = this.page.writes();
    this.buttons.forEach((button, index) => {
      const [name, , title] = COMMANDS[index];
      const possible = allowed.includes(name);
      button.disabled = !possible || !writes;
      button.hidden = name === "abort" && !possible;
      button.title = possible ? title : "Not possible in state " + status.state;
    });
    say(this.note, writes ? "Possible now: " + allowed.join(", ") + "." : READ_ONLY);
  }

  press(name, button) {
    this.choose(name);
    if (name === "rest" || name === "pre-launch") return this.askPlace(name, button.words.replace("…", ""));
    if (STOPS.includes(name) && !button.armed) {
      button.armed = true;
      say(button, "Really?");
      setTimeout(() => { button.armed = false; say(button, button.words); }, 4000);
      return undefined;
    }
    return this.give({ command: name });
  }

  async give(order) {
    const by = this.by.named();
    if (!by) return this.tell("bad", NAMELESS);
    this.tell("", "Asking…");
    try {
      const reply = await ask(unitPath(this.page.serial, "command"), { ...order, by });
      const words = [reply.accepted ? reply.state : null, reply.reason].filter(Boolean).join("; ");
      this.tell(reply.accepted ? "good" : "bad", words);
    } catch (error) {
      this.tell("bad", reason(error, ": look at the unit's state before you try again"));
    }
    return this.page.history.load();
  }

  tell(className, words) {
    this.answer.className = "answer " + className;
    say(this.answer, words);
  }

  /** Asks where the unit stands, and gives the command. */
  askPlace(name, title) {
    const number = (min, max, required) => make("input", { type: "number", min, max, step: "any", required });
    const [latitude, heading] = [number(-90, 90, true), number(-360, 360, true)];
    const [pitch, roll] = [number(-90, 90, false), number(-360, 360, false)];
    const duration = number(60, 7200, false);
    const install = make("input", { type: "checkbox", checked: true });
    const problem = make("p", { className: "bad", role: "alert" });
    const tilted = () => pitch.value !== "" && roll.value !== "";
    const options = () => " --latitude " + (latitude.value || "…") + " --heading " + (heading.value || "…") +
      (tilted() ? " --pitch " + pitch.value + " --roll " + roll.value : "") +
      (name === "pre-launch" ? (duration.value ? " --duration " + duration.value : "") + (install.checked ? "" : " --store-only") : "");
    const line = commandLine(() => this.words(name, options()));
    const form = make("form", { method: "dialog" }, make("div", { className: "fields" },
      field("Latitude, °", latitude), field("Heading of case x from north, °", heading),
      field("Pitch, °", pitch, "empty: from the accelerometers"), field("Roll, °", roll, "empty: from the accelerometers"),
      name === "pre-launch" ? field("Duration, s", duration, "empty: as configured") : null),
      name === "pre-launch" ? make("label", { className: "check" }, install, "Put the result in force") : null,
      problem, make("button", { className: "primary" }, "Begin"), line);
    for (const input of form.querySelectorAll("input")) input.addEventListener("input", () => line.renew());
    const open = dialog(title + " of " + this.page.serial, form);
    form.addEventListener("submit", event => {
      event.preventDefault();
      if ((pitch.value === "") !== (roll.value === "")) { say(problem, "Give pitch and roll, or neither."); return; }
      const order = { command: name, latitude_deg: Number(latitude.value), heading_deg: Number(heading.value),
        pitch_roll_deg: tilted() ? [Number(pitch.value), Number(roll.value)] : null };
      if (name === "pre-launch") Object.assign(order, { duration_s: duration.value ? Number(duration.value) : null, install: install.checked });
      open.close();
      this.give(order);
    });
  }
}
