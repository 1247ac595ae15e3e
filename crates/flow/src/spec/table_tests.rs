use super::*;
use std::collections::BTreeSet;

#[test]
fn keys_and_options_are_unique_and_defaults_fit() {
    let keys: BTreeSet<_> = TABLE.iter().map(|p| p.key).collect();
    let options: BTreeSet<_> = TABLE.iter().map(|p| p.option).collect();
    assert_eq!((keys.len(), options.len()), (TABLE.len(), TABLE.len()));
    for p in TABLE {
        let fits = match (p.default, p.kind) {
            (Required | Preset::RequiredOr(_) | Absent(_), _)
            | (Preset::Switch(_), Kind::Switch) => true,
            (Preset::Number(x), Kind::Number { min, max }) => (min..=max).contains(&x),
            (Preset::Whole(n), Kind::Whole { min, max }) => (min..=max).contains(&n),
            (Preset::Choice(word), Kind::Choice(all)) => all[0] == word,
            _ => false,
        };
        assert!(fits, "{}", p.key);
    }
}

#[test]
fn the_ranges_of_the_tissue_are_those_of_the_mechanics() {
    let check = |set: &dyn Fn(&mut supine_fem::Tissue)| {
        let mut tissue = supine_fem::Tissue::default();
        set(&mut tissue);
        tissue.check().is_ok()
    };
    for (key, set) in [
        ("tissue.young", (|t, v| t.young_kpa = v) as fn(&mut supine_fem::Tissue, f64)),
        ("tissue.poisson", |t, v| t.poisson = v),
        ("tissue.density", |t, v| t.density_kg_m3 = v),
    ] {
        let Kind::Number { min, max } = TABLE[position(key).unwrap()].kind else { panic!() };
        for (value, good) in [(min, true), (max, true), (min - 1e-3, false), (max * 1.01, false)] {
            assert_eq!(check(&|t| set(t, value)), good, "{key} = {value}");
        }
    }
}
