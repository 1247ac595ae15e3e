//! Colours: one meaning each, the same in every picture, told apart with and without
//! green-blindness.

use crate::canvas::Rgb;
use supine_mesh::BoundaryTag;

/// The tumour and other points in the CT.
pub(crate) const BEFORE: Rgb = [255, 221, 51];
/// The same on the operating table.
pub(crate) const AFTER: Rgb = [220, 30, 140];
/// The skin.
pub(crate) const SKIN: Rgb = [64, 212, 255];
/// The chest wall.
pub(crate) const CHEST_WALL: Rgb = [225, 94, 10];
/// The chest wall where its place is uncertain.
pub(crate) const UNCERTAIN: Rgb = [255, 255, 255];
/// The cut.
pub(crate) const CUT: Rgb = [110, 110, 255];
/// Edges within the mesh.
pub(crate) const INNER: Rgb = [198, 212, 240];
/// The region's sphere.
pub(crate) const REGION: Rgb = [236, 236, 236];
/// Lettering.
pub(crate) const TEXT: Rgb = [240, 240, 240];
/// The panel behind a legend.
pub(crate) const PANEL: Rgb = [16, 18, 24];
/// Where the volume has no voxels.
pub(crate) const NOTHING: Rgb = [30, 34, 44];

/// Colour of a boundary tag.
pub(crate) fn tag(tag: BoundaryTag) -> Rgb {
    match tag {
        BoundaryTag::Skin => SKIN,
        BoundaryTag::ChestWall => CHEST_WALL,
        BoundaryTag::Cut => CUT,
    }
}

/// Lower end, HU, of the window in which the CT is shown.
pub(crate) const WINDOW_LOW: f32 = -200.0;
/// Upper end, HU.
pub(crate) const WINDOW_HIGH: f32 = 200.0;

/// Grey of a CT value.
pub(crate) fn grey(hu: f32) -> Rgb {
    let share = (hu - WINDOW_LOW) / (WINDOW_HIGH - WINDOW_LOW);
    // To the nearest, as in `Canvas::mix`.
    [(255.0 * share.clamp(0.0, 1.0) + 0.5) as u8; 3]
}

/// Dark blue over green to yellow, evenly growing in lightness.
pub(crate) const RISING: [Rgb; 7] = [
    [68, 1, 84],
    [70, 50, 127],
    [54, 92, 141],
    [39, 127, 142],
    [31, 161, 135],
    [74, 194, 109],
    [253, 231, 37],
];

/// Blue over white to red; white says no change.
pub(crate) const DIVERGING: [Rgb; 5] =
    [[33, 102, 220], [146, 190, 240], [247, 247, 247], [246, 168, 130], [214, 40, 50]];

/// Colour at `share` (0..=1) of a scale of evenly spaced colours.
pub(crate) fn on_scale(scale: &[Rgb], share: f64) -> Rgb {
    let at = share.clamp(0.0, 1.0) * (scale.len() - 1) as f64;
    let n = (at.floor() as usize).min(scale.len() - 2);
    let t = at - n as f64;
    std::array::from_fn(|c| {
        let (a, b) = (f64::from(scale[n][c]), f64::from(scale[n + 1][c]));
        (a + (b - a) * t + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_begin_and_end_where_they_say() {
        assert_eq!(on_scale(&RISING, 0.0), RISING[0]);
        assert_eq!(on_scale(&RISING, 1.0), RISING[6]);
        assert_eq!(on_scale(&DIVERGING, 0.5), [247; 3]);
        assert_eq!(on_scale(&DIVERGING, 7.0), DIVERGING[4]);
        assert_eq!((grey(-200.0), grey(0.0), grey(500.0)), ([0; 3], [128; 3], [255; 3]));
    }

    /// Red, green and blue without the medium cones (Machado, Oliveira and Fernandes 2009, severity
    /// 1), linear light.
    const DEUTERANOPIA: [[f64; 3]; 3] = [
        [0.367_322, 0.860_646, -0.227_968],
        [0.280_085, 0.672_501, 0.047_413],
        [-0.011_820, 0.042_940, 0.968_881],
    ];

    fn times(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
        m.map(|row| row.iter().zip(v).map(|(a, b)| a * b).sum())
    }

    fn linear(rgb: Rgb) -> [f64; 3] {
        rgb.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        })
    }

    /// CIELAB of linear light, D65.
    fn lab(light: [f64; 3]) -> [f64; 3] {
        let xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];
        let white = [0.9505, 1.0, 1.089];
        let found = times(&xyz, light.map(|c| c.clamp(0.0, 1.0)));
        let f: [f64; 3] = std::array::from_fn(|k| {
            let t: f64 = found[k] / white[k];
            if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 }
        });
        [116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])]
    }

    #[test]
    fn lines_are_told_apart_by_those_who_see_no_green_too() {
        let lines = [
            ("before", BEFORE),
            ("after", AFTER),
            ("skin", SKIN),
            ("chest wall", CHEST_WALL),
            ("cut", CUT),
        ];
        let apart = |a: [f64; 3], b: [f64; 3]| -> f64 {
            lab(a).iter().zip(lab(b)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        for (n, (one, a)) in lines.iter().enumerate() {
            for (other, b) in &lines[..n] {
                let (a, b) = (linear(*a), linear(*b));
                let dull = apart(times(&DEUTERANOPIA, a), times(&DEUTERANOPIA, b));
                assert!(apart(a, b) > 45.0, "{one} {other} {}", apart(a, b));
                assert!(dull > 28.0, "{one} {other} {dull}");
            }
        }
    }
}
