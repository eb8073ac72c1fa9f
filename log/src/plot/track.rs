//! Values over time in bounded memory: as they are while they are few, then in bins that widen as the log goes on.
//!
//! Bins are 2ᵏ ns wide and stand on a grid anchored at time 0, so that two of them always make one of the next size and no
//! value ever moves to a bin that it does not belong to. Each knows the smallest and largest value and their mean: no peak is
//! lost, however long the log is.

#[cfg(test)]
mod tests;

use std::sync::Arc;

use crate::date::seconds as seconds_of;
use isotherm_pages::{Bits, Places, Samples};

/// So many times as many ticks as bins are kept as they are: they take the same room in the file.
const EXACT: usize = 3;
/// The finest bins: 2¹⁰ ns, about a microsecond.
const FINEST: u32 = 10;

/// Smallest, largest and sum of the values of a bin.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    min: f64,
    max: f64,
    sum: f64,
    count: u32,
}

impl Cell {
    const EMPTY: Self = Self { min: f64::INFINITY, max: f64::NEG_INFINITY, sum: 0.0, count: 0 };

    fn add(&mut self, value: f64) {
        if value.is_finite() {
            self.join(Self { min: value, max: value, sum: value, count: 1 });
        }
    }

    fn join(&mut self, other: Self) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.sum += other.sum;
        self.count = self.count.saturating_add(other.count);
    }

    fn mean(&self) -> f64 {
        if self.count == 0 { f64::NAN } else { self.sum / f64::from(self.count) }
    }
}

/// Smallest, largest and mean of a whole track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Overall {
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) mean: f64,
}

/// Several values and some bits per tick, over time.
#[derive(Debug, Clone)]
pub(super) struct Track {
    /// Values per tick.
    width: usize,
    /// Most bins.
    detail: usize,
    form: Form,
    total: Vec<Cell>,
    bits: u32,
    ticks: u64,
    /// First and last time (ns).
    range: Option<[i64; 2]>,
}

#[derive(Debug, Clone)]
enum Form {
    /// Ticks as they are: times, values one tick behind the other, bits.
    Exact { times: Vec<i64>, values: Vec<f64>, bits: Vec<u32> },
    /// Bins: log2 of their width, number of the first on the grid, their cells one bin behind the other, bits.
    Bins { shift: u32, first: i64, cells: Vec<Cell>, bits: Vec<u32> },
}

impl Track {
    /// Nothing in it; of so many values per tick, with at most `detail` bins.
    pub(super) fn new(width: usize, detail: usize) -> Self {
        Self {
            width,
            detail: detail.max(2),
            form: Form::Exact { times: Vec::new(), values: Vec::new(), bits: Vec::new() },
            total: vec![Cell::EMPTY; width],
            bits: 0,
            ticks: 0,
            range: None,
        }
    }

    /// Takes a tick; of values that are not there it has NaN, and more than it was made for are left out.
    pub(super) fn push(&mut self, time_ns: i64, tick: &[f64], flags: u32) {
        let value = |index: usize| tick.get(index).copied().unwrap_or(f64::NAN);
        self.ticks += 1;
        self.bits |= flags;
        let [first, last] = self.range.unwrap_or([time_ns; 2]);
        self.range = Some([first.min(time_ns), last.max(time_ns)]);
        for (index, cell) in self.total.iter_mut().enumerate() {
            cell.add(value(index));
        }
        match &mut self.form {
            Form::Exact { times, values, bits } => {
                times.push(time_ns);
                values.extend((0..self.width).map(value));
                bits.push(flags);
                if times.len() > EXACT * self.detail {
                    self.take_bins();
                }
            }
            Form::Bins { .. } => self.enter(time_ns, &value, flags),
        }
    }

    /// A gap comes: lines are not drawn over it.
    pub(super) fn gap(&mut self, until_ns: i64) {
        if let Form::Exact { times, values, bits } = &mut self.form {
            times.push(until_ns);
            values.extend(std::iter::repeat_n(f64::NAN, self.width));
            bits.push(0);
        }
    }

    /// Makes do with fewer bins.
    pub(super) fn reduce(&mut self, detail: usize) {
        self.detail = detail.max(2);
        let exact = matches!(&self.form, Form::Exact { times, .. } if times.len() > EXACT * self.detail);
        if exact {
            self.take_bins();
        }
        while matches!(&self.form, Form::Bins { bits, .. } if bits.len() > self.detail) {
            self.coarsen();
        }
    }

    fn take_bins(&mut self) {
        let empty = Form::Bins { shift: FINEST, first: 0, cells: Vec::new(), bits: Vec::new() };
        let Form::Exact { times, values, bits } = std::mem::replace(&mut self.form, empty) else { return };
        if let (Some(low), Some(high), Form::Bins { shift, first, .. }) =
            (times.iter().min(), times.iter().max(), &mut self.form)
        {
            while (high >> *shift).abs_diff(low >> *shift) >= self.detail as u64 {
                *shift += 1;
            }
            *first = low >> *shift;
        }
        for ((time, tick), flags) in times.iter().zip(values.chunks(self.width)).zip(&bits) {
            self.enter(*time, &|index| tick.get(index).copied().unwrap_or(f64::NAN), *flags);
        }
    }

    /// Enters a tick into its bin, widening all bins as far as it takes.
    fn enter(&mut self, time_ns: i64, value: &dyn Fn(usize) -> f64, flags: u32) {
        loop {
            let (width, detail) = (self.width, self.detail as u64);
            let Form::Bins { shift, first, cells, bits } = &mut self.form else { return };
            let place = time_ns >> *shift;
            let (low, high) = if bits.is_empty() {
                (place, place)
            } else {
                let last = first.saturating_add(i64::try_from(bits.len()).unwrap_or(i64::MAX)) - 1;
                (place.min(*first), place.max(last))
            };
            if high.abs_diff(low) >= detail {
                self.coarsen();
                continue;
            }
            let before = if bits.is_empty() { 0 } else { usize::try_from(first.abs_diff(low)).unwrap_or(0) };
            if before > 0 {
                bits.splice(0..0, std::iter::repeat_n(0, before));
                cells.splice(0..0, std::iter::repeat_n(Cell::EMPTY, before * width));
            }
            *first = low;
            let count = usize::try_from(high.abs_diff(low)).unwrap_or(0) + 1;
            bits.resize(count, 0);
            cells.resize(count * width, Cell::EMPTY);
            let index = usize::try_from(place.abs_diff(low)).unwrap_or(0);
            if let Some(bits) = bits.get_mut(index) {
                *bits |= flags;
            }
            for (number, cell) in cells.iter_mut().skip(index * width).take(width).enumerate() {
                cell.add(value(number));
            }
            return;
        }
    }

    /// Joins bins two by two.
    fn coarsen(&mut self) {
        let width = self.width;
        let Form::Bins { shift, first, cells, bits } = &mut self.form else { return };
        *shift += 1;
        // An odd first bin is the second of its pair.
        let odd = usize::try_from(*first & 1).unwrap_or(0);
        *first >>= 1;
        let count = (bits.len() + odd).div_ceil(2);
        let (mut joined, mut flags) = (vec![Cell::EMPTY; count * width], vec![0; count]);
        for (index, old) in bits.iter().enumerate() {
            let to = (index + odd) >> 1;
            if let Some(flags) = flags.get_mut(to) {
                *flags |= old;
            }
            let from = cells.iter().skip(index * width).take(width);
            for (new, old) in joined.iter_mut().skip(to * width).zip(from) {
                new.join(*old);
            }
        }
        (*cells, *bits) = (joined, flags);
    }

    /// Ticks taken.
    pub(super) fn ticks(&self) -> u64 {
        self.ticks
    }

    /// First and last time (ns); `None` while it is empty.
    pub(super) fn range(&self) -> Option<[i64; 2]> {
        self.range
    }

    /// What a page shows of it; times become seconds after `origin_ns`.
    pub(super) fn finish(self, origin_ns: i64) -> Finished {
        let Self { width, form, total, bits: occurred, .. } = self;
        let (values, bits, places) = match form {
            Form::Exact { times, values, bits } => {
                let mut order: Vec<usize> = (0..times.len()).collect();
                // Late ticks go to their place; those of equal time stay as they came.
                order.sort_by_key(|&index| times.get(index));
                let seconds = |&index: &usize| {
                    seconds_of(times.get(index).map_or(0, |time| time.saturating_sub(origin_ns)))
                };
                let of_tick = |&index: &usize| values.iter().skip(index * width).take(width).copied();
                let flags = order.iter().filter_map(|&index| bits.get(index).copied()).collect();
                let places = Places::Points(order.iter().map(seconds).collect());
                (Values::Points(order.iter().flat_map(of_tick).collect()), flags, places)
            }
            Form::Bins { shift, first, cells, bits } => {
                let begin = i128::from(first) << shift;
                let after_ns = i64::try_from(begin - i128::from(origin_ns)).unwrap_or(i64::MAX);
                let places =
                    Places::Bins { first: seconds_of(after_ns), width: seconds_of(1_i64 << shift.min(62)) };
                (Values::Bins(cells), bits, places)
            }
        };
        Finished { width, values, bits: Arc::new(Bits(bits)), places, total, occurred }
    }
}

/// All values, tick by tick or bin by bin.
#[derive(Debug, Clone)]
enum Values {
    Points(Vec<f64>),
    Bins(Vec<Cell>),
}

/// A track as a page shows it.
#[derive(Debug, Clone)]
pub(super) struct Finished {
    /// Values of each tick.
    width: usize,
    values: Values,
    /// The bits of its ticks or bins.
    pub(super) bits: Arc<Bits>,
    /// Where they are.
    pub(super) places: Places,
    /// Of all ticks.
    total: Vec<Cell>,
    /// All bits that occurred.
    pub(super) occurred: u32,
}

impl Finished {
    /// Figures of one of its values, `scale` times what was taken; `None` where there is no number.
    pub(super) fn overall(&self, index: usize, scale: f64) -> Option<Overall> {
        let cell = self.total.get(index).filter(|cell| cell.count > 0)?;
        let (a, b) = (cell.min * scale, cell.max * scale);
        Some(Overall { min: a.min(b), max: a.max(b), mean: cell.mean() * scale })
    }

    /// One of its values, `scale` times what was taken; `None` where it has no such value.
    pub(super) fn samples(&self, index: usize, scale: f64) -> Option<Samples> {
        if index >= self.width {
            return None;
        }
        match (&self.values, &self.places) {
            (Values::Points(all), Places::Points(x)) => {
                let y = all.iter().skip(index).step_by(self.width).map(|y| y * scale).collect();
                Some(Samples::Points { x: Arc::clone(x), y })
            }
            (Values::Bins(cells), &Places::Bins { first, width }) => {
                let of = |value: fn(&Cell) -> f64| {
                    let scaled = |cell: &Cell| if cell.count == 0 { f64::NAN } else { value(cell) * scale };
                    cells.iter().skip(index).step_by(self.width).map(scaled).collect::<Vec<_>>()
                };
                let (a, b) = (of(|cell| cell.min), of(|cell| cell.max));
                let (min, max) = if scale < 0.0 { (b, a) } else { (a, b) };
                Some(Samples::Bins { first, width, min, max, mean: of(Cell::mean) })
            }
            _ => None,
        }
    }
}
