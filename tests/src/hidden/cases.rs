//! Drawing a case: which rig, what is hidden in it and how strongly, and how good its sensors are;
//! all from one seed.

use super::bodies::{BOUND, Plan, Shaking, draw_base, draw_chains, plans};
use super::catalogue::{Kind, Planted, SUBJECTS, Subject};
use super::laws::Law;
use super::rig::{Base, Rig, Run, Trace};
use super::sensors::{Faulty, Tolerances};
use super::sizes::Scale;
use super::strength::{Shares, find_strengths};
use rand::seq::IndexedRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// What a campaign draws from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Seed of the campaign.
    pub seed: u64,
    /// Whether the instruments have tolerances.
    pub tolerances: bool,
    /// Whether two effects of the library are hidden at once, in every case.
    pub two: bool,
    /// Hide this and nothing else: a name of [`SUBJECTS`], or "none".
    pub only: Option<String>,
}

/// One hidden effect with its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hidden {
    /// The effect, as the catalogue lists it.
    pub subject: &'static Subject,
    /// 0 for x, 1 for φ.
    pub axis: usize,
    /// RMS of its force over that of the restoring force of its axis, over the training motion: as
    /// asked.
    pub wanted: f64,
    /// The same as reached, and what the base terms cannot take over of it.
    pub shares: Shares,
}

/// A case with its records as perfect sensors would see them.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its number in the campaign.
    pub number: usize,
    /// Axes of the rig, 1 or 2.
    pub axes: usize,
    /// What is hidden; empty in a healthy joint.
    pub hidden: Vec<Hidden>,
    /// The rig, hidden laws included.
    pub rig: Rig,
    /// The joint's terms as the user lists them.
    pub base_terms: Vec<String>,
    /// Faults of the instruments that are hidden.
    pub faults: Vec<Faulty>,
    /// Signal-to-noise ratio of accelerometers and strain gauges, dB.
    pub snr_db: Option<f64>,
    /// Errors within the data sheets.
    pub tolerances: Option<Tolerances>,
    /// One count of the encoders, m and rad.
    pub encoder_step: [f64; 2],
    /// The records, those of training first.
    pub plans: Vec<Plan>,
    /// The motion of each of `plans`.
    pub traces: Vec<Trace>,
    /// Seed of the sensors' noise.
    pub noise_seed: u64,
    /// How it is shaken.
    pub shaking: Shaking,
}

/// How often a rig may turn out implausible before the draw is given up; a few per cent of all
/// draws are.
const MAX_DRAWS: usize = 60;
/// What depends on the largest excursion so far.
const DEGRADING: [&str; 3] = ["mullins", "bouc_wen_degrading", "bouc_wen_baber_noori"];

/// The seed of one case: SplitMix64's step, so that neighbours have nothing in common.
pub fn case_seed(seed: u64, number: usize) -> u64 {
    let mut z = seed
        .wrapping_mul(0x9E37_79B9_7F4A_7C15)
        .wrapping_add((number as u64).wrapping_mul(0xBF58_476D_1CE4_E5B9));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Which subjects a case hides.
fn subjects(options: &Options, rng: &mut impl Rng) -> Vec<&'static Subject> {
    let library: Vec<&Subject> = SUBJECTS
        .iter()
        .filter(|s| s.kind != Kind::Outside)
        .collect();
    let outside: Vec<&Subject> = SUBJECTS
        .iter()
        .filter(|s| s.kind == Kind::Outside)
        .collect();
    let mut one = |of: &[&'static Subject]| *of.choose(rng).expect("a list that is not empty");
    if options.only.as_deref() == Some("outsiders") {
        return vec![one(&outside)];
    }
    if let Some(name) = &options.only {
        return Subject::named(name).into_iter().collect();
    }
    if options.two {
        let first = one(&library);
        loop {
            let second = one(&library);
            if second != first {
                return vec![first, second];
            }
        }
    }
    let chance = rng.random::<f64>();
    if chance < 0.15 {
        Vec::new()
    } else if chance < 0.3 {
        vec![outside.choose(rng).expect("a list that is not empty")]
    } else {
        vec![library.choose(rng).expect("a list that is not empty")]
    }
}

fn draw_tolerances(rng: &mut impl Rng) -> Tolerances {
    let normal = Normal::new(0.0, 0.0015).expect("a positive spread");
    Tolerances {
        gain: [0, 1].map(|_| std::array::from_fn(|_| normal.sample(rng))),
        zero: [0, 1].map(|_| std::array::from_fn(|_| normal.sample(rng))),
        inertia: [normal.sample(rng), normal.sample(rng)],
    }
}

/// Takes out of the joint what the user is to miss, and lists what is left.
fn take_out(whole: &Base, axes: usize, hidden: &[(&Subject, usize)]) -> (Base, Vec<String>) {
    let mut base = *whole;
    let hides = |name: &str, axis: usize| {
        let mut all = hidden.iter();
        all.any(|(s, a)| s.name == name && (*a == axis || s.acts_on_both))
    };
    let mut terms = Vec::new();
    let mut both_gaps = axes == 2;
    for (axis, label) in ["x", "phi"].iter().enumerate().take(axes) {
        for (name, value) in [
            ("stiffness", &mut base.spring[axis]),
            ("viscous", &mut base.damper[axis]),
            ("clearance", &mut base.contact[axis]),
        ] {
            if hides(name, axis) {
                *value = 0.0;
                both_gaps &= name != "clearance";
            } else {
                terms.push(format!("{name}@{label}"));
            }
        }
    }
    // The coupling acts in the contacts of both axes, so a user who knows it knows both clearances.
    if both_gaps && !hides("clearance_coupling", 0) {
        terms.push("clearance_coupling".into());
    } else {
        base.coupling = [0.0; 2];
    }
    (base, terms)
}

/// Size of the motion per axis over the records that move; nothing when it is implausible.
fn scales(traces: &[Trace], axes: usize, base: &Base) -> Option<[Scale; 2]> {
    let mut scales = [Scale::default(); 2];
    for (axis, scale) in scales.iter_mut().enumerate().take(axes) {
        let (mut x2, mut v2, mut rows) = (0.0, 0.0, 0);
        for trace in traces {
            if trace.joint.iter().all(|j| j[axis] == [0.0; 2]) {
                continue;
            }
            for [x, v] in trace.joint.iter().map(|j| j[axis]) {
                x2 += x * x;
                v2 += v * v;
                scale.reach = scale.reach.max(x.abs());
            }
            rows += trace.joint.len();
        }
        scale.displacement = (x2 / rows as f64).sqrt();
        scale.velocity = (v2 / rows as f64).sqrt();
        // A joint that hardly leaves its free play tells nobody where the stops are; one that is
        // thrown about is not what anybody would log.
        let play = scale.reach / base.gap[axis];
        if !(1.6..8.0).contains(&play) || scale.reach > 0.6 * BOUND[axis] {
            return None;
        }
    }
    Some(scales)
}

impl Case {
    /// Draws case `number` of a campaign.
    ///
    /// # Errors
    /// When sixty rigs in a row are implausible, which points at a mistake in the draw.
    pub fn draw(options: &Options, number: usize) -> Result<Self, String> {
        let seed = case_seed(options.seed, number);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let subjects = subjects(options, &mut rng);
        let two_axes = subjects.iter().any(|s| s.takes_two_axes) || rng.random();
        let axes = if two_axes { 2 } else { 1 };
        let hidden: Vec<(&Subject, usize)> = subjects
            .iter()
            .map(|&s| {
                (
                    s,
                    if axes == 2 && !s.acts_on_both {
                        rng.random_range(0..2)
                    } else {
                        0
                    },
                )
            })
            .collect();
        let wanted: Vec<f64> = hidden
            .iter()
            .map(|_| 0.02 * 15f64.powf(rng.random::<f64>()))
            .collect();
        for _ in 0..MAX_DRAWS {
            if let Some(case) = Self::attempt(options, number, axes, &hidden, &wanted, &mut rng) {
                return Ok(case);
            }
        }
        Err(format!(
            "case {number} of seed {}: no plausible rig in {MAX_DRAWS} draws",
            options.seed
        ))
    }

    fn attempt(
        options: &Options,
        number: usize,
        axes: usize,
        hidden: &[(&'static Subject, usize)],
        wanted: &[f64],
        rng: &mut ChaCha8Rng,
    ) -> Option<Self> {
        let tolerances = options.tolerances.then(|| draw_tolerances(rng));
        let mut whole = draw_base(axes, rng);
        if options.tolerances {
            whole.rounding = rng.random_range(0.02..0.06);
        }
        let (base, base_terms) = take_out(&whole, axes, hidden);
        let mut shaking = Shaking::draw(rng);
        // What such an effect leaves hardly shows once its largest excursion has been reached.
        shaking.growing |= hidden.iter().any(|(s, _)| DEGRADING.contains(&s.name));
        let plans = plans(axes, shaking.validation_level);
        let runs: Vec<Run> = plans.iter().map(|plan| shaking.run(plan, rng)).collect();
        let (training, validation) = runs.split_at(runs.len() - 1);
        let mut rig = Rig {
            chains: draw_chains(rng),
            base,
            hidden: Vec::new(),
        };
        let healthy = Rig {
            base: whole,
            ..rig.clone()
        };
        let unloaded: Vec<Trace> = shake_all(&healthy, training, [0.0; 2])?;
        let scales = scales(&unloaded, axes, &whole)?;
        let mut faults = Vec::new();
        let mut order = Vec::new();
        for (subject, axis) in hidden {
            let sign = subject.sign(rng);
            match subject.plant(*axis, &whole, &scales[*axis], shaking.duration_s, rng) {
                Planted::Law(form) => {
                    order.push((true, rig.hidden.len()));
                    rig.hidden.push(Law {
                        form,
                        axis: *axis,
                        strength: sign,
                    });
                }
                Planted::InstrumentFault(fault) => {
                    order.push((false, faults.len()));
                    faults.push(Faulty {
                        fault,
                        axis: *axis,
                        strength: sign,
                    });
                }
            }
        }
        let top_speed = [0, 1].map(|a| 5.0 * scales[a].velocity);
        let want = |law: bool| -> Vec<f64> {
            let mut want: Vec<(usize, f64)> = order
                .iter()
                .zip(wanted)
                .filter(|((is_law, _), _)| *is_law == law)
                .map(|((_, place), w)| (*place, *w))
                .collect();
            want.sort_by_key(|(place, _)| *place);
            want.into_iter().map(|(_, w)| w).collect()
        };
        let (mut traces, law_shares, fault_shares) =
            find_strengths(&mut rig, &mut faults, &want(true), &want(false), |rig| {
                shake_all(rig, training, top_speed)
            })?;
        traces.extend(shake_all(&rig, validation, top_speed)?);
        let steps = [0.5e-6, 1e-6, 2e-6];
        let bits = [16, 17, 18];
        Some(Self {
            number,
            axes,
            hidden: hidden
                .iter()
                .zip(wanted)
                .zip(&order)
                .map(|(((subject, axis), wanted), (law, place))| Hidden {
                    subject,
                    axis: *axis,
                    wanted: *wanted,
                    shares: if *law {
                        law_shares[*place]
                    } else {
                        fault_shares[*place]
                    },
                })
                .collect(),
            rig,
            base_terms,
            faults,
            snr_db: *[None, Some(60.0), Some(40.0), Some(30.0)].choose(rng)?,
            tolerances,
            encoder_step: [
                *steps.choose(rng)?,
                std::f64::consts::TAU / f64::from(1 << bits.choose(rng)?),
            ],
            plans,
            traces,
            noise_seed: rng.random(),
            shaking,
        })
    }
}

fn shake_all(rig: &Rig, runs: &[Run], top_speed: [f64; 2]) -> Option<Vec<Trace>> {
    runs.iter()
        .map(|run| rig.shake(run, top_speed, BOUND))
        .collect()
}
