use super::*;

/// One of each kind, and a taut one that is nearly as wide as it is long.
const SHAPES: [(f64, f64); 5] = [(1.3, 1.1), (1.2, 1.199), (1.3, 0.7), (1.05, 0.3), (0.9, 0.8)];

#[test]
fn slopes_are_those_of_the_energy() {
    let h = 1e-6;
    for (a, b) in SHAPES {
        let law = TensionField::new(a, b);
        let by_1 = [TensionField::new(a + h, b), TensionField::new(a - h, b)];
        let by_2 = [TensionField::new(a, b + h), TensionField::new(a, b - h)];
        let slope = |of: fn(&TensionField) -> f64, [over, under]: &[TensionField; 2]| {
            (of(over) - of(under)) / (2.0 * h)
        };
        for (own, found) in [
            (law.pulls[0], 2.0 * slope(|law| law.energy, &by_1)),
            (law.pulls[1], 2.0 * slope(|law| law.energy, &by_2)),
            (law.slopes[0], slope(|law| law.pulls[0], &by_1)),
            (law.slopes[1], slope(|law| law.pulls[0], &by_2)),
            (law.slopes[1], slope(|law| law.pulls[1], &by_1)),
            (law.slopes[2], slope(|law| law.pulls[1], &by_2)),
            (law.shear * (a - b), law.pulls[0] - law.pulls[1]),
        ] {
            assert!((own - found).abs() < 1e-8, "{a} {b}: {own} {found}");
        }
    }
}

/// Pulled one way it narrows by itself; from there on, narrower costs nothing and wider does.
#[test]
fn wrinkles_begin_where_the_skin_is_only_pulled() {
    let pulled = 1.44_f64;
    let alone = 1.0 / pulled.sqrt();
    let under = TensionField::new(pulled, alone - 1e-9);
    let over = TensionField::new(pulled, alone + 1e-9);
    assert!((under.energy - over.energy).abs() < 1e-8);
    for (under, over) in under.pulls.iter().zip(over.pulls) {
        assert!((under - over).abs() < 1e-8, "{under} {over}");
    }
    // W = (λ² + 2/λ − 3)/2: a strip in tension.
    let narrow = TensionField::new(pulled, 0.1).energy;
    assert!((narrow - 0.5 * (1.44 + 2.0 / 1.2 - 3.0)).abs() < 1e-14);
    assert!((narrow - TensionField::new(pulled, 0.8).energy).abs() < 1e-14);
    assert!(TensionField::new(pulled, 0.9).energy > narrow);
}

#[test]
fn slack_skin_bears_nothing_and_no_stress_is_a_compression() {
    assert_eq!(TensionField::new(0.99, 0.5), TensionField::default());
    for i in 1..30 {
        for j in 1..=i {
            let law = TensionField::new(f64::from(i) * 0.1, f64::from(j) * 0.1);
            assert!(law.energy >= 0.0 && law.shear >= 0.0, "{i} {j}");
            assert!(law.pulls.iter().all(|pull| *pull >= -1e-14), "{i} {j}");
        }
    }
}
