//! Steps of least norm: the smallest change of many lengths and curvatures that moves an end by x, y and
//! heading, which Newton's method asks for again and again.

/// What moves an end: x, y, heading.
pub(crate) type Move = [f64; 3];

/// λ, such that Σ `column`·(`column`·λ) over all `columns` is `target`: the change of the parameter of a
/// column is `column`·λ ([`dot`]). `damping` is added to the diagonal, a share of its mean; with none, a
/// determinant of `singular` or less gives `None`.
pub(crate) fn multipliers(
    columns: impl Iterator<Item = Move>,
    target: Move,
    damping: f64,
    singular: f64,
) -> Option<Move> {
    let mut m = [[0.0; 3]; 3];
    for column in columns {
        for (row, r) in m.iter_mut().zip(column) {
            for (entry, c) in row.iter_mut().zip(column) {
                *entry += r * c;
            }
        }
    }
    let extra = damping * (m[0][0] + m[1][1] + m[2][2]) / 3.0;
    (0..3).for_each(|i| m[i][i] += extra);
    solve(m, target, singular)
}

/// The scalar product.
pub(crate) fn dot(a: Move, b: Move) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The solution of `m`·x = `b` for a symmetric `m`, by Cramer's rule.
fn solve(m: [Move; 3], b: Move, singular: f64) -> Option<Move> {
    let cross = |a: Move, b: Move| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let cofactors = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])];
    let determinant = dot(m[0], cofactors[0]);
    let is_regular = determinant.abs() > singular;
    let row = |r: usize| (0..3).map(|i| cofactors[i][r] * b[i]).sum::<f64>() / determinant;
    is_regular.then(|| [row(0), row(1), row(2)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_lead_to_the_target_and_none_is_smaller() {
        let columns = [[1.0, 0.2, 0.0], [0.3, -1.0, 0.4], [0.0, 0.5, 1.0], [0.7, 0.7, -0.2]];
        let target = [0.3, -0.2, 0.1];
        let by = multipliers(columns.into_iter(), target, 0.0, 1e-12).unwrap();
        let step = columns.map(|c| dot(c, by));
        for (i, wanted) in target.into_iter().enumerate() {
            let reached: f64 = columns.iter().zip(step).map(|(c, s)| c[i] * s).sum();
            assert!((reached - wanted).abs() < 1e-12, "{reached} {wanted}");
        }
        // A step of least norm has no part that moves nothing: it is orthogonal to the columns' kernel.
        let three = multipliers(columns[..3].iter().copied(), target, 0.0, 1e-12).unwrap();
        let norm = |step: &[f64]| step.iter().map(|s| s * s).sum::<f64>();
        let of_three: Vec<_> = columns[..3].iter().map(|c| dot(*c, three)).collect();
        assert!(norm(&step) <= norm(&of_three));
    }

    #[test]
    fn columns_that_do_not_reach_everywhere_need_damping() {
        let columns = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
        let target = [0.5, 0.25, 0.0];
        assert_eq!(multipliers(columns.into_iter(), target, 0.0, 1e-12), None);
        let by = multipliers(columns.into_iter(), target, 1e-12, 0.0).unwrap();
        let step = columns.map(|c| dot(c, by));
        assert!((step[0] - 0.25).abs() < 1e-9 && (step[1] - 0.25).abs() < 1e-9, "{step:?}");
    }
}
