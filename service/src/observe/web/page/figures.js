// Numbers and times as people read them; as in `isotherm status`.

const NONE = "\u2013";
const DEG_PER_H = 648000 / Math.PI;
const MILLI_G = 1000 / 9.80665;

const isNumber = value => typeof value === "number" && isFinite(value);
const fixed = (value, decimals) => isNumber(value) ? grouped(value.toFixed(decimals)) : NONE;

/** About four digits, for what spans decades. */
function digits(value) {
  if (!isNumber(value)) return NONE;
  const size = Math.abs(value);
  return fixed(value, size >= 999.5 ? 0 : size >= 99.95 ? 1 : size >= 9.995 ? 2 : 3);
}

const signed = value => isNumber(value) && value > 0 ? "+" + digits(value) : digits(value);
const degPerHour = value => isNumber(value) ? value * DEG_PER_H : null;
const milliG = value => isNumber(value) ? value * MILLI_G : null;
const count = value => grouped(String(value));
const celsius = value => isNumber(value) ? fixed(value, 1) + "\u202f°C" : NONE;
const perMinute = rate => isNumber(rate) ? (rate > 0 ? "+" : "") + fixed(rate * 60, 2) : NONE;
const hertz = value => isNumber(value) ? fixed(value, value === 0 || value >= 9.95 ? 0 : 1) : NONE;
const head = digest => digest ? digest.slice(0, 12) : NONE;

function latency(ns) {
  if (!ns) return NONE;
  let value = ns;
  for (const unit of ["ns", "µs", "ms"]) {
    if (value < 999.5) return fixed(value, unit === "ns" || value >= 99.95 ? 0 : value < 9.995 ? 2 : 1) + "\u202f" + unit;
    value /= 1000;
  }
  return fixed(value, 1) + "\u202fs";
}

/** A time that has passed, in its largest unit. */
function since(seconds) {
  const s = Math.floor(Math.abs(seconds));
  const words = s < 120 ? s + " s" : s < 7200 ? Math.floor(s / 60) + " min" : s < 172800 ? Math.floor(s / 3600) + " h"
    : Math.floor(s / 86400) + " d";
  return seconds < 0 ? "in " + words : words;
}

/** The age of a calibration: in days where its document states a date only, which is midnight. */
function age(seconds, created) {
  if (seconds < 0) return since(seconds);
  if (!isNumber(created) || created % 86400 !== 0) return since(seconds) + " ago";
  const days = Math.floor(seconds / 86400);
  return days === 0 ? "today" : plural(days, "day") + " old";
}

/** A point in time, to the second, in UTC as in the audit file. */
const moment = text => text.replace("T", " ").slice(0, 19);
const plural = (number, what) => count(number) + " " + what + (number === 1 ? "" : "s");

/** A word of a command line, for a POSIX shell. */
const quoted = word => /^[\w./:@%+=,-]+$/.test(word) ? word : "'" + word.replaceAll("'", "'\\''") + "'";
