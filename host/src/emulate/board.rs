//! A board's worth of chips at their chip selects, moved from sample instant to sample instant, and
//! what a test breaks on it.

use super::chips::ads131m04::{Ads131m04, UNITS_PER_CODE_AT_GAIN_1};
use super::chips::adxl355::Adxl355;
use super::chips::ls7366r::Ls7366r;
use super::chips::{Chip, UNDRIVEN};
use jointwatch_shared::wire::wiring::{ACCELEROMETERS, COUNTERS, Readings, Wiring};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A chip of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoardChip {
    /// A quadrature counter, from 0.
    Counter(usize),
    /// The analogue-to-digital converter of the strain bridges.
    Converter,
    /// An accelerometer, from 0.
    Accelerometer(usize),
}

/// What is wrong with a chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// It neither hears nor answers; its line reads this byte.
    Silent(u8),
    /// One bit of everything that it answers is wrong.
    Damaged,
    /// Another chip sits in its place: an ADS131M02, or a PARTID that is no ADXL355's. A counter
    /// has no identity, and is silent.
    Replaced,
    /// It lost its supply at the first of the instants.
    PowerCut,
    /// What it measures does not move any more.
    Stuck,
    /// What it measures is beyond its range. A counter has none, and is stuck.
    Saturated,
}

/// A trouble from one sample to another, counted from the device's first one; the last is no longer
/// in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Injection {
    /// Which chip of the board fails.
    pub place: BoardChip,
    /// What is wrong with it.
    pub trouble: Trouble,
    /// The samples in which it happens.
    pub samples: std::ops::Range<u64>,
}

/// Transfers that do not take place: the chip does not hear them, and the line reads ones.
#[derive(Clone, Debug, PartialEq)]
pub struct DropOuts {
    /// The part of the transfers.
    pub part: f64,
    /// The samples in which it happens.
    pub samples: std::ops::Range<u64>,
}

/// What lies at the chips' inputs, in units that no setting of a chip changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Inputs {
    /// Quarters of the encoders' cycles.
    edges: [i64; COUNTERS],
    /// Converter codes at gain 128.
    bridges: [i64; 4],
    /// Codes of the narrowest range.
    accelerations: [[i64; 3]; ACCELEROMETERS],
}

impl Inputs {
    /// What has to lie at the inputs for chips that are set as the wiring says to read this.
    fn of(wiring: &Wiring, readings: &Readings) -> Self {
        let mut inputs = Self::default();
        let counters = wiring.counters.iter().zip(readings.counters);
        for (edges, (settings, count)) in inputs.edges.iter_mut().zip(counters) {
            let quadrature = settings.map_or(4, |counter| i64::from(counter.quadrature));
            *edges = i64::from(count) * 4 / quadrature;
        }
        let channels = wiring.converter.gain_log2.iter().zip(readings.channels);
        for (bridge, (gain, code)) in inputs.bridges.iter_mut().zip(channels) {
            *bridge = i64::from(code) * (UNITS_PER_CODE_AT_GAIN_1 >> gain);
        }
        let chips = wiring.accelerometers.iter().zip(readings.accelerations);
        for (places, (settings, codes)) in inputs.accelerations.iter_mut().zip(chips) {
            let range = settings.map_or(1, |chip| chip.range);
            for (place, code) in places.iter_mut().zip(codes) {
                *place = i64::from(code) << (range - 1);
            }
        }
        inputs
    }
}

/// The chips of a board.
pub struct Board {
    wiring: Wiring,
    sample_rate_hz: f64,
    counters: [Ls7366r; COUNTERS],
    converter: Ads131m04,
    accelerometers: [Adxl355; ACCELEROMETERS],
    /// What lay at the inputs before, for conversions between two instants.
    before: Inputs,
    /// Conversions that are due, and results of each accelerometer.
    due: [f64; 1 + ACCELEROMETERS],
    injections: Vec<Injection>,
    drop_outs: Option<DropOuts>,
    chance: ChaCha8Rng,
    /// The sample that is being taken; `None` before the first.
    sample: Option<u64>,
}

impl Board {
    /// The chips that `wiring` has fitted, sampled at this rate. The same seed gives the same
    /// drop-outs.
    pub fn new(wiring: &Wiring, sample_rate_hz: f64, seed: u64) -> Self {
        Self {
            wiring: wiring.clone(),
            sample_rate_hz,
            counters: Default::default(),
            converter: Ads131m04::default(),
            accelerometers: Default::default(),
            before: Inputs::default(),
            due: [0.0; 1 + ACCELEROMETERS],
            injections: Vec::new(),
            drop_outs: None,
            chance: ChaCha8Rng::seed_from_u64(seed),
            sample: None,
        }
    }

    /// What is to go wrong.
    pub fn with_troubles(
        mut self,
        injections: Vec<Injection>,
        drop_outs: Option<DropOuts>,
    ) -> Self {
        self.injections = injections;
        self.drop_outs = drop_outs;
        self
    }

    /// The chips feel and count what the next instant brings; gives its number.
    pub fn next_instant(&mut self, readings: &Readings) -> u64 {
        let sample = self.sample.map_or(0, |sample| sample + 1);
        self.sample = Some(sample);
        let mut inputs = Inputs::of(&self.wiring, readings);
        for Injection {
            place,
            trouble,
            samples,
        } in self.injections.clone()
        {
            match trouble {
                Trouble::PowerCut | Trouble::Replaced if sample == samples.start => {
                    self.lose_supply(place, trouble == Trouble::Replaced);
                }
                Trouble::Replaced if sample == samples.end => self.lose_supply(place, false),
                Trouble::Stuck | Trouble::Saturated if samples.contains(&sample) => {
                    self.hold(&mut inputs, place, trouble == Trouble::Saturated);
                }
                _ => {}
            }
        }
        for (counter, edges) in self.counters.iter_mut().zip(inputs.edges) {
            counter.turn_to(edges);
        }
        // The newest conversion belongs to this instant; those between two instants hold what was
        // before.
        let conversions = self.conversions(0, self.converter.rate_hz());
        for left in (0..conversions).rev() {
            let at = if left == 0 { &inputs } else { &self.before };
            self.converter.convert(at.bridges);
        }
        for chip in 0..ACCELEROMETERS {
            let rate = self.accelerometers[chip].rate_hz();
            if self.conversions(1 + chip, rate) > 0 {
                self.accelerometers[chip].measure(inputs.accelerations[chip]);
            }
        }
        self.before = inputs;
        sample
    }

    /// Conversions that end with this instant, at most a handful of which matter.
    fn conversions(&mut self, place: usize, rate_hz: f64) -> u32 {
        let due = &mut self.due[place];
        *due += rate_hz / self.sample_rate_hz;
        let whole = due.floor();
        *due -= whole;
        whole.min(4.0) as u32
    }

    fn lose_supply(&mut self, place: BoardChip, replaced: bool) {
        match (place, replaced) {
            (BoardChip::Counter(n), _) => self.counters[n].power_on(),
            (BoardChip::Converter, true) => self.converter.replaced(0x2201),
            (BoardChip::Converter, false) => self.converter.replaced(0x2401),
            (BoardChip::Accelerometer(n), true) => self.accelerometers[n].replaced(0xF2),
            (BoardChip::Accelerometer(n), false) => self.accelerometers[n].replaced(0xED),
        }
    }

    /// Keeps a chip's inputs where they were, or far beyond its range.
    fn hold(&self, inputs: &mut Inputs, place: BoardChip, saturated: bool) {
        /// More than any chip can take, and far from overflowing.
        const BEYOND: i64 = 1 << 40;
        match place {
            BoardChip::Counter(n) => inputs.edges[n] = self.before.edges[n],
            BoardChip::Converter if saturated => inputs.bridges = [BEYOND; 4],
            BoardChip::Converter => inputs.bridges = self.before.bridges,
            BoardChip::Accelerometer(n) if saturated => inputs.accelerations[n] = [-BEYOND; 3],
            BoardChip::Accelerometer(n) => inputs.accelerations[n] = self.before.accelerations[n],
        }
    }

    /// One transfer with one chip.
    pub fn select(&mut self, place: BoardChip, bytes: &mut [u8]) {
        if !self.is_fitted(place) || self.drops_out() {
            return bytes.fill(UNDRIVEN);
        }
        let trouble = self.trouble(place);
        if let Some(Trouble::Silent(level)) = trouble {
            return bytes.fill(level);
        }
        match place {
            BoardChip::Counter(_) if trouble == Some(Trouble::Replaced) => bytes.fill(UNDRIVEN),
            BoardChip::Counter(n) => self.counters[n].select(bytes),
            BoardChip::Converter => self.converter.select(bytes),
            BoardChip::Accelerometer(n) => self.accelerometers[n].select(bytes),
        }
        if trouble == Some(Trouble::Damaged) {
            // The second byte's lowest bit, behind what every chip begins with.
            if let Some(byte) = bytes.get_mut(1) {
                *byte ^= 1;
            }
        }
    }

    /// One transfer with all counters at once; what they answer is lost.
    pub fn select_counters(&mut self, bytes: &[u8]) {
        for n in 0..COUNTERS {
            let place = BoardChip::Counter(n);
            let deaf = matches!(
                self.trouble(place),
                Some(Trouble::Silent(_) | Trouble::Replaced)
            );
            if self.is_fitted(place) && !deaf {
                self.counters[n].select(&mut bytes.to_vec());
            }
        }
    }

    fn is_fitted(&self, place: BoardChip) -> bool {
        match place {
            BoardChip::Counter(n) => self.wiring.counters[n].is_some(),
            BoardChip::Converter => true,
            BoardChip::Accelerometer(n) => self.wiring.accelerometers[n].is_some(),
        }
    }

    fn trouble(&self, place: BoardChip) -> Option<Trouble> {
        let sample = self.sample?;
        let mut troubles = self.injections.iter();
        let found = troubles.find(|i| i.place == place && i.samples.contains(&sample));
        found.map(|injection| injection.trouble)
    }

    fn drops_out(&mut self) -> bool {
        match (&self.drop_outs, self.sample) {
            (Some(drop_outs), Some(sample)) if drop_outs.samples.contains(&sample) => {
                let part = drop_outs.part;
                self.chance.random_bool(part)
            }
            _ => false,
        }
    }
}
