// What pages need and the console in the browser does not: packed numbers, a part of the axis, lanes.

/** A typed array of its bytes, first ones first, compressed and in base64. */
async function unpacked(text, type) {
  const packed = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const array = { f64: Float64Array, f32: Float32Array, u32: Uint32Array }[type];
  const [size, count] = [array.BYTES_PER_ELEMENT, planes.length / array.BYTES_PER_ELEMENT];
  const bytes = new Uint8Array(planes.length);
  for (let byte = 0; byte < size; byte++) {
    for (let i = 0; i < count; i++) bytes[i * size + byte] = planes[byte * count + i];
  }
  return new array(bytes.buffer);
}

/** What a part of the axis is after zooming by `factor` about `at`, held inside `whole`. */
function zoomed([low, high], at, factor, whole, least) {
  const span = Math.min(Math.max((high - low) * factor, least), whole[1] - whole[0]);
  const share = (at - low) / (high - low);
  return held([at - share * span, at + (1 - share) * span], whole);
}

/** A part of the axis moved so far that it lies inside `whole`. */
function held([low, high], whole) {
  const span = Math.min(high - low, whole[1] - whole[0]);
  const from = Math.min(Math.max(low, whole[0]), whole[1] - span);
  return [from, from + span];
}

/** The bits of all ticks of a column, joined. */
function bitColumns(s, range, columns, to) {
  const bits = new Uint32Array(columns);
  const [from, end] = visible(s, range);
  for (let i = from; i < end; i++) {
    if (s.bits[i] === 0) continue;
    // A bin fills its width; a tick reaches from the one before it.
    const begin = s.x ? Math.max(i > 0 ? s.x[i - 1] : s.x[i], s.x[i] - s.usual) : s.first + i * s.width;
    const stop = s.x ? s.x[i] : begin + s.width;
    const first = Math.max(Math.floor(to(begin)), 0);
    const last = Math.min(Math.max(Math.ceil(to(stop)), first + 1), columns);
    for (let c = first; c < last; c++) bits[c] |= s.bits[i];
  }
  return bits;
}

/** Rows of what is the case. */
function drawLanes(g, view, lanes, rowHeight, colours, density) {
  const columns = Math.max(1, Math.round(view.width * density));
  const cache = new Map();
  lanes.forEach((lane, row) => {
    const top = view.top + row * rowHeight + 3, height = rowHeight - 6;
    if (lane.stretches) {
      for (const part of lane.stretches) drawStretch(g, view, part, top, height, colours);
      return;
    }
    if (!cache.has(lane.samples)) {
      cache.set(lane.samples, bitColumns(lane.samples, view.range, columns, x => view.to(x) * density));
    }
    const bits = cache.get(lane.samples);
    g.fillStyle = colours[lane.ink];
    for (let c = 0; c < columns; c++) {
      if (!(bits[c] >>> lane.bit & 1)) continue;
      let end = c + 1;
      while (end < columns && bits[end] >>> lane.bit & 1) end++;
      g.fillRect(view.left + c / density, top, Math.max((end - c) / density, 1), height);
      c = end;
    }
  });
}

function drawStretch(g, view, part, top, height, colours) {
  const from = Math.max(view.to(part.from), 0), to = Math.min(view.to(part.to), view.width);
  if (to < 0 || from > view.width) return;
  g.fillStyle = colours[part.ink];
  g.globalAlpha = 0.3;
  g.fillRect(view.left + from, top, Math.max(to - from, 1), height);
  g.globalAlpha = 1;
  g.fillRect(view.left + from, top, 1.5, height);
  if (to - from < 24) return;
  g.fillStyle = colours.ink;
  g.textAlign = "left";
  g.textBaseline = "middle";
  g.save();
  g.beginPath();
  g.rect(view.left + from, top, to - from - 2, height);
  g.clip();
  g.fillText(part.label, view.left + from + 5, top + height / 2 + 0.5);
  g.restore();
}
