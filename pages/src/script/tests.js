// Tests of scale.js, samples.js and pages.js, run behind them by tests.rs.

const values = ticks => ticks.values.map(value => Number(value.toPrecision(12)));
const equal = assert.deepStrictEqual;

// Ticks and labels.
equal(values(linearTicks(0, 10, 5)), [0, 2, 4, 6, 8, 10]);
equal(values(linearTicks(-1.3, 1.1, 5)), [-1, -0.5, 0, 0.5, 1]);
equal(linearTicks(3, 3, 4).values, [3]);
equal(linearTicks(9.80665, 9.80667, 4).values.length, 5);
equal(values(timeTicks(0, 3600, 8)), [0, 600, 1200, 1800, 2400, 3000, 3600]);
equal(values(timeTicks(0, 40 * DAY, 8)), [0, 5, 10, 15, 20, 25, 30, 35, 40].map(days => days * DAY));
equal([clock(5 * DAY, 5 * DAY), clock(-2 * DAY, DAY), clock(5 * DAY, DAY / 2)], ["5 d", "\u22122 d", "120:00:00"]);
equal(values(timeTicks(0, 0.01, 5)), [0, 0.002, 0.004, 0.006, 0.008, 0.01]);
equal(values(logTicks(0.9, 1200, 8)), [1, 10, 100, 1000]);
equal(values(logTicks(1, 50, 9)), [1, 2, 5, 10, 20, 50]);
equal(tickLabel(-0.5, 1), "\u22120.5");
equal(tickLabel(-0.0001, 2), "0.00");
equal(tickLabel(123456, 0), "123\u202f456");
equal([0.0001845, 0.0001846].map(value => tickLabel(value, 7)), ["0.0001845", "0.0001846"]);
equal(tickLabel(9.3e-5, 8), "9.3\u00d710\u207b\u2075");
equal([0, -5e-6].map(value => tickLabel(value, 9)), ["0", "\u22125\u00d710\u207b\u2076"]);
equal([100, 1, 0.05, 1e-5].map(value => tickLabel(value, null)), ["100", "1", "0.05", "1\u00d710\u207b\u2075"]);
// One mark by itself tells no scale.
assert(linearTicks(-3.6, 4.4, 2).values.length > 1 && linearTicks(-0.9, 0.9, 2).values.length > 1);
for (const [low, high] of [[2.1, 4.9], [0.3, 7], [30, 400], [3, 3.4]]) assert(logTicks(low, high, 2).values.length > 1);
equal([0.1666667, 48, -0.001].map(x => placed(x, 0.048)), ["0.17", "48", "0"]);
equal([placed(0.1, 1e-3), placed(120, 1), placed(1e-6, 1e-9)], ["0.1", "120", "1\u00d710\u207b\u2076"]);
equal(widened([0, 10], 0.1, false), [-1, 11]);
assert(widened([1, 100], 0.5, true).every((value, i) => Math.abs(value / [0.1, 1000][i] - 1) < 1e-12));
equal(plain(15.0410671, 6), "15.0411");
equal(plain(1.5e-7, 3), "1.5\u00d710\u207b\u2077");
equal(plain(-2e12, 3), "\u22122\u00d710\u00b9\u00b2");
equal(plain(NaN, 3), "\u2014");
equal(clock(3.5, 0.1), "3.5 s");
equal(clock(61, 1), "1:01");
equal(clock(3723.25, 0.01), "1:02:03.25");
equal(clock(-90, 1), "\u22121:30");
equal(clock(59.9999, 0.1), "1:00.0");

// Legends: a colour is said where it is right.
const curves = (...all) => ({ series: all.map(([name, ink, dashes = 0]) => ({ name, ink, dashes })) });
const keys = all => [...all].map(([name, { ink }]) => [name, ink]);
const both = curves(["before", "raw"], ["after", "corrected"]);
const said = legends([both, both, curves(["of x", "first"], ["of y", "second"]), { lanes: [] }]);
equal(keys(said.shared), [["before", "raw"], ["after", "corrected"]]);
equal(said.own.map(keys), [[], [], [["of x", "first"], ["of y", "second"]], []]);
const mixed = legends([curves(["x", "first"], ["z", "third"]), curves(["z", "first"], ["x", "first"])]);
equal([keys(mixed.shared), mixed.own.map(keys)], [[["x", "first"]], [[["z", "third"]], [["z", "first"]]]]);
equal([...legends([both]).shared].length, 2);
// Lines of one colour differ by their dashes, which are in the key.
const dashes = legends([curves(["x", "first"], ["y", "first", 1]), curves(["z", "first"], ["y", "first", 2])]);
equal([keys(dashes.shared), dashes.own.map(own => own.get("y").dashes)], [[], [1, 2]]);

// Mapping, zooming, moving.
for (const logarithmic of [false, true]) {
  const map = mapping([2, 50], 960, logarithmic);
  assert(Math.abs(map.to(2)) < 1e-9 && Math.abs(map.to(50) - 960) < 1e-9);
  assert(Math.abs(map.from(map.to(7)) - 7) < 1e-9);
}
equal(zoomed([0, 100], 25, 0.5, [0, 100], 1e-9), [12.5, 62.5]);
equal(zoomed([0, 100], 25, 4, [0, 100], 1e-9), [0, 100]);
equal(zoomed([40, 60], 60, 2, [0, 70], 1e-9), [20, 60]);
equal(zoomed([40, 60], 40, 2, [0, 70], 1e-9), [30, 70]);
equal(zoomed([0, 1], 0.5, 1e-12, [0, 1], 0.01), [0.495, 0.505]);
equal(held([-10, 10], [0, 100]), [0, 20]);
equal(held([95, 115], [0, 100]), [80, 100]);

// Reading lists.

// Points: what is visible, what is near, what falls into columns.
const lists = [new Float64Array(10000).map((_, i) => i), new Float32Array(10000).map((_, i) => i % 7), new Uint32Array(10000)];
lists[1][5432] = 1000; lists[1][77] = -1000; lists[1][200] = NaN; lists[2][5432] = 4; lists[2][9] = 1;
const list = ref => lists[ref.list];
const points = resolved({ x: { list: 0 }, y: { list: 1, middle: 10 } }, list);
equal([points.count, points.single], [10000, true]);
equal(visible(points, [100, 200]), [99, 202]);
equal(nearest(points, 99.6), 100);
equal(nearest(points, -5), 0);
equal(nearest(points, 1e9), 9999);
equal(extentOf(points), [0, 9999]);
const map = mapping([0, 10000], 100, false);
const seen = columnsOf(points, [0, 10000], 100, map.to);
equal([Math.max(...seen.max), Math.min(...seen.min)], [1010, -990]);
equal([seen.max[54], seen.min[0]], [1010, -990]);
assert(seen.mean.every(mean => mean === mean && Math.abs(mean - 13) < 11));
// Every sample is in the column it belongs to, at any zoom, and none of its extremes is lost.
for (const range of [[0, 10000], [5000, 5600], [70, 80], [5431.5, 5432.5]]) {
  const { to } = mapping(range, 64, false);
  const got = columnsOf(points, range, 64, to);
  const expected = Array.from({ length: 64 }, () => [Infinity, -Infinity]);
  for (let i = 0; i < 10000; i++) {
    const c = Math.floor(to(i)), value = lists[1][i] + 10;
    if (c < 0 || c >= 64 || value !== value) continue;
    expected[c] = [Math.min(expected[c][0], value), Math.max(expected[c][1], value)];
  }
  expected.forEach(([low, high], c) => {
    if (low > high) assert(got.min[c] !== got.min[c], "column " + c + " is empty");
    else equal([got.min[c], got.max[c]], [low, high]);
  });
}
equal(valueRange([points], [0, 10000], false), [-990, 1010]);
equal(valueRange([points], [1000, 2000], false), [10, 16]);
const [low, high] = valueRange([points], [0, 10000], true);
assert(low >= 10 && high <= 16);
equal(valueRange([], [0, 1], false), null);

// Bins.
const bins = resolved({ first: 5, width: 10, min: { list: 3 }, max: { list: 4 }, mean: { list: 5 } },
  ref => [new Float32Array([0, -5, NaN, 2]), new Float32Array([1, 9, NaN, 2]), new Float32Array([0.5, 1, NaN, 2])][ref.list - 3]);
equal([placeOf(bins, 0), firstFrom(bins, 15), firstFrom(bins, 14.9), firstFrom(bins, -9), firstFrom(bins, 99)], [10, 1, 0, 0, 4]);
equal(extentOf(bins), [5, 45]);
equal(valueRange([bins], [5, 45], false), [-5, 9]);
const few = columnsOf(bins, [5, 45], 4, mapping([5, 45], 4, false).to);
equal([[...few.min], [...few.max], [...few.mean]], [[0, -5, NaN, 2], [1, 9, NaN, 2], [0.5, 1, NaN, 2]]);

// Bits: joined in each column, and a bin fills its width.
const flags = resolved({ x: { list: 0 }, bits: { list: 2 } }, list);
const joined = bitColumns(flags, [0, 10000], 100, map.to);
equal([joined[54], joined[0], joined[50]], [4, 1, 0]);
const wide = resolved({ first: 0, width: 10, bits: { list: 0 } }, () => new Uint32Array([0, 2, 0]));
equal([...bitColumns(wide, [0, 30], 30, mapping([0, 30], 30, false).to)].map((bits, c) => bits ? c : -1).filter(c => c >= 0),
  [10, 11, 12, 13, 14, 15, 16, 17, 18, 19]);

// Lists as the page has them.
const packed = [["eJxjYEAGqQwMZ38wnbU/4AgAFTEEOg", "f64", [1.5, -2.25, 1e9]], ["eJxjLGAQZGBkYAAAA3gAhA", "u32", [1, 70000]]];
Promise.all(packed.map(async ([text, type, list]) => equal([...await unpacked(text, type)], list))).then(() => console.log("done"));
