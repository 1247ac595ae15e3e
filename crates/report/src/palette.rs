//! Colours: one meaning each, the same in stills, viewer, page and PDF.
//!
//! A line on a CT has a contrast of 3:1 or more (WCAG 2.2, 1.4.11) to the grey of fat, on which it
//! mostly lies, and to the halo it is drawn on, whatever lies below. To all greys none can have it.
//! All are told apart by those who see no green too.

use std::fmt::Write;
use supine_mesh::BoundaryTag;

/// Red, green, blue, sRGB.
pub type Rgb = [u8; 3];

/// Black.
pub const BLACK: Rgb = [0; 3];
/// White.
pub const WHITE: Rgb = [255; 3];
/// The tumour and other points in the CT.
pub const BEFORE: Rgb = [255, 226, 51];
/// The same on the operating table.
pub const AFTER: Rgb = [255, 72, 172];
/// The skin.
pub const SKIN: Rgb = [64, 212, 255];
/// The chest wall.
pub const CHEST_WALL: Rgb = [236, 98, 20];
/// The chest wall where its place is uncertain.
pub const UNCERTAIN: Rgb = WHITE;
/// The cut.
pub const CUT: Rgb = [130, 132, 255];
/// Edges within the mesh.
pub const INNER: Rgb = [198, 212, 240];
/// The region's sphere.
pub const REGION: Rgb = [236; 3];
/// Lettering.
pub const TEXT: Rgb = [240; 3];
/// The panel behind a legend.
pub const PANEL: Rgb = [16, 18, 24];
/// Where the volume has no voxels.
pub const NOTHING: Rgb = [30, 34, 44];
/// What of a scan belongs to no surface.
pub const UNKNOWN: Rgb = [92, 96, 106];
/// What became denser, and what less dense.
pub const CHANGE: [Rgb; 2] = [[255, 70, 50], [60, 130, 255]];
/// Below a line, so that it shows on any ground: colour and opacity.
pub const HALO: (Rgb, f64) = (BLACK, 0.75);

/// The colours on slices by the names that scripts know them by.
pub const ON_SLICES: [(&str, Rgb); 9] = [
    ("before", BEFORE),
    ("after", AFTER),
    ("skin", SKIN),
    ("wall", CHEST_WALL),
    ("uncertain", UNCERTAIN),
    ("cut", CUT),
    ("region", REGION),
    ("text", TEXT),
    ("nothing", NOTHING),
];

/// Lettering on paper.
pub const INK: Rgb = [27, 31, 36];
/// Captions on paper.
pub const QUIET: Rgb = [87, 96, 106];
/// Thin lines on paper.
pub const LINE: Rgb = [212, 218, 225];
/// A verdict as lettering on paper, and its ground: must not be used.
pub const STOP: [Rgb; 2] = [[164, 14, 38], [253, 236, 238]];
/// The same: look before use.
pub const CHECK: [Rgb; 2] = [[122, 75, 0], [255, 245, 220]];
/// The same: may be used.
pub const GOOD: [Rgb; 2] = [[15, 92, 54], [232, 246, 238]];

/// The colours of a page by the names of its style sheet: on paper, and in the dark.
pub const PAGE: [(&str, Rgb, Rgb); 17] = [
    ("ground", WHITE, [20, 23, 28]),
    ("text", INK, [230, 233, 238]),
    ("quiet", QUIET, [163, 173, 186]),
    ("line", LINE, [54, 61, 72]),
    ("box", [245, 247, 249], [29, 34, 41]),
    ("stop", STOP[0], [255, 154, 166]),
    ("stop-box", STOP[1], [60, 23, 29]),
    ("check", CHECK[0], [255, 210, 131]),
    ("check-box", CHECK[1], [56, 42, 13]),
    ("good", GOOD[0], [139, 224, 177]),
    ("good-box", GOOD[1], [18, 48, 31]),
    ("banner", STOP[0], STOP[0]),
    ("on-banner", WHITE, WHITE),
    ("stop-mark", [200, 16, 46], [228, 70, 84]),
    ("check-mark", [190, 130, 0], [224, 161, 0]),
    ("good-mark", [46, 158, 104], [46, 158, 104]),
    ("after", AFTER, AFTER),
];

/// A colour as scripts and style sheets have it, `#rrggbb`.
pub fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// The halo with its opacity, `#rrggbbaa`.
pub fn halo() -> String {
    format!("{}{:02x}", hex(HALO.0), (255.0 * HALO.1) as u8)
}

/// The colours of [`PAGE`] as variables of a style sheet; dark ones on dark screens alone, not on
/// paper.
pub fn style_sheet() -> String {
    let variables = |of: fn(&(&str, Rgb, Rgb)) -> Rgb| {
        PAGE.iter().fold(String::new(), |mut text, colour| {
            // What is written to a string cannot fail.
            let _written = write!(text, " --{}: {};", colour.0, hex(of(colour)));
            text
        })
    };
    let (paper, dark) = (variables(|c| c.1), variables(|c| c.2));
    format!(
        ":root {{{paper} }}\n@media screen and (prefers-color-scheme: dark) {{ :root {{{dark} }} }}"
    )
}

/// Colour of a boundary tag.
pub fn tag(tag: BoundaryTag) -> Rgb {
    match tag {
        BoundaryTag::Skin => SKIN,
        BoundaryTag::ChestWall => CHEST_WALL,
        BoundaryTag::Cut => CUT,
    }
}

/// Lower end, HU, of the window in which the CT is shown.
pub const WINDOW_LOW: f32 = -200.0;
/// Upper end, HU.
pub const WINDOW_HIGH: f32 = 200.0;

/// Grey of a CT value.
pub fn grey(hu: f32) -> Rgb {
    let share = (hu - WINDOW_LOW) / (WINDOW_HIGH - WINDOW_LOW);
    // To the nearest, as in `Canvas::mix`.
    [(255.0 * share.clamp(0.0, 1.0) + 0.5) as u8; 3]
}

/// Dark blue over green to yellow, evenly growing in lightness.
pub const RISING: [Rgb; 7] = [
    [68, 1, 84],
    [70, 50, 127],
    [54, 92, 141],
    [39, 127, 142],
    [31, 161, 135],
    [74, 194, 109],
    [253, 231, 37],
];

/// Blue over white to red; white says no change.
pub const DIVERGING: [Rgb; 5] =
    [[33, 102, 220], [146, 190, 240], [247, 247, 247], [246, 168, 130], [214, 40, 50]];

/// Colour at `share` (0..=1) of a scale of evenly spaced colours.
pub fn on_scale(scale: &[Rgb], share: f64) -> Rgb {
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

    /// Red, green and blue without the medium cones (Machado, Oliveira and Fernandes, IEEE Trans.
    /// Vis. Comput. Graph. 15(6), 2009, table 1, severity 1), linear light.
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

    const LINES: [(&str, Rgb); 6] = [
        ("before", BEFORE),
        ("after", AFTER),
        ("skin", SKIN),
        ("chest wall", CHEST_WALL),
        ("cut", CUT),
        ("uncertain", UNCERTAIN),
    ];

    #[test]
    fn lines_are_told_apart_by_those_who_see_no_green_too() {
        let apart = |a: [f64; 3], b: [f64; 3]| -> f64 {
            lab(a).iter().zip(lab(b)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        for (n, (one, a)) in LINES.iter().enumerate() {
            for (other, b) in &LINES[..n] {
                let (a, b) = (linear(*a), linear(*b));
                let dull = apart(times(&DEUTERANOPIA, a), times(&DEUTERANOPIA, b));
                assert!(apart(a, b) > 45.0, "{one} {other} {}", apart(a, b));
                assert!(dull > 30.0, "{one} {other} {dull}");
            }
        }
    }

    /// Contrast ratio (WCAG 2.2).
    fn contrast(a: Rgb, b: Rgb) -> f64 {
        let luminance =
            |rgb| linear(rgb).iter().zip([0.2126, 0.7152, 0.0722]).map(|(c, w)| c * w).sum::<f64>();
        let [a, b] = [a, b].map(|rgb| luminance(rgb) + 0.05);
        (a / b).max(b / a)
    }

    #[test]
    fn lines_stand_out_from_fat_and_from_their_halo_on_any_grey() {
        for (name, rgb) in LINES {
            let fat = contrast(rgb, grey(-100.0));
            assert!(fat >= 3.0, "{name} on fat {fat}");
            for ground in 0..=255 {
                let halo = [(f64::from(ground) * (1.0 - HALO.1)).round() as u8; 3];
                let found = contrast(rgb, halo);
                assert!(found >= 3.0, "{name} on the halo on {ground}: {found}");
            }
        }
    }

    #[test]
    fn lettering_of_pages_can_be_read_on_paper_and_in_the_dark() {
        let found = |name: &str| *PAGE.iter().find(|colour| colour.0 == name).unwrap();
        for (ink, ground, least) in [
            ("text", "ground", 7.0),
            ("quiet", "box", 4.5),
            ("stop", "stop-box", 4.5),
            ("check", "check-box", 4.5),
            ("good", "good-box", 4.5),
            ("on-banner", "banner", 4.5),
            ("stop-mark", "ground", 3.0),
            ("check-mark", "ground", 3.0),
            ("good-mark", "ground", 3.0),
            ("after", "ground", 3.0),
        ] {
            let ((_, ink_paper, ink_dark), (_, paper, dark)) = (found(ink), found(ground));
            for found in [contrast(ink_paper, paper), contrast(ink_dark, dark)] {
                assert!(found >= least, "{ink} on {ground}: {found}");
            }
        }
        let sheet = style_sheet();
        assert!(
            sheet.contains("--stop: #a40e26;") && sheet.contains("--stop: #ff9aa6;"),
            "{sheet}"
        );
    }
}
