use super::*;

/// A summary with a value in every field, and awkward strings.
#[expect(clippy::too_many_lines, reason = "a table of all fields")]
pub(crate) fn example() -> Summary {
    let ball = SphereRecord { centre_mm: [40.0, -30.0, 10.0], radius_mm: 10.0 };
    let mut summary = Summary {
        tool: Tool { name: "supine".into(), version: "0.1.0".into() },
        status: Status::Done,
        verdict: Verdict::default(),
        must_not_be_used_for: must_not_be_used_for(),
        schema: Summary::SCHEMA,
        id: Some("3f7a".into()),
        source: Some(SourceSeries {
            study_uid: "1.2.3".into(),
            series_uid: "1.2.3.4".into(),
            frame_of_reference_uid: "1.2.3.5".into(),
            instance_uids: vec!["1.2.3.4.1".into()],
        }),
        case: [("breast".to_string(), "left".into())].into_iter().collect(),
        position: Position {
            breast: "left".into(),
            table: TablePosition {
                ap_deg: 7.0,
                lat_deg: 5.0,
                gravity: [0.086506, 0.988769, -0.121869],
            },
            tumour: Some(ball),
        },
        inputs: vec![Input {
            role: "ct".into(),
            form: "<script>alert('x')</script> & \"co\"".into(),
            files: 86,
            blake3: "00ff".repeat(16),
        }],
        parameters: Parameters {
            tissue: Tissue {
                young_kpa: 0.609,
                moduli: None,
                poisson: 0.45,
                density_kg_m3: 1000.0,
                law: Law::NeoHookean,
                stiffening: None,
                fibres: None,
                fibre_stiffening: None,
                fibre_direction: None,
                sliding: None,
                skin: None,
                rest: RestState::Net,
                order: 2,
                cut: Cut::Free,
            },
            mesh: MeshParameters {
                tetrahedra: 5000,
                mesher: "native".into(),
                refine: "none".into(),
            },
            region: RegionParameters {
                centre_mm: [40.0, -20.0, 5.0],
                radius_mm: 45.0,
                proposed: true,
            },
            interpolation: "linear".into(),
            fade_mm: 10.0,
        },
        ct: CtFacts {
            size: [64, 48, 40],
            spacing_mm: [2.5, 2.5, 3.0],
            origin_mm: [-80.0, -60.0, -60.0],
            slices: 40,
            patient_position: "HFS".into(),
            left_out: vec![LeftOut { file: "IM0000".into(), reason: "localizer".into() }],
        },
        segmentation: Segmentation {
            fat_hu: Some(-103.4),
            muscle_hu: Some(52.1),
            soft_tissue_ml: 731.25,
            chest_wall_ml: 402.5,
            uncertainty: Some(WallUncertainty {
                boundary_cm2: 180.25,
                uncertain_cm2: 12.5,
                limit_mm: 2.0,
                patches: vec![UncertainPatch {
                    area_cm2: 7.75,
                    centre_mm: [55.0, -12.0, 31.0],
                    error_mm: 3.5,
                    place: "upper outer quadrant".into(),
                    effect_mm: Some(0.4),
                    seeds_mm: vec![
                        [[55.0, -10.0, 31.0], [55.0, -14.0, 31.0]],
                        [[62.0, -10.0, 31.0], [62.0, -14.0, 31.0]],
                    ],
                }],
            }),
            quality_checks: vec![
                QualityCheck {
                    what: "air and lung, share of the CT".into(),
                    unit: "%".into(),
                    value: 61.25,
                    at_most: false,
                    warns: None,
                    refuses: Some(5.0),
                    jointly: false,
                },
                QualityCheck {
                    what: "table or cloth <in> front of the patient".into(),
                    unit: "cm³".into(),
                    value: 12.0,
                    at_most: true,
                    warns: None,
                    refuses: Some(100.0),
                    jointly: true,
                },
            ],
            tissues: Some(Tissues {
                levels: TissueLevels { fat_hu: -101.0, gland_hu: Some(38.5), tumour_grown: true },
                density_percent: Some(17.5),
                volumes: vec![
                    TissueVolume {
                        name: "fat".into(),
                        region_ml: 560.0,
                        mean_hu: Some(-99.5),
                        whole_ct_ml: 3120.0,
                    },
                    TissueVolume {
                        name: "implant".into(),
                        region_ml: 0.0,
                        mean_hu: None,
                        whole_ct_ml: 0.0,
                    },
                ],
            }),
        },
        mesh: Mesh {
            asked: 5000,
            tetrahedra: 5012,
            points: 1203,
            unknowns: 22_101,
            min_dihedral_deg: 14.2,
            max_dihedral_deg: 151.8,
            min_radius_ratio: 0.31,
            mean_radius_ratio: 0.84,
            volume_ml: 728.9,
            skin_mm2: 41_234.0,
            chest_wall_mm2: 20_111.0,
            cut_mm2: 12_345.0,
            source_volume_ml: 729.3,
            joined_patches: 2,
            curved: None,
            surfaces: vec![SurfaceFit {
                tag: "skin".into(),
                distance: SurfaceDistance { mean_mm: 0.04, p95_mm: 0.11, max_mm: 0.31 },
            }],
            dihedral_angles: (0..36)
                .map(|n| if (3..30).contains(&n) { 40 * n } else { 0 })
                .collect(),
            radius_ratios: (0..20).map(|n| if n > 6 { 30 * n } else { 0 }).collect(),
            worst: vec![WorstTet {
                tet: 17,
                place_mm: [31.0, -24.0, 9.0],
                min_dihedral_deg: 14.2,
                max_dihedral_deg: 151.8,
                radius_ratio: 0.31,
            }],
        },
        fit: Some(fit()),
        solve: Solve {
            iterations: 6,
            spring_kpa_mm: Some(0.0123),
            sliding: None,
            reload_error_mm: None,
            indefinite: 0,
            load_steps: 1,
            residual: 3.2e-11,
            min_det_f: 0.81,
            min_det_f_mm: [38.0, -20.0, 0.0],
            max_det_f: 1.22,
            max_displacement_mm: 6.4,
        },
        warp: Warp {
            fade_mm: 10.0,
            moved_voxels: 61_234,
            vacated_voxels: 1_204,
            folded_voxels: 0,
            jacobian: Jacobian { min: 0.79, p01: 0.9, mean: 1.0, p99: 1.11, max: 1.25 },
            dense: vec![DenseThing {
                before_mm: [41.0, -31.0, 12.0],
                after_mm: [43.0, -30.5, 9.0],
                voxels: 24,
                volume_mm3: 30.0,
                peak_hu: 2500,
                fate: DenseFate::Whole,
            }],
            forward_then_backward: Some(Consistency {
                voxels: 58_321,
                mean_mm: 0.0021,
                p99_mm: 0.0342,
                max_mm: 0.1178,
            }),
        },
        agreement: Some(Agreement {
            voxel_mm: 3.0,
            skin: Some(SkinAgreement {
                places: 412,
                lost: 0,
                mean_mm: 0.21,
                p95_mm: 0.55,
                max_mm: 1.4,
            }),
        }),
        volumes: ["all simulated soft tissue", "tumour as given", "fat", "gland"]
            .map(|structure| VolumeChange {
                structure: structure.into(),
                before_ml: 12.5,
                after_ml: 12.0,
                jacobian: Jacobian { min: 0.79, p01: 0.9, mean: 0.96, p99: 1.11, max: 1.25 },
                min_mm: [31.0, -24.0, 9.0],
                max_mm: [10.0, -20.0, -9.0],
                span: 0.15,
                shares: (0..40).map(|n| if n < 20 { 0.0 } else { 0.05 }).collect(),
            })
            .to_vec(),
        tumour: Some(Movement::new([40.0, -30.0, 10.0], [42.0, -29.0, 7.0])),
        tumour_interval: Some(interval()),
        evaluation: Some(evaluation()),
        nipple: Some(Movement::new([42.0, -52.0, 8.0], [45.0, -50.0, 4.0])),
        points: vec![CarriedPoint {
            name: "clip <1>".into(),
            before_mm: [30.0, -25.0, 0.0],
            after_mm: [31.0, -24.5, -1.5],
            inside: true,
        }],
        dose_volume: vec![DoseVolumeHistogram {
            dose: "rt/dose-1.dcm".into(),
            structures: "rt/structures-1.dcm".into(),
            region: "CTV <2>".into(),
            step_gy: 5.5,
            before: DoseVolumeCurve {
                volume_ml: 13.2,
                beyond: 0.0,
                mean_gy: 19.8,
                d98_gy: 17.0,
                d50_gy: 20.1,
                d2_gy: 21.5,
                max_gy: 22.0,
                shares: vec![1.0, 1.0, 1.0, 0.9, 0.01],
            },
            after: DoseVolumeCurve {
                volume_ml: 13.05,
                beyond: 0.004,
                mean_gy: 19.6,
                d98_gy: 16.0,
                d50_gy: 20.0,
                d2_gy: 21.4,
                max_gy: 22.0,
                shares: vec![1.0, 0.99, 0.98, 0.87, 0.01],
            },
        }],
        carried: vec![CarriedObject {
            kind: "structures".into(),
            file: "rt/structures-1.dcm".into(),
            instance_uid: "2.25.9".into(),
            max_gy: None,
            energy_mj: None,
            regions: vec![CarriedRegion {
                name: "CTV <2>".into(),
                before_ml: 13.2,
                after_ml: 13.05,
            }],
        }],
        export: Some(Export {
            folder: "ct".into(),
            files: 86,
            series_description: "DERIVED supine <left>".into(),
            series_uid: "2.25.123".into(),
            frame_of_reference_uid: "1.2.3".into(),
            verified: Checks { passed: 41, total: 41 },
            registration: None,
        }),
        warnings: vec![Warning {
            stage: "solve".into(),
            code: "inverted".into(),
            message: "det F < 0.3 in 2 tetrahedra & more".into(),
            advice: "look at the mesh".into(),
            values: [("tetrahedra".to_owned(), 2.0)].into(),
            place_mm: None,
            seen: false,
        }],
        outputs: vec![Output { path: "labels.seg.nrrd".into(), blake3: "ab".repeat(32) }],
        chain: vec![Link {
            stage: "import".into(),
            key: "0f".repeat(32),
            value: None,
            parents: vec![],
        }],
        run: Run {
            case_folder: Some("/plans".into()),
            started: Some("2026-03-01 12:00:00".into()),
            command: Some(vec!["supine".into(), "run".into(), "case.toml".into()]),
            stages: vec![StageTime {
                name: "solve".into(),
                seconds: 1.25,
                cached: false,
                peak_memory_mb: Some(812.0),
            }],
            total_seconds: 9.5,
            peak_memory_mb: Some(901.0),
            threads: 2,
        },
    };
    summary.verdict = crate::verdict(&summary, crate::TOLERANCE_MM);
    summary
}

/// A modulus that was fitted in both states.
pub(crate) fn evaluation() -> Evaluation {
    let of =
        |points, mean_mm| SkinDistances { points, mean_mm, rms_mm: 0.5, p95_mm: 0.9, max_mm: 1.25 };
    let surface = |name: &str, mean_mm| EvaluatedSurface {
        name: name.into(),
        near: of(180, mean_mm),
        breast: of(4000, 0.0),
    };
    Evaluation {
        surfaces: vec![surface("ct", -0.5), surface("default", -0.25), surface("run", 0.125)],
        near_mm: [50.0, -60.0, 0.0],
        near_radius_mm: 20.0,
        torso_mm: 0.4,
        patient_from_scan: fit().best().patient_from_scan,
    }
}

const POSE: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 12.0], [0.0, 1.0, 0.0, -30.0], [0.0, 0.0, 1.0, 5.0], [0.0, 0.0, 0.0, 1.0]];

pub(crate) fn fit() -> TissueFit {
    let state = |rest: RestState, young_kpa: f64, misfit_mm: f64| StateFit {
        rest,
        young_kpa,
        interval_kpa: [young_kpa / 1.05, young_kpa * 1.05],
        deviation: 0.025,
        parts: DeviationParts {
            scan: 0.015,
            posture: 0.0,
            tissues: 0.0,
            mesh: 0.0,
            wall: 0.02,
            misfit: 0.0,
        },
        lean_deg: 0.6,
        misfit_mm,
        structured_mm: 0.3,
        farthest: Some(OffPlace { place_mm: [60.0, -250.0, -600.0], off_mm: -0.4 }),
        tissues: None,
        other_pose: None,
        patient_from_scan: POSE,
        path: vec![FitStep { young_kpa: 1.2, objective_mm2: 0.3 }],
        ended: None,
    };
    TissueFit {
        states: vec![state(RestState::Net, 0.6, 0.4), state(RestState::Unloaded, 0.8, 0.9)],
        decided: true,
        evidence: Some(61.0),
        laws: vec![],
        one_modulus: None,
        supine: Some(ScanFit { rms_mm: 0.35, scale: 1.0005, patient_from_scan: POSE }),
    }
}

/// An interval as wide as that of tissue that nobody measured.
fn interval() -> TumourInterval {
    let share = |source: UncertaintySource, length_mm: [f64; 2], within_mm: f64| UncertaintyShare {
        source,
        length_mm,
        within_mm,
    };
    TumourInterval {
        level: 0.95,
        within_mm: 4.6,
        length_mm: [1.1, 8.2],
        components_mm: [[0.5, 4.4], [0.3, 2.2], [-6.6, -0.9]],
        ellipsoid: Ellipsoid {
            centre_mm: [42.1, -29.0, 6.8],
            semi_axes_mm: [[2.4, 1.2, -3.6], [0.1, 0.2, 0.1], [0.1, -0.1, 0.0]],
        },
        modulus: ModulusKnown {
            young_kpa: [0.23, 2.43],
            median_kpa: 0.75,
            origin: ModulusOrigin::Literature,
            softest_unloaded_kpa: Some(0.35),
        },
        other_rest: Some(OtherRest {
            rest: RestState::Unloaded,
            displacement_mm: Some([3.1, 1.4, -4.4]),
        }),
        shares: vec![
            share(UncertaintySource::Modulus, [1.0, 7.9], 4.3),
            share(UncertaintySource::RestState, [3.7, 5.6], 1.9),
            share(UncertaintySource::ChestWall, [3.5, 3.9], 0.2),
            share(UncertaintySource::Mesh, [3.7, 3.8], 0.1),
        ],
    }
}

#[test]
fn json_reads_back_and_keeps_the_order_of_the_fields() {
    let summary = example();
    let json = summary.to_json();
    assert_eq!(serde_json::from_str::<Summary>(&json).unwrap(), summary);
    let place = |key: &str| json.find(&format!("\n  \"{key}\"")).unwrap();
    let order = ["tool", "must_not_be_used_for", "case", "inputs", "parameters", "ct", "run"];
    assert!(order.map(place).is_sorted());
    assert!(json.ends_with("}\n"));
}

#[test]
fn what_differs_between_runs_lies_in_run() {
    let (mut a, mut b) = (example(), example());
    b.run.total_seconds = 77.0;
    b.run.stages.clear();
    assert_ne!(a.to_json(), b.to_json());
    a.run = b.run.clone();
    assert_eq!(a.to_json(), b.to_json());
}

#[test]
fn a_movement_has_its_difference_and_length() {
    let m = Movement::new([1.0, 2.0, 3.0], [3.0, 5.0, 9.0]);
    assert_eq!(m.displacement_mm, [2.0, 3.0, 6.0]);
    assert!((m.distance_mm - 7.0).abs() < 1e-12);
}

/// The keys of an object of the schema or of JSON.
fn keys(object: &serde_json::Value) -> std::collections::BTreeSet<String> {
    object.as_object().unwrap().keys().cloned().collect()
}

#[test]
fn the_schema_has_the_keys_of_the_summary() {
    let schema = summary_schema();
    let there = keys(&serde_json::to_value(example()).unwrap());
    let wanted = keys(&schema["properties"]);
    assert_eq!(there, wanted);
    let required = schema["required"].as_array().unwrap();
    assert!(!required.is_empty());
    assert!(required.iter().all(|key| there.contains(key.as_str().unwrap())), "{required:?}");
}
