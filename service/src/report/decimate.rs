//! Fewer points for the same picture: smallest and largest of every interval stay, so that no peak is lost.

/// At most `most` of the points, which must be in the order of x; all of them where they are few enough.
pub(super) fn decimate(points: &[[f64; 2]], most: usize) -> Vec<[f64; 2]> {
    if points.len() <= most.max(4) {
        return points.to_vec();
    }
    let group = points.len().div_ceil((most / 2).max(2));
    let mut kept = Vec::with_capacity(most);
    for group in points.chunks(group) {
        let indexed = || group.iter().map(|point| point[1]).enumerate().filter(|(_, y)| y.is_finite());
        let low = indexed().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = indexed().max_by(|a, b| a.1.total_cmp(&b.1));
        let (Some((low, _)), Some((high, _))) = (low, high) else { continue };
        kept.push(group[low.min(high)]);
        if low != high {
            kept.push(group[low.max(high)]);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_stay_and_the_order_too() {
        let mut points: Vec<_> = (0..100_000).map(|x| [f64::from(x), f64::from(x % 7)]).collect();
        points[54_321][1] = 1e6;
        points[777][1] = -1e6;
        let kept = decimate(&points, 2000);
        assert!(kept.len() <= 2000 && kept.len() > 1900, "{}", kept.len());
        assert!(kept.contains(&[54_321.0, 1e6]) && kept.contains(&[777.0, -1e6]));
        assert!(kept.is_sorted_by(|a, b| a[0] < b[0]));
    }

    #[test]
    fn few_points_stay_as_they_are() {
        let points = [[0.0, 1.0], [1.0, 2.0]];
        assert_eq!(decimate(&points, 2000), points);
    }
}
