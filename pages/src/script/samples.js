// The numbers of a chart: reading them, and what of them falls into a column of pixels. Nothing here knows the page.

/** Samples with their lists read; `list` gives the array of a reference. */
function resolved(samples, list) {
  const values = ref => ({ list: list(ref), middle: ref.middle ?? 0 });
  if (samples.bits) {
    const bits = list(samples.bits);
    const s = { count: bits.length, bits, ...places(samples, list) };
    // Ticks behind a gap reach no further back than others.
    s.usual = s.x && s.count > 1 ? 3 * (s.x[s.count - 1] - s.x[0]) / (s.count - 1) : 0;
    return s;
  }
  if (samples.y) {
    const y = values(samples.y);
    return { count: y.list.length, min: y, max: y, mean: y, single: true, ...places(samples, list) };
  }
  const [min, max, mean] = [samples.min, samples.max, samples.mean].map(values);
  return { count: mean.list.length, min, max, mean, single: false, ...places(samples, list) };
}

function places(samples, list) {
  return samples.x ? { x: list(samples.x) } : { first: samples.first, width: samples.width };
}

/** Where sample `i` is; of a bin, its middle. */
function placeOf(s, i) {
  return s.x ? s.x[i] : s.first + (i + 0.5) * s.width;
}

/** First sample at or behind `x`; of bins, the first that ends behind it. */
function firstFrom(s, x) {
  if (!s.x) return Math.min(Math.max(Math.floor((x - s.first) / s.width), 0), s.count);
  let [low, high] = [0, s.count];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (s.x[middle] < x) low = middle + 1; else high = middle;
  }
  return low;
}

/** The samples of a part of the axis, with one more at each side: [from, to). */
function visible(s, [low, high]) {
  return [Math.max(firstFrom(s, low) - 1, 0), Math.min(firstFrom(s, high) + 2, s.count)];
}

/** The sample nearest to `x`, or -1. */
function nearest(s, x) {
  if (!s.count) return -1;
  const i = Math.min(firstFrom(s, x), s.count - 1);
  return i > 0 && Math.abs(placeOf(s, i - 1) - x) < Math.abs(placeOf(s, i) - x) ? i - 1 : i;
}

/** The extent of all places. */
function extentOf(s) {
  if (!s.count) return [Infinity, -Infinity];
  if (!s.x) return [s.first, s.first + s.count * s.width];
  let [low, high] = [Infinity, -Infinity];
  for (const x of s.x) { if (x < low) low = x; if (x > high) high = x; }
  return [low, high];
}

/** Smallest, largest and mean of what falls into each of `columns` columns; NaN where nothing does. */
function columnsOf(s, range, columns, to) {
  const min = new Float64Array(columns).fill(NaN), max = new Float64Array(columns).fill(NaN);
  const mean = new Float64Array(columns).fill(NaN), counts = new Uint32Array(columns);
  const [from, end] = visible(s, range);
  const [lows, highs, means] = [s.min.list, s.max.list, s.mean.list];
  for (let i = from; i < end; i++) {
    const value = means[i];
    if (value !== value) continue;
    const c = Math.floor(to(placeOf(s, i)));
    if (!(c >= 0 && c < columns)) continue;
    const low = lows[i], high = highs[i];
    if (counts[c] === 0) { min[c] = low; max[c] = high; mean[c] = value; }
    else {
      if (low < min[c]) min[c] = low;
      if (high > max[c]) max[c] = high;
      mean[c] += value;
    }
    counts[c]++;
  }
  for (let c = 0; c < columns; c++) {
    if (counts[c] === 0) continue;
    mean[c] = mean[c] / counts[c] + s.mean.middle;
    min[c] += s.min.middle;
    max[c] += s.max.middle;
  }
  return { min, max, mean };
}

/** The value range of a part of the axis: of all extremes, or, without outliers, of 98 in 100 means. */
function valueRange(list, range, withoutOutliers) {
  let [low, high] = [Infinity, -Infinity];
  for (const s of list) {
    const [from, end] = visible(s, range);
    if (withoutOutliers) {
      const step = Math.max(1, Math.floor((end - from) / 4000));
      const means = [];
      for (let i = from; i < end; i += step) if (isFinite(s.mean.list[i])) means.push(s.mean.list[i]);
      if (!means.length) continue;
      means.sort((a, b) => a - b);
      low = Math.min(low, means[Math.floor(0.01 * (means.length - 1))] + s.mean.middle);
      high = Math.max(high, means[Math.ceil(0.99 * (means.length - 1))] + s.mean.middle);
      continue;
    }
    const [lows, highs] = [s.min.list, s.max.list];
    let [l, h] = [Infinity, -Infinity];
    for (let i = from; i < end; i++) { if (lows[i] < l) l = lows[i]; if (highs[i] > h) h = highs[i]; }
    low = Math.min(low, l + s.min.middle);
    high = Math.max(high, h + s.max.middle);
  }
  return low <= high ? [low, high] : null;
}
