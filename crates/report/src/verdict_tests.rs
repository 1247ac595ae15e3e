use super::*;
use crate::summary::tests::example;
use crate::summary::{Movement, UncertainPatch};

fn codes(summary: &Summary) -> Vec<String> {
    verdict(summary, 2.0).reasons.into_iter().map(|reason| reason.code).collect()
}

fn warning(code: &str, message: &str) -> Warning {
    let stage = "region".into();
    Warning {
        stage,
        code: code.into(),
        message: message.into(),
        advice: String::new(),
        values: Default::default(),
        place_mm: None,
        seen: false,
    }
}

/// Without anything that speaks against it.
fn sound() -> Summary {
    let mut summary = example();
    summary.warnings.clear();
    summary.segmentation.uncertainty = None;
    if let Some(interval) = &mut summary.tumour_interval {
        interval.modulus.origin = ModulusOrigin::Given;
        interval.within_mm = 1.5;
    }
    summary
}

#[test]
fn a_field_that_ends_where_nothing_is_simulated_is_a_note() {
    let mut summary = sound();
    let warned = |code: &str| Warning {
        code: code.into(),
        message: "the body reaches the end of the field".into(),
        ..example().warnings[0].clone()
    };
    summary.warnings = vec![warned("truncated-field")];
    assert_eq!(verdict(&summary, 2.0).colour, Colour::Green);
    assert_eq!(notes(&summary), ["the body reaches the end of the field"]);
    summary.warnings.push(warned("region-truncated"));
    assert_eq!(verdict(&summary, 2.0).colour, Colour::Amber);
}

#[test]
fn a_known_tissue_within_the_tolerance_is_green() {
    let found = verdict(&sound(), 2.0);
    assert_eq!((found.colour, found.reasons.len()), (Colour::Green, 0), "{found:?}");
    assert_eq!(verdict(&sound(), 1.0).colour, Colour::Amber);
}

#[test]
fn a_guess_is_amber_and_what_moves_the_tumour_most_comes_first() {
    let found = verdict(&example(), 2.0);
    assert_eq!(found.colour, Colour::Amber);
    assert_eq!(
        codes(&example()),
        ["interval-too-wide", "tissue-is-a-guess", "uncertain-place", "inverted"]
    );
    assert!(
        found
            .reasons
            .is_sorted_by(|a, b| { a.effect_mm.unwrap_or(-1.0) >= b.effect_mm.unwrap_or(-1.0) })
    );
    assert!(found.reasons[2].place_mm.is_some());
}

#[test]
fn what_must_not_be_used_is_red() {
    type Change = fn(&mut Summary);
    let cases: [(&str, Change); 6] = [
        ("folded-map", |s| s.warp.folded_voxels = s.warp.moved_voxels / 100),
        ("failed-check", |s| {
            if let Some(export) = &mut s.export {
                export.verified.passed -= 1;
            }
        }),
        ("tumour-held", |s| {
            s.tumour = Some(Movement::new([40.0, -30.0, 10.0], [40.0, -30.0, 10.0]))
        }),
        ("squeezed-tissue", |s| s.solve.min_det_f = 0.2),
        ("no-interval", |s| s.tumour_interval = None),
        ("tumour-in-chest-wall", |s| {
            s.warnings.push(warning("tumour-in-chest-wall", ""));
        }),
    ];
    for (code, change) in cases {
        let mut summary = sound();
        change(&mut summary);
        let found = verdict(&summary, 2.0);
        assert_eq!(found.colour, Colour::Red, "{code}");
        assert_eq!(found.reasons[0].code, code);
    }
}

#[test]
fn what_an_uncertain_wall_is_worth_at_the_tumour_is_said() {
    let mut summary = example();
    if let Some(found) = &mut summary.segmentation.uncertainty {
        let other = UncertainPatch { effect_mm: Some(0.0), ..found.patches[0].clone() };
        found.patches.push(other);
    }
    summary.warnings = vec![warning("uncertain-wall", "8 cm² may be off")];
    let found = verdict(&summary, 2.0);
    let wall = found.reasons.iter().find(|reason| reason.code == "uncertain-wall").unwrap();
    assert!(wall.message.ends_with("0.4 mm at the tumour"), "{wall:?}");
    assert_eq!(wall.effect_mm, Some(0.4));
}

#[test]
fn a_single_uncertain_place_is_told_once() {
    let mut summary = example();
    summary.warnings = vec![warning("uncertain-wall", "8 cm² may be off")];
    assert_eq!(codes(&summary), ["interval-too-wide", "tissue-is-a-guess", "uncertain-place"]);
}

#[test]
fn a_fit_that_is_poor_or_open_is_amber() {
    let told = |change: fn(&mut TissueFit)| {
        let mut fit = example().fit.expect("a fit");
        change(&mut fit);
        super::fit(&fit).into_iter().map(|r| (r.colour, r.code)).collect::<Vec<_>>()
    };
    assert!(told(|_| {}).is_empty());
    assert_eq!(
        told(|fit| fit.states[0].structured_mm = 0.6),
        [(Colour::Amber, "fit-misfit".into())]
    );
    assert_eq!(told(|fit| fit.decided = false), [(Colour::Amber, "rest-state-open".into())]);
}

#[test]
fn a_prediction_is_amber_until_a_scan_on_the_table_agrees() {
    let mut summary = sound();
    let set = |summary: &mut Summary, near: f64, points: usize, torso: f64| {
        let seen = summary.evaluation.as_mut().expect("a scan");
        seen.torso_mm = torso;
        for surface in seen.surfaces.iter_mut().filter(|s| s.name == "run") {
            (surface.near.rms_mm, surface.near.points) = (near, points);
            surface.breast.rms_mm = near;
        }
    };
    set(&mut summary, 0.5, 200, 0.4);
    assert_eq!(verdict(&summary, 2.0).colour, Colour::Green);
    set(&mut summary, 1.8, 200, 0.4);
    assert_eq!(codes(&summary), ["table-scan-apart"]);
    for (points, torso) in [(5, 0.4), (200, 3.0)] {
        set(&mut summary, 0.5, points, torso);
        assert_eq!(codes(&summary), ["not-seen-on-table"], "{points} {torso}");
    }
    summary.evaluation = None;
    assert_eq!(codes(&summary), ["not-seen-on-table"]);
}

#[test]
fn a_law_that_the_scan_speaks_for_is_told() {
    let mut fit = example().fit.expect("a fit");
    fit.laws = vec![supine_record::LawFit {
        table_mm: None,
        additions: vec![supine_record::Addition::Stiffening(1.5)],
        rest: fit.best().rest,
        young_kpa: 0.6,
        misfit_mm: 0.4,
        against: 0.0,
        probability: 0.9,
    }];
    let told = super::fit(&fit);
    assert_eq!(told[0].code, "law-by-scan");
    assert!(told[0].message.contains("stiffens exponentially (1.5)"), "{told:?}");
}

#[test]
fn a_displacement_outside_its_own_interval_is_red() {
    let mut summary = sound();
    if let (Some(moves), Some(interval)) = (&mut summary.tumour, &summary.tumour_interval) {
        moves.distance_mm = 1.2 * interval.length_mm[1];
    }
    let found = verdict(&summary, 2.0);
    assert_eq!((found.colour, found.reasons[0].code.as_str()), (Colour::Red, "outside-interval"));
}

#[test]
fn a_level_table_moves_nothing_and_nothing_is_wrong() {
    let mut summary = sound();
    summary.tumour = Some(Movement::new([40.0, -30.0, 10.0], [40.0, -30.0, 10.0]));
    (summary.position.table.ap_deg, summary.position.table.lat_deg) = (0.0, 0.0);
    let found = verdict(&summary, 2.0);
    assert_eq!((found.colour, codes(&summary)), (Colour::Amber, vec!["table-level".to_owned()]));
}

#[test]
fn one_source_is_worth_no_more_than_all() {
    let mut summary = example();
    if let Some(interval) = &mut summary.tumour_interval {
        interval.within_mm = 3.0;
    }
    let found = verdict(&summary, 2.0);
    let guess = found.reasons.iter().find(|reason| reason.code == "tissue-is-a-guess").unwrap();
    assert!(guess.message.contains("lies up to 3.0 mm from"), "{guess:?}");
}

#[test]
fn what_says_nothing_of_the_tumours_place_is_a_note() {
    let mut summary = sound();
    summary.warnings = vec![warning("padding-as-air", "12 voxels are padding")];
    assert_eq!(verdict(&summary, 2.0).colour, Colour::Green);
    assert_eq!(notes(&summary), ["12 voxels are padding"]);
    assert!(notes(&example()).is_empty());
}

#[test]
fn squeezed_tissue_far_away_is_amber() {
    let mut summary = sound();
    (summary.solve.min_det_f, summary.solve.min_det_f_mm) = (0.2, [40.0, -30.0, 70.0]);
    assert_eq!(verdict(&summary, 2.0).colour, Colour::Amber);
}

#[test]
fn a_measure_outside_its_tolerance_is_a_reason_with_its_mm() {
    let mut summary = sound();
    summary.warp.folded_voxels = 1;
    if let Some(fields) = &mut summary.warp.forward_then_backward {
        fields.max_mm = 7.23;
    }
    if let Some(skin) = summary.agreement.as_mut().and_then(|a| a.skin.as_mut()) {
        (skin.mean_mm, skin.max_mm) = (2.1, 9.0);
    }
    let found = verdict(&summary, 2.0);
    let told: Vec<_> = found.reasons.iter().map(|r| (r.code.as_str(), r.effect_mm)).collect();
    assert_eq!(
        told,
        [
            ("folded-map", Some(7.23)),
            ("fields-inconsistent", Some(7.23)),
            ("skins-apart", Some(2.1))
        ]
    );
    assert_eq!(found.colour, Colour::Amber);
}

#[test]
fn what_was_not_checked_is_amber() {
    let mut summary = sound();
    if let Some(export) = &mut summary.export {
        (export.verified.passed, export.verified.total) = (0, 0);
    }
    assert_eq!(codes(&summary), ["not-checked"]);
    summary.export = None;
    assert_eq!(codes(&summary), ["not-exported"]);
}
