//! How good a tetrahedron is.

use supine_space::Vector;

/// Sines of obtuse dihedral angles count this much less: 140° is then as bad as 33°.
const OBTUSE: f64 = 0.85;
/// Weight of the volume-length ratio. The sine alone lets needles through.
const NEEDLE: f64 = 1.15;

/// Six times the signed volume, mm³.
#[inline]
pub(crate) fn det(p: &[Vector; 4]) -> f64 {
    (p[1] - p[0]).cross(&(p[2] - p[0])).dot(&(p[3] - p[0]))
}

/// Quality of a tetrahedron: the smaller of its least (biased) dihedral sine and
/// 1.15 x 6 sqrt2 V / l_rms³; negative when it is flat or inverted.
///
/// The sine at the edge kl between the faces i and j is 6V |kl| / (|n_i| |n_j|), with n twice the
/// face's area vector.
#[inline]
pub(crate) fn shape(p: &[Vector; 4]) -> f64 {
    let (a, b, c) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
    let n3 = a.cross(&b);
    let det = n3.dot(&c);
    if det.is_nan() || det <= 1e-9 {
        return -1.0;
    }
    let (n1, n2) = (b.cross(&c), c.cross(&a));
    let n0 = -(n1 + n2 + n3);
    let (l23, l13, l12) = (c - b, c - a, b - a);
    let l = [a, b, c, l12, l13, l23].map(|e| e.norm_squared());
    let s = [n0, n1, n2, n3].map(|n| n.norm_squared());
    let sine = |length: f64, i: usize, j: usize, cosine: f64| {
        let plain = length / (s[i] * s[j]);
        if cosine > 0.0 { OBTUSE * OBTUSE * plain } else { plain }
    };
    let least = sine(l[0], 2, 3, n2.dot(&n3))
        .min(sine(l[1], 1, 3, n1.dot(&n3)))
        .min(sine(l[2], 1, 2, n1.dot(&n2)))
        .min(sine(l[3], 0, 3, n0.dot(&n3)))
        .min(sine(l[4], 0, 2, n0.dot(&n2)))
        .min(sine(l[5], 0, 1, n0.dot(&n1)));
    let mean = l.iter().sum::<f64>() / 6.0;
    let needle = NEEDLE * std::f64::consts::SQRT_2 * det / (mean * mean.sqrt());
    (det * least.sqrt()).min(needle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sine_is_that_of_the_worst_dihedral() {
        let p = [
            Vector::new(0.1, 0.2, -0.1),
            Vector::new(1.3, 0.1, 0.2),
            Vector::new(0.2, 1.1, 0.1),
            Vector::new(0.9, 0.8, 0.35),
        ];
        let normal = |a: usize, b: usize, c: usize| (p[b] - p[a]).cross(&(p[c] - p[a])).normalize();
        let n = [normal(1, 2, 3), normal(0, 3, 2), normal(0, 1, 3), normal(0, 2, 1)];
        let mut want = f64::INFINITY;
        for i in 0..4 {
            for j in i + 1..4 {
                let cosine = -n[i].dot(&n[j]);
                let sine = (1.0 - cosine * cosine).sqrt();
                want = want.min(if cosine < 0.0 { OBTUSE * sine } else { sine });
            }
        }
        assert!((shape(&p) - want).abs() < 1e-12, "{} {want}", shape(&p));
        assert!(shape(&[p[1], p[0], p[2], p[3]]) < 0.0);
    }

    #[test]
    fn a_needle_is_bad_though_its_angles_are_fair() {
        let p = [
            Vector::new(0.0, 0.0, 0.0),
            Vector::new(1.0, 0.0, 0.0),
            Vector::new(0.5, 0.9, 0.0),
            Vector::new(0.5, 0.3, 9.0),
        ];
        assert!(shape(&p) < 0.1, "{}", shape(&p));
    }
}
