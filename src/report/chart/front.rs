//! The Pareto front.

/// Indices of the points `(x, y)` to which no other is better or equal in both and better in one, where less is
/// better: the Pareto front, by rising x. Of equal points, the first. Points must be numbers.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut best = f64::INFINITY;
    order.retain(|&i| {
        let better = points[i].1 < best;
        best = best.min(points[i].1);
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::front;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        assert!(front(&[]).is_empty());
        let points = [(3.0, 1.0), (1.0, 5.0), (2.0, 5.0), (2.0, 2.0), (3.0, 1.0), (4.0, 0.5), (1.0, 6.0)];
        assert_eq!(front(&points), [1, 3, 0, 5]);
    }
}
