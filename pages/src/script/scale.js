// Axes: ranges, tick marks, how numbers and times are written. Nothing here knows the page.

/** Tick marks within [low, high], at most about `most`, at 1, 2 or 5 times a power of ten. */
function linearTicks(low, high, most) {
  const span = high - low;
  if (!(span > 0) || !isFinite(span)) return { values: [low], decimals: 0 };
  const coarse = span / Math.max(most, 2);
  let exponent = Math.floor(Math.log10(coarse));
  let factor = [1, 2, 5].find(f => f * 10 ** exponent >= coarse * (1 - 1e-9));
  if (factor === undefined) { factor = 1; exponent += 1; }
  const step = factor * 10 ** exponent;
  const values = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) values.push(i * step);
  // One mark by itself tells no scale.
  if (values.length < 2 && most < 64) return linearTicks(low, high, 2 * Math.max(most, 2));
  return { values, decimals: Math.min(Math.max(-exponent, 0), 12) };
}

/** Tick marks of a logarithmic axis: the powers of ten, and 2 and 5 times these where there is room. */
function logTicks(low, high, most) {
  const values = [];
  const decades = Math.log10(high / low);
  const factors = decades * 3 <= most || decades < 2 ? [1, 2, 5] : [1];
  const skip = Math.max(1, Math.ceil(decades / most));
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); e++) {
    if (((e % skip) + skip) % skip) continue;
    for (const f of factors) {
      const value = f * 10 ** e;
      if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) values.push(value);
    }
  }
  // Within less than one of these steps the axis is as good as linear.
  return values.length < 2 ? linearTicks(low, high, most) : { values, decimals: null };
}

/** Steps of a time axis, in seconds; below the first decimal ones. */
const TIME_STEPS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400];
const DAY = 86400;

/** Tick marks of a time axis in seconds: of days where they are many. */
function timeTicks(low, high, most) {
  const coarse = (high - low) / Math.max(most, 2);
  if (!(coarse > 0.5)) return linearTicks(low, high, most);
  if (coarse > DAY) return { values: linearTicks(low / DAY, high / DAY, most).values.map(days => days * DAY), decimals: 0 };
  const step = TIME_STEPS.find(s => s >= coarse);
  const values = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) values.push(i * step);
  return { values, decimals: 0 };
}

/** Thousands set apart by a narrow space, with a real minus sign. */
function grouped(text) {
  const negative = text.startsWith("-");
  const [whole, rest] = (negative ? text.slice(1) : text).split(".");
  const zero = /^[0.]*$/.test(whole + (rest ?? ""));
  const digits = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole;
  return (negative && !zero ? "\u2212" : "") + digits + (rest === undefined ? "" : "." + rest);
}

/** A number beside a tick mark. */
function tickLabel(value, decimals) {
  const size = Math.abs(value);
  if (decimals === null) return placed(value, size / 200);
  if (size >= 1e9) return plain(value, 3);
  if (size === 0 && decimals > 4) return "0";
  // As many digits as tell it from its neighbours.
  if (size > 0 && decimals > 5 && size < 1e-3) return plain(value, Math.max(3, Math.floor(Math.log10(size) + 1e-9) + 1 + decimals));
  return grouped(value.toFixed(decimals));
}

/** A number by itself, to so many significant digits. */
function plain(value, digits) {
  if (!isFinite(value)) return "\u2014";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e9 || size < 1e-4) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return grouped(mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa) + "\u00d710" +
      [...String(Number(exponent))].map(c => c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[c]).join("");
  }
  return grouped(value.toFixed(Math.min(Math.max(digits - 1 - Math.floor(Math.log10(size)), 0), 12)));
}

/** A place on an axis, as fine as `step`. */
function placed(x, step) {
  if (!isFinite(x)) return "\u2014";
  if (x !== 0 && (Math.abs(x) < 1e-4 || Math.abs(x) >= 1e9)) return plain(x, 3);
  const decimals = Math.min(Math.max(Math.ceil(-Math.log10(step) - 1e-9), 0), 12);
  const fixed = x.toFixed(decimals);
  return grouped(decimals ? fixed.replace(/\.?0+$/, "") : fixed);
}

/** Seconds as 1:02:03.4, 12.345 s below a minute, or whole days; `step` says how fine. */
function clock(seconds, step) {
  if (step >= DAY) return grouped((seconds / DAY).toFixed(0)) + " d";
  const decimals = step >= 1 ? 0 : Math.min(Math.ceil(-Math.log10(step) - 1e-9), 9);
  const rounded = Number(Math.abs(seconds).toFixed(decimals));
  const sign = seconds < 0 && rounded > 0 ? "\u2212" : "";
  if (rounded < 60) return sign + rounded.toFixed(decimals) + " s";
  const whole = Math.floor(rounded);
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, rounded - Math.floor(whole / 60) * 60];
  const tail = s.toFixed(decimals).padStart(decimals ? decimals + 3 : 2, "0");
  return sign + (h ? h + ":" + String(m).padStart(2, "0") : m) + ":" + tail;
}

/** A range with a share of itself more at either end. */
function widened([low, high], share, logarithmic) {
  if (logarithmic) return widened([Math.log(low), Math.log(high)], share, false).map(Math.exp);
  const by = share * (high - low);
  return [low - by, high + by];
}

/** Place on the axis to pixel, and back. */
function mapping([low, high], pixels, logarithmic) {
  if (!logarithmic) {
    const scale = pixels / (high - low);
    return { to: x => (x - low) * scale, from: p => low + p / scale };
  }
  const [l, h] = [Math.log(low), Math.log(high)];
  const scale = pixels / (h - l);
  return { to: x => (Math.log(x) - l) * scale, from: p => Math.exp(l + p / scale) };
}

/**
 * What has one colour and the same dashes in several panels, or is in the only one, is named above all of them; what is in one panel by
 * itself, or has other colours elsewhere, beside each panel that it is in, where there is more than one curve to tell apart.
 */
function legends(panels) {
  const found = new Map();
  panels.forEach((panel, index) => {
    for (const { name, ink, dashes } of panel.series ?? []) {
      if (!found.has(name)) found.set(name, { key: { ink, dashes }, inks: new Set(), panels: new Set() });
      found.get(name).inks.add(ink + " " + dashes);
      found.get(name).panels.add(index);
    }
  });
  const drawn = panels.filter(panel => panel.series?.length).length;
  const shared = new Map();
  for (const [name, { key, inks, panels: all }] of found) {
    if (inks.size === 1 && (all.size > 1 || drawn === 1)) shared.set(name, key);
  }
  const own = panels.map(panel => {
    const names = new Map((panel.series ?? []).map(({ name, ink, dashes }) => [name, { ink, dashes }]));
    return names.size < 2 ? new Map() : new Map([...names].filter(([name]) => !shared.has(name)));
  });
  return { shared, own };
}
