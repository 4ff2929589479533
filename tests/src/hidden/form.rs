//! The forms of the force laws that can be hidden in the joint.

use super::wild::Wild;

/// A law's form; lengths and speeds are in the units of its axis (m, rad, m/s, rad/s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// Hooke's spring x.
    Spring,
    /// Linear damper v.
    Damper,
    /// A spring beyond half the free play `gap` on either side.
    Play {
        /// Half the free play.
        gap: f64,
    },
    /// The paper's Eq. (16): friction in one axis's contact that depends on the other axis.
    ContactCoupling {
        /// Half the free play of both axes, translation first.
        gaps: [f64; 2],
        /// Coefficient of the second product over that of the first.
        ratio: f64,
        /// Lever arm through which the same force turns the body, m.
        lever: f64,
    },
    /// Dry friction that changes sign within `edge` of rest.
    Dry {
        /// Speed at which friction has 71 % of its full size.
        edge: f64,
    },
    /// Stribeck curve with a Gaussian: static over kinetic friction `ratio`, decaying over `speed`.
    Stribeck {
        /// Static over kinetic friction.
        ratio: f64,
        /// Speed at which the excess has fallen to 1/e.
        speed: f64,
        /// Speed at which friction has 71 % of its full size, as in [`Form::Dry`].
        edge: f64,
    },
    /// Turbulent drag v·|v|.
    Drag,
    /// Duffing's x³.
    Duffing,
    /// A spring that only acts for x > 0.
    OneSided,
    /// A spring beyond a far stop on either side.
    Stop {
        /// Where the stop is.
        at: f64,
    },
    /// Wen's hysteresis ż = v − |v|·|z|ⁿ⁻¹·z·β − v·|z|ⁿ·γ with (β + γ)·z_yⁿ = 1; force z/z_y.
    Wen {
        /// z_y, where the loop saturates.
        saturation: f64,
        /// β/(β + γ); at 1 only the term with |v| is left.
        roundness: f64,
        /// n, the larger the sharper the knee.
        exponent: f64,
    },
    /// Wen's hysteresis with n = 1 that never saturates: ż = v + α·v·|z| + β·|v|·z, α above |β|, β
    /// below 0; force z.
    HardeningWen {
        /// α, one over a length.
        both_ways: f64,
        /// −β, one over a length, above 0.
        unloading: f64,
    },
    /// [`Form::Wen`] with β = γ behind a slip lock: ż times 1 − ζ₁·exp(−(z·sign v − q·z_y)²/ζ₂²).
    PinchedWen {
        /// z_y, where the loop saturates.
        saturation: f64,
        /// n, the larger the sharper the knee.
        exponent: f64,
        /// ζ₁, the part of ż that is lost at the pinch.
        lost: f64,
        /// q·z_y, where z·sign v has the pinch.
        level: f64,
        /// ζ₂, how wide the pinch is in z.
        width: f64,
    },
    /// [`Form::Wen`] with β = γ whose ż falls as the largest |x| grows: to a half where that is
    /// `excursion`. The second memory is that |x|.
    TiredWen {
        /// z_y, where the loop saturates.
        saturation: f64,
        /// n, the larger the sharper the knee.
        exponent: f64,
        /// Largest |x| after which it is half as stiff.
        excursion: f64,
        /// How far from no force it slips as well, in z, the more the softer it has become:
        /// Baber's and Noori's Gaussian.
        slip: Option<f64>,
    },
    /// A spring in series with a dry slider (Jenkin's element).
    SpringSlider {
        /// Extension at which it slips.
        slip: f64,
    },
    /// Dahl's pre-sliding friction with exponent 1: dz/dx = 1 − z/z_c·sign v.
    Dahl {
        /// z_c, towards which z goes.
        saturation: f64,
    },
    /// LuGre: bristles of mean deflection z, ż = v − |v|·z/(z_c·g(v)), force z/z_c + damping·ż.
    Bristles {
        /// z_c, the deflection under kinetic friction.
        deflection: f64,
        /// Static over kinetic friction.
        ratio: f64,
        /// Speed at which the excess of static friction has fallen to 1/e.
        speed: f64,
        /// σ₁·z_c over the kinetic friction, s.
        damping_s: f64,
    },
    /// A spring in series with a damper.
    SpringDamper {
        /// Damper over spring, s.
        relaxation_s: f64,
    },
    /// Dry friction of a shaft that is not round: a triangle wave over the displacement, along the
    /// direction.
    UnroundDry {
        /// Length of one turn.
        pitch: f64,
        /// Phase at x = 0, rad.
        phase: f64,
        /// As in [`Form::Dry`].
        edge: f64,
    },
    /// A force periodic in the displacement.
    Teeth {
        /// Length of one period.
        pitch: f64,
        /// Phase at x = 0, rad.
        phase: f64,
    },
    /// A constant force, 1 whatever the motion.
    Constant,
    /// A spring between the two axes: energy strength·x·φ.
    CrossSpring,
    /// A spring that grows in proportion to the time since the record began.
    GrowingSpring {
        /// Time after which it has its full strength, s.
        duration_s: f64,
    },
    /// Dry friction, backwards another one.
    SidedDry {
        /// Speed at which friction has 71 % of its full size, as in [`Form::Dry`].
        edge: f64,
        /// Friction backwards over that forwards.
        back: f64,
    },
    /// A damper, backwards another one.
    SidedDamper {
        /// Damping backwards over that forwards.
        back: f64,
    },
    /// A dry slider, a spring and a gap in series.
    GapSlider {
        /// Half the gap.
        gap: f64,
        /// Way of the spring until the slider slips.
        slip: f64,
        /// Force backwards over that forwards.
        back: f64,
    },
    /// [`Form::Wen`] with another force backwards.
    SidedWen {
        /// z_y of [`Form::Wen`].
        saturation: f64,
        /// β/(β + γ) of [`Form::Wen`].
        roundness: f64,
        /// n of [`Form::Wen`].
        exponent: f64,
        /// Force backwards over that forwards.
        back: f64,
    },
    /// A spring with a power of the displacement.
    PowerSpring {
        /// The power of displacement over `length`.
        exponent: f64,
        /// Displacement at which the power is 1.
        length: f64,
        /// Force at negative displacement over that at positive.
        back: f64,
    },
    /// A damper with a power of the velocity, rounded at rest.
    PowerDamper {
        /// The power of velocity over `speed`.
        exponent: f64,
        /// Velocity at which the power is 1.
        speed: f64,
        /// Force backwards over that forwards.
        back: f64,
    },
    /// A damper up to the velocity at which its valve opens, one in either direction, and a level
    /// beyond; the return is `back` times as strong.
    ReliefValve {
        /// Where it opens ahead and back, m/s or rad/s.
        opens: [f64; 2],
        /// The return's strength beside the way ahead.
        back: f64,
    },
    /// Gas of the polytropic index `index` behind a piston on either side, `back` times as much on
    /// the lower one; shut off at x = 0.
    Piston {
        /// From x = 0 to where no gas is left.
        length: f64,
        /// n, where p·Vⁿ stays the same.
        index: f64,
        /// Gas on the lower side over that on the upper one.
        back: f64,
    },
    /// A spring whose stiffness is its force over `length`, on either side; `back` times as much on
    /// the lower one.
    Foam {
        /// Over which the force grows by a factor of e.
        length: f64,
        /// Force of the lower side over that of the upper one.
        back: f64,
    },
    /// Springs or contacts by Hertz's law or another power, each met at a place of its own, signed.
    PlacedContact {
        /// Where the upper and the lower one are met.
        at: [f64; 2],
        /// Power of the penetration.
        exponent: f64,
        /// What the penetration is relative to.
        length: f64,
        /// Force of the lower contact over that of the upper one.
        back: f64,
    },
    /// A wave over the displacement with its second harmonic.
    UnevenTeeth {
        /// Length of a tooth.
        pitch: f64,
        /// Phases of the first and the second harmonic, rad.
        phases: [f64; 2],
        /// Second over first harmonic.
        second: f64,
    },
    /// A damper that gives way above a knee: v/(1 + |v|/knee).
    Valve {
        /// Velocity at which half the slope's force is left.
        knee: f64,
    },
    /// Dry friction behind a lag: ż = (direction − z)/lag.
    LateFriction {
        /// Speed at which the direction has 71 % of its full size, as in [`Form::Dry`].
        edge: f64,
        /// Time of the lag, s.
        lag_s: f64,
    },
    /// A spring times a power of the other axis's displacement.
    SpringTimesOther {
        /// The power of the other axis's displacement.
        power: i32,
    },
    /// A damper times a power of the other axis's displacement.
    DamperTimesOther {
        /// The power of the other axis's displacement.
        power: i32,
    },
    /// Dry friction that grows along the travel.
    TighterAlong {
        /// Speed at which friction has 71 % of its full size, as in [`Form::Dry`].
        edge: f64,
        /// Displacement at which it has its full size.
        length: f64,
    },
    /// Dry friction under the load of the spring that is deflected.
    RingSpring {
        /// Speed at which friction has 71 % of its full size, as in [`Form::Dry`].
        edge: f64,
    },
    /// What follows behind a lost motion, and pulls back as a spring does.
    LostMotion {
        /// Half of the lost motion.
        half: f64,
    },
    /// [`Form::Wen`] that grows with the speed: times 1 + gain·(1 − exp(−|v|/speed)).
    ThickeningWen {
        /// z_y of [`Form::Wen`].
        saturation: f64,
        /// β/(β + γ) of [`Form::Wen`].
        roundness: f64,
        /// n of [`Form::Wen`].
        exponent: f64,
        /// How much stronger it is in quick motion.
        gain: f64,
        /// Speed of quick motion.
        speed: f64,
    },
    /// [`Form::Wen`] that grips more at some places: times 1 + along·u + across·u² with u =
    /// x/length.
    PlacedWen {
        /// z_y of [`Form::Wen`].
        saturation: f64,
        /// β/(β + γ) of [`Form::Wen`].
        roundness: f64,
        /// n of [`Form::Wen`].
        exponent: f64,
        /// Displacement at which both have their full size.
        length: f64,
        /// From one end to the other.
        along: f64,
        /// From the middle to both ends.
        across: f64,
    },
    /// A contact beyond a gap on either side whose force follows a power of its depth.
    BufferedContact {
        /// Half the free play.
        gap: f64,
        /// The power of depth over `length`.
        exponent: f64,
        /// Depth of full strength.
        length: f64,
        /// Strength backwards over forwards.
        back: f64,
    },
    /// Flag-shaped: a spring to a slide that gives way beyond `gap`, and comes back where the
    /// spring has fallen to `opening`.
    Flag {
        /// Deflection of the spring where it slides.
        gap: f64,
        /// Deflection where it slides back.
        opening: f64,
    },
    /// A spring lost in proportion to the largest excursion so far.
    Softening {
        /// Excursion at which its full strength is lost.
        excursion: f64,
    },
    /// Outside the library: dry friction that comes and goes with time.
    FrictionInBouts {
        /// Speed at which friction has 71 % of its full size, as in [`Form::Dry`].
        edge: f64,
        /// Time from one onset to the next, s.
        period_s: f64,
        /// Phase of the bouts when the record begins, rad.
        phase: f64,
    },
    /// Outside the library: a spring that acts on where the joint was.
    LateSpring {
        /// How long ago, s.
        delay_s: f64,
    },
    /// Outside the library: a force from outside that the log does not hold.
    Unlogged,
    /// Outside the library: a spring that swings in time, as a shaft with unequal stiffness does
    /// when it turns.
    SwingingSpring {
        /// Frequency of the stiffness, Hz.
        frequency_hz: f64,
        /// Phase of the stiffness when the record begins, rad.
        phase: f64,
    },
    /// Damping that grows with the square of the distance from a place.
    SqueezeFilm {
        /// The place where nothing damps.
        centre: f64,
    },
    /// Outside the library: three waves along the displacement, each half as long and half as
    /// strong as the one before.
    SmoothSpring {
        /// Displacement in which the longest wave turns by one radian.
        length: f64,
        /// Phases of the waves at x = 0, rad, the longest wave first.
        phases: [f64; 3],
    },
    /// Outside the library: drawn at random.
    Wild(Wild),
    /// Outside the library: damping where the displacement is positive.
    HalfDamper {
        /// Displacement over which it sets in.
        edge: f64,
    },
}
