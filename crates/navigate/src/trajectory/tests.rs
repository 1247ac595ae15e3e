//! The trajectory beside the table of another program, and its counts.

use super::*;
use std::collections::BTreeMap;

/// The short trajectory as another program computes it; see the README beside it.
const SHORT: &str = include_str!("../../../../fixtures/navigate/trajectory_20s.csv");
/// The table is rounded to 1e-6, and so may be one digit off where libraries of mathematics differ.
const CLOSE: f64 = 2e-6;

fn expected(name: &str) -> Expect {
    match name {
        "accept" => Expect::Accept,
        "drop_duplicate" => Expect::Duplicate,
        "drop_old" => Expect::Old,
        "reject_nan" => Expect::NotFinite,
        "reject_nonrigid" => Expect::NotRigid,
        "reject_far" => Expect::Far,
        other => panic!("{other}"),
    }
}

fn flagged(name: &str) -> Option<Flag> {
    Some(match name {
        "" => return None,
        "jump_3mm" => Flag::Jump,
        "duplicate" => Flag::Duplicate,
        "out_of_order" => Flag::OutOfOrder,
        "repeat_whole" => Flag::Repeat,
        "nan" => Flag::Nan,
        "inf" => Flag::Infinite,
        "scale_1.02" => Flag::Scaled,
        "mirror" => Flag::Mirrored,
        "zero_rotation" => Flag::Zero,
        "far_1m" => Flag::Far,
        "clock_offset" => Flag::ClockAhead,
        other => panic!("{other}"),
    })
}

/// Equal to the last digit of the table; what is no number is the same kind of it.
fn close(ours: f64, theirs: f64) -> bool {
    (ours - theirs).abs() < CLOSE || ours == theirs || ours.is_nan() && theirs.is_nan()
}

/// Compares row by row.
fn assert_same(trajectory: &Trajectory, table: &str) {
    let mut lines = table.lines().skip(1);
    for row in trajectory.rows() {
        let line = lines.next().unwrap();
        let fields: Vec<&str> = line.split(',').collect();
        let number = |at: usize| fields[at].parse::<f64>().unwrap();
        assert_eq!(fields[0], row.seq.to_string());
        assert_eq!(fields[4], row.phase.name(), "{line}");
        assert_eq!(flagged(fields[5]), row.flag, "{line}");
        assert_eq!(expected(fields[6]), row.expect, "{line}");
        let times = [row.t_true_s, row.stamp_s, row.t_send_s];
        assert!((0..3).all(|k| close(times[k], number(1 + k))), "{line} {times:?}");
        let wire = |k: usize| row.rows[k % 3][k / 3];
        assert!((0..12).all(|k| close(wire(k), number(7 + k))), "{line} {:?}", row.rows);
        assert!((0..3).all(|k| close(row.tip[k], number(19 + k))), "{line} {}", row.tip);
    }
    assert_eq!(lines.next(), None);
}

/// How many rows are to be accepted, are duplicate, old, not finite, not rigid and far.
fn counts(trajectory: &Trajectory) -> Vec<usize> {
    let mut counts = BTreeMap::new();
    for row in trajectory.rows() {
        *counts.entry(row.expect).or_insert(0) += 1;
    }
    counts.into_values().collect()
}

#[test]
fn the_short_trajectory_is_that_of_another_program() {
    assert_same(&Trajectory::short(), SHORT);
    assert_eq!(counts(&Trajectory::short()), [1158, 8, 5, 4, 5, 1]);
}

#[test]
fn the_long_trajectory_has_the_counts_of_another_program() {
    let long = Trajectory::long();
    assert_eq!(long.rows().len(), 35_431);
    assert_eq!(long.rows().last().unwrap().seq, 35_999);
    assert_eq!(counts(&long), [34_815, 161, 155, 100, 150, 50]);
    let flagged = |flag| long.rows().iter().filter(|row| row.flag == Some(flag)).count();
    assert_eq!([flagged(Flag::Duplicate), flagged(Flag::OutOfOrder)], [124, 148]);
    assert_eq!([flagged(Flag::Repeat), flagged(Flag::Jump)], [55, 9]);
    assert_eq!(flagged(Flag::ClockAhead), 1800);
}

/// Peak speeds (mm/s) that the other program prints for the long trajectory, to two digits.
#[test]
fn the_peak_speeds_are_those_of_another_program() {
    let long = Trajectory::long();
    let peak = |phase: Phase| {
        let pairs = long.rows().windows(2).filter(|pair| {
            pair.iter().all(|row| row.phase == phase) && pair[1].seq == pair[0].seq + 1
        });
        pairs.map(|pair| (pair[1].tip - pair[0].tip).norm() * RATE_HZ).fold(0.0, f64::max)
    };
    let peaks = [
        (Phase::Approach, 17.91),
        (Phase::Insertion, 15.12),
        (Phase::Hold, 14.64),
        (Phase::Steps, 1.35),
        (Phase::Return, 16.26),
        (Phase::Sweep, 25.43),
        (Phase::Jumps, 180.0),
        (Phase::Withdraw, 16.45),
    ];
    for (phase, speed) in peaks {
        let found = peak(phase);
        assert!((found - speed).abs() < 0.0051, "{phase:?} {found}");
    }
}

#[test]
fn elsewhere_the_tool_moves_the_same_way() {
    let turn = UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0);
    let origin = Pose::from_parts(Vector::new(70.0, -80.0, 1200.0).into(), turn);
    let (here, there) = (Trajectory::short(), Trajectory::short().at(&origin));
    for (a, b) in here.rows().iter().zip(there.rows()) {
        assert!((origin * a.tip - b.tip).norm() < 1e-9);
        assert_eq!((a.flag, a.expect, a.stamp_s), (b.flag, b.expect, b.stamp_s));
        if a.flag.is_none() {
            let ((from, at), (to, now)) = (parts(&a.rows), parts(&b.rows));
            let turned = origin.rotation.to_rotation_matrix().into_inner() * from;
            assert!((turned - to).amax() < 1e-12);
            assert!((origin * Point::from(at) - Point::from(now)).norm() < 1e-9);
        }
    }
}

#[test]
fn stamps_are_in_the_form_of_the_protocol() {
    let mut row = Trajectory::short().rows()[0].clone();
    row.stamp_s = 0.25;
    assert_eq!(row.stamp(1_700_000_000), 0x6553_F100_4000_0000);
    row.stamp_s = 2.999_999_6;
    assert_eq!(row.stamp(0), 3 << 32);
    row.stamp_s = -1.0;
    assert_eq!(row.stamp(0), 0);
    row.stamp_s = f64::NAN;
    assert_eq!(row.stamp(7), 7 << 32);
}

#[test]
fn two_runs_are_equal_to_the_bit() {
    let bits = |t: &Trajectory| -> Vec<u64> {
        let numbers = t.rows().iter().flat_map(|row| row.rows.iter().flatten());
        numbers.map(|value| value.to_bits()).collect()
    };
    assert_eq!(bits(&Trajectory::short()), bits(&Trajectory::short()));
}
