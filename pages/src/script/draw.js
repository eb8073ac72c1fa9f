// Drawing on a canvas: axes, curves, lanes, marks. A view has its place (left, top, width, height), the axis range and `to`.

const FONT = "12px system-ui, sans-serif";

/** Dashes of lines, by number: what is drawn and what is left out in turn. */
const DASHES = [[], [7, 5], [2, 4], [9, 3, 2, 3]];

/** The same as the background of a key. */
function dashed(number = 0) {
  let end = 0;
  const stops = DASHES[number % DASHES.length].map((length, i) =>
    (i % 2 ? "transparent " : "currentColor ") + end + "px " + (end += length) + "px");
  return stops.length ? "repeating-linear-gradient(to right, " + stops.join(", ") + ")" : "";
}

/** The frame, grid and labels of a panel. `y` is null for lanes. */
function drawAxes(g, view, xTicks, y, colours) {
  g.font = FONT;
  g.lineWidth = 1;
  g.strokeStyle = colours.rule;
  g.fillStyle = colours.faint;
  const bottom = view.top + view.height;
  g.textAlign = "center";
  g.textBaseline = "top";
  for (const tick of xTicks) {
    const p = Math.round(view.left + view.to(tick.value)) + 0.5;
    line(g, p, view.top, p, bottom);
    g.fillText(tick.label, Math.min(Math.max(p, 24), view.left + view.width - 16), bottom + 5);
  }
  if (y) {
    g.textAlign = "right";
    g.textBaseline = "middle";
    for (const tick of y.ticks) {
      const p = Math.round(bottom - y.to(tick.value)) + 0.5;
      line(g, view.left, p, view.left + view.width, p);
      g.fillText(tick.label, view.left - 6, p);
    }
  }
  g.strokeStyle = colours.faint;
  g.strokeRect(view.left + 0.5, view.top + 0.5, view.width - 1, view.height - 1);
}

function line(g, x1, y1, x2, y2) {
  g.beginPath();
  g.moveTo(x1, y1);
  g.lineTo(x2, y2);
  g.stroke();
}

/** Keeps what is drawn inside the panel's frame. */
function clipped(g, view, draw) {
  g.save();
  g.beginPath();
  g.rect(view.left, view.top, view.width, view.height);
  g.clip();
  draw();
  g.restore();
}

/**
 * One curve. Where many samples fall into a column, its smallest to largest is filled here; what is returned draws the line of
 * means, once all curves are filled.
 */
function drawSeries(g, view, y, s, form, { colour, paper, density, dashes = 0 }) {
  const bottom = view.top + view.height;
  const level = value => bottom - y.to(value);
  g.strokeStyle = g.fillStyle = colour;
  const [from, end] = visible(s, view.range);
  if (form === "dots") {
    const size = end - from > 2000 ? 1.5 : end - from > 200 ? 3 : 5;
    for (let i = from; i < end; i++) {
      const value = s.mean.list[i];
      if (value !== value) continue;
      g.fillRect(view.left + view.to(placeOf(s, i)) - size / 2, level(value + s.mean.middle) - size / 2, size, size);
    }
    return () => {};
  }
  // The line lies above the bands of all curves, on a rim of paper that keeps it apart from their colours.
  const lined = (count, point, rim) => () => {
    g.strokeStyle = paper;
    if (rim) strokeRuns(g, count, point, 3.5);
    g.strokeStyle = g.fillStyle = colour;
    g.setLineDash(DASHES[dashes % DASHES.length]);
    strokeRuns(g, count, point, 1.3);
    g.setLineDash([]);
  };
  const columns = Math.max(1, Math.round(view.width * density));
  if (end - from > 2 * columns) {
    const seen = columnsOf(s, view.range, columns, x => view.to(x) * density);
    g.globalAlpha = 0.38;
    for (let c = 0; c < columns; c++) {
      if (seen.min[c] !== seen.min[c]) continue;
      const [top, low] = [level(seen.max[c]), level(seen.min[c])];
      g.fillRect(view.left + c / density, top, 1 / density, Math.max(low - top, 1));
    }
    g.globalAlpha = 1;
    // A few empty columns are no gap where bins are wider than columns.
    return lined(columns, c => seen.mean[c] === seen.mean[c] ? [view.left + (c + 0.5) / density, level(seen.mean[c])] : null, true);
  }
  if (!s.single) {
    g.globalAlpha = 0.38;
    const width = Math.max(view.to(placeOf(s, 1)) - view.to(placeOf(s, 0)), 1);
    for (let i = from; i < end; i++) {
      if (s.mean.list[i] !== s.mean.list[i]) continue;
      const [top, low] = [level(s.max.list[i] + s.max.middle), level(s.min.list[i] + s.min.middle)];
      g.fillRect(view.left + view.to(placeOf(s, i)) - width / 2, top, width, Math.max(low - top, 1));
    }
    g.globalAlpha = 1;
  }
  const point = i => {
    const value = s.mean.list[from + i];
    return value === value ? [view.left + view.to(placeOf(s, from + i)), level(value + s.mean.middle)] : null;
  };
  const line = lined(end - from, point, !s.single);
  return () => {
    line();
    if (dashes || end - from >= view.width / 8) return;
    for (let i = 0; i < end - from; i++) {
      const place = point(i);
      if (place) g.fillRect(place[0] - 1.5, place[1] - 1.5, 3, 3);
    }
  };
}

/** Joins points by lines; where there is none, the line ends. */
function strokeRuns(g, count, point, width) {
  g.lineWidth = width;
  g.lineJoin = "round";
  g.beginPath();
  let drawing = false;
  for (let i = 0; i < count; i++) {
    const place = point(i);
    if (!place) { drawing = false; continue; }
    if (drawing) g.lineTo(place[0], place[1]); else g.moveTo(place[0], place[1]);
    // A point by itself shows as a dot.
    if (!drawing) g.lineTo(place[0] + 0.5, place[1]);
    drawing = true;
  }
  g.stroke();
}

/** Lines where something happened; where they would bury the curves, short ones at the upper edge. */
function drawMarks(g, view, marks, colours) {
  const inks = new Map();
  for (const mark of marks) {
    if (mark.x < view.range[0] || mark.x > view.range[1]) continue;
    inks.set(Math.round(view.left + view.to(mark.x)) + 0.5, colours[mark.ink]);
  }
  const many = inks.size > Math.max(view.width / 60, 3);
  g.lineWidth = 1.2;
  g.setLineDash(many ? [] : [5, 3]);
  for (const [p, ink] of inks) {
    g.strokeStyle = ink;
    line(g, p, view.top, p, view.top + (many ? 6 : view.height));
  }
  g.setLineDash([]);
}
