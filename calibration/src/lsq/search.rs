//! Smallest value of a function of one, two or three numbers.

/// Steps of the search along a line: 0.618^64 of the interval is left.
const STEPS: usize = 64;
/// Points of the coarse look at the interval.
const COARSE: u32 = 12;
/// Most steps of the simplex.
const SIMPLEX_STEPS: usize = 160;
/// Spread of the values at which the simplex has arrived.
const ARRIVED: f64 = 1e-4;

/// Place and value of the smallest value in an interval: a coarse look, then golden sections about the best.
pub fn golden([low, high]: [f64; 2], value: impl Fn(f64) -> f64) -> (f64, f64) {
    const SECTION: f64 = 0.618_033_988_749_894_9;
    let step = (high - low) / f64::from(COARSE);
    let coarse = (0..=COARSE).map(|index| low + step * f64::from(index)).map(|place| (place, value(place)));
    let best = coarse.fold((low, f64::INFINITY), |best, now| if now.1 < best.1 { now } else { best });
    let at = |place: f64| (place, value(place));
    let [mut left, mut right] = [(best.0 - step).max(low), (best.0 + step).min(high)];
    let mut inner = [at(right - SECTION * (right - left)), at(left + SECTION * (right - left))];
    for _ in 0..STEPS {
        if right - left < 1e-6 {
            break;
        }
        if inner[0].1 < inner[1].1 {
            right = inner[1].0;
            inner = [at(right - SECTION * (right - left)), inner[0]];
        } else {
            left = inner[0].0;
            inner = [inner[1], at(left + SECTION * (right - left))];
        }
    }
    if inner[0].1 < inner[1].1 { inner[0] } else { inner[1] }
}

/// Place and value of the smallest value near a start, by the simplex of Nelder and Mead.
pub fn simplex(start: [f64; 3], steps: [f64; 3], f: impl Fn([f64; 3]) -> f64) -> ([f64; 3], f64) {
    let mut points = vec![(start, f(start))];
    for axis in 0..3 {
        let mut point = start;
        point[axis] += steps[axis];
        points.push((point, f(point)));
    }
    for _ in 0..SIMPLEX_STEPS {
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, worst) = (points[0].1, points[3]);
        if (worst.1 - best).abs() < ARRIVED {
            break;
        }
        let centre = [0, 1, 2].map(|axis| (points[0].0[axis] + points[1].0[axis] + points[2].0[axis]) / 3.0);
        let along = |share: f64| [0, 1, 2].map(|axis| centre[axis] + share * (centre[axis] - worst.0[axis]));
        let reflected = (along(1.0), f(along(1.0)));
        let mut next = reflected;
        if reflected.1 < best {
            let expanded = (along(2.0), f(along(2.0)));
            if expanded.1 < reflected.1 {
                next = expanded;
            }
        } else if reflected.1 >= points[2].1 {
            let inside = along(if reflected.1 < worst.1 { 0.5 } else { -0.5 });
            next = (inside, f(inside));
        }
        if next.1 < worst.1.min(reflected.1) || reflected.1 < points[2].1 {
            points[3] = next;
        } else {
            let to = points[0].0;
            for point in points.iter_mut().skip(1) {
                point.0 = [0, 1, 2].map(|axis| 0.5 * (point.0[axis] + to[axis]));
                point.1 = f(point.0);
            }
        }
    }
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    points[0]
}

/// Place of the smallest value within limits: from the best of some starts by ever smaller steps along and across the axes, until the
/// first step is below `until`.
pub fn compass(
    starts: impl Iterator<Item = [f64; 2]>,
    mut step: [f64; 2],
    until: f64,
    limits: [[f64; 2]; 2],
    f: impl Fn([f64; 2]) -> f64,
) -> [f64; 2] {
    const AROUND: [[f64; 2]; 8] = [
        [1.0, 0.0],
        [-1.0, 0.0],
        [0.0, 1.0],
        [0.0, -1.0],
        [1.0, 1.0],
        [-1.0, -1.0],
        [1.0, -1.0],
        [-1.0, 1.0],
    ];
    let mut best = ([0.0; 2], f64::INFINITY);
    for at in starts {
        let value = f(at);
        if value < best.1 {
            best = (at, value);
        }
    }
    while step[0] > until {
        let around = AROUND.map(|way| [0, 1].map(|axis| best.0[axis] + way[axis] * step[axis]));
        let inside = |at: &[f64; 2]| at.iter().zip(limits).all(|(x, [low, high])| (low..=high).contains(x));
        let tried = around.into_iter().filter(inside).map(|at| (at, f(at)));
        match tried.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some(better) if better.1 < best.1 => best = better,
            _ => step = step.map(|s| 0.5 * s),
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn valleys_are_found_from_afar() {
        let (place, value) = golden([-10.0, 10.0], |x| (x - 1.7) * (x - 1.7) + 3.0);
        assert!((place - 1.7).abs() < 1e-5 && (value - 3.0).abs() < 1e-9);
        let rosenbrock = |x: f64, y: f64| (1.0 - x) * (1.0 - x) + 5.0 * (y - x * x) * (y - x * x);
        let (place, _) = simplex([-1.0, 1.5, 0.3], [0.5; 3], |[x, y, z]| rosenbrock(x, y) + z * z);
        assert!(place.iter().zip([1.0, 1.0, 0.0]).all(|(x, y)| (x - y).abs() < 0.05), "{place:?}");
        let starts = [[-2.0, 2.0], [0.0, 0.0]].into_iter();
        let [x, y] = compass(starts, [0.5, 0.5], 1e-5, [[-3.0, 3.0]; 2], |[x, y]| rosenbrock(x, y));
        assert!((x - 1.0).abs() < 1e-2 && (y - 1.0).abs() < 2e-2, "{x} {y}");
        // At the edge of what is allowed.
        let edge = compass([[0.0, 0.0]].into_iter(), [0.5, 0.5], 1e-6, [[-1.0, 1.0]; 2], |[x, y]| {
            (x - 4.0).abs() + (y + 0.25).abs()
        });
        assert!((edge[0] - 1.0).abs() < 1e-5 && (edge[1] + 0.25).abs() < 1e-5, "{edge:?}");
    }
}
