//! Display colours of segments.

/// Recommended Display CIELab Value of an sRGB colour: L*, a*, b* for the white D50, scaled to 16
/// bits (PS3.3 C.10.7.1.1).
///
/// Source: IEC 61966-2-1 for sRGB, with Bradford's adaptation from D65 to D50 in the matrix as ICC
/// profiles of sRGB have it; CIE 15 for L*a*b*.
pub(super) fn cielab([r, g, b]: [u8; 3]) -> [u16; 3] {
    let linear = |v: u8| {
        let v = f64::from(v) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    };
    let (r, g, b) = (linear(r), linear(g), linear(b));
    let x = 0.436_074_7 * r + 0.385_064_9 * g + 0.143_080_4 * b;
    let y = 0.222_504_5 * r + 0.716_878_6 * g + 0.060_616_9 * b;
    let z = 0.013_932_2 * r + 0.097_104_5 * g + 0.714_173_3 * b;
    let f = |t: f64| {
        if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 }
    };
    let [fx, fy, fz] = [f(x / 0.964_22), f(y), f(z / 0.825_21)];
    let (l, a, b) = (116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz));
    let scale = |v: f64| v.round().clamp(0.0, 65535.0) as u16;
    [
        scale(l / 100.0 * 65535.0),
        scale((a + 128.0) / 255.0 * 65535.0),
        scale((b + 128.0) / 255.0 * 65535.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_black_and_red_are_what_profiles_say() {
        let [l, a, b] = cielab([255; 3]);
        assert_eq!(l, 65535);
        assert!(a.abs_diff(32896) <= 10 && b.abs_diff(32896) <= 10, "{a} {b}");
        assert_eq!(cielab([0; 3]), [0, 32896, 32896]);
        // Red of sRGB for D50: L* 54.29, a* 80.81, b* 69.89.
        let lab = cielab([255, 0, 0]).map(f64::from);
        let found =
            [lab[0] / 655.35, lab[1] / 65535.0 * 255.0 - 128.0, lab[2] / 65535.0 * 255.0 - 128.0];
        for (f, want) in found.into_iter().zip([54.29, 80.81, 69.89]) {
            assert!((f - want).abs() < 0.05, "{found:?}");
        }
    }
}
