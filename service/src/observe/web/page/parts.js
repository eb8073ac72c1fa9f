// Pieces that pages are put together from. Text goes in as text: nothing that somebody wrote becomes part of the page's form.

// An element with properties and children; `null` children are left out.
/** @type {(tag: string, properties?: object, ...children: any[]) => any} */
function make(tag, properties, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties ?? {})) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name in made && !name.includes("-")) made[name] = value;
    else made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.filter(child => child !== null && child !== undefined));
  return made;
}

/** Sets a text where it has changed: what stays is not touched, and neither is what is selected in it. */
function say(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

const MARKS = { fault: "!", gone: "×", warning: "▲", note: "●", fine: "●" };
const LEVELS = { fault: "Fault", gone: "Gone", warning: "Warning", note: "Note", fine: "Fine" };

/** The mark of a level: the shape says what the colour says. */
function setMark(node, level, running = true) {
  const idle = !running && (level === "fine" || level === "note");
  say(node, idle ? "○" : MARKS[level]);
  node.className = "mark " + (idle ? "idle" : level);
  node.title = idle ? "Not running" : LEVELS[level];
}

const READ_ONLY = "This console is read-only: write = true under [web] in the service's configuration allows changes.";

/** A button that copies a text. */
function copyButton(words, text, title) {
  const button = make("button", { type: "button", className: "copy", title }, words);
  button.addEventListener("click", async () => {
    await copy(typeof text === "function" ? text() : text);
    say(button, "Copied");
    setTimeout(() => say(button, words), 1500);
  });
  return button;
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // Without TLS, and not on this machine, browsers keep the clipboard to themselves: the old way.
    const area = make("textarea", { value: text, className: "offscreen" });
    (document.querySelector("dialog[open]") ?? document.body).append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
}

/** The line that does the same in a terminal. */
function commandLine(text) {
  const line = make("code", {}, text());
  const row = make("p", { className: "line" }, line, copyButton("Copy as command", () => line.textContent));
  row.renew = () => say(line, text());
  return row;
}

/** A temperature against the range that the calibration was fitted over. */
function rangeBar() {
  const inside = make("i", { className: "inside" }), needle = make("i", { className: "needle" });
  const bar = make("span", { className: "range", role: "img" }, inside, needle);
  bar.show = (value, range, odd) => {
    bar.classList.toggle("odd", odd);
    inside.hidden = !range;
    needle.hidden = !isNumber(value);
    const [low, high] = range ?? [value - 10, value + 10];
    const room = Math.max((high - low) * 0.18, 1);
    const place = at => 100 * Math.min(Math.max((at - low + room) / (high - low + 2 * room), 0.01), 0.99);
    inside.style.left = place(low) + "%";
    inside.style.right = 100 - place(high) + "%";
    if (isNumber(value)) needle.style.left = place(value) + "%";
    bar.setAttribute("aria-label", range ? celsius(value) + ", calibrated from " + range[0] + " to " + range[1] + " °C" : celsius(value));
  };
  return bar;
}

/** A part of a page under a heading; `wide` takes the whole width. */
function card(title, className, ...children) {
  const heading = make("h2", {}, title);
  const made = make("section", { className: "card " + (className ?? "") }, heading, ...children);
  made.heading = heading;
  made.setAttribute("aria-label", title);
  return made;
}

/** A table whose rows are kept: `show` takes lists of texts, or of nodes that stay the same. */
function figureTable(columns) {
  const body = make("tbody");
  const header = make("tr", {}, ...columns.map(name => make("th", { scope: "col" }, name)));
  const table = make("table", {}, make("thead", {}, header), body);
  const box = make("div", { className: "scroll", tabIndex: 0, role: "group" }, table);
  box.show = rows => {
    while (body.rows.length > rows.length) body.deleteRow(-1);
    rows.forEach((cells, index) => {
      const row = body.rows[index] ?? body.insertRow();
      cells.forEach((cell, at) => {
        const made = row.cells[at] ?? row.appendChild(make(at ? "td" : "th", at ? {} : { scope: "row" }));
        if (!(cell instanceof Node)) say(made, cell);
        else if (made.firstChild !== cell) made.replaceChildren(cell);
      });
    });
  };
  return box;
}

/** Names and values, one under the other. */
function facts() {
  const list = make("dl", { className: "facts" });
  list.show = pairs => {
    const shown = pairs.filter(pair => pair[1] !== null);
    while (list.children.length > 2 * shown.length) list.lastChild.remove();
    shown.forEach(([name, value], index) => {
      const term = list.children[2 * index] ?? list.appendChild(make("dt"));
      const definition = list.children[2 * index + 1] ?? list.appendChild(make("dd"));
      say(term, name);
      if (value instanceof Node) { if (definition.firstChild !== value) definition.replaceChildren(value); } else say(definition, value);
    });
  };
  return list;
}

/** A window over the page; it goes with Escape and gives the focus back. */
function dialog(title, ...children) {
  const close = make("button", { type: "button", className: "close", "aria-label": "Close", onclick: () => made.close() }, "×");
  const made = make("dialog", { "aria-label": title }, make("h2", {}, title), close, ...children);
  document.body.append(made);
  made.addEventListener("close", () => made.remove());
  made.showModal();
  made.querySelector("input, select, textarea")?.focus();
  return made;
}

/** A field with its name. */
const field = (name, input, hint) => make("label", { className: "field" }, make("span", {}, name), input, hint ? make("small", {}, hint) : null);
