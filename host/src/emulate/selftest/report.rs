//! What the self-test said: reads its lines of text into numbers. `docs/notebook/emulation.md`
//! lists the lines.

/// The instructions that one evaluation takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instructions {
    /// Over how many inputs they were counted.
    pub inputs: u32,
    /// The fewest instructions over all inputs.
    pub least: u32,
    /// The most; the same as the fewest unless the time depends on the input.
    pub most: u32,
}

impl Instructions {
    /// Inputs, least and most, as the self-test writes them.
    fn read([inputs, least, most]: [&str; 3]) -> Option<Self> {
        Some(Self {
            inputs: inputs.parse().ok()?,
            least: least.parse().ok()?,
            most: most.parse().ok()?,
        })
    }
}

/// What the self-test found out about one model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelReport {
    /// `reference`, or the slot that holds it: `a` or `b`.
    pub name: String,
    /// The seed of the random points.
    pub seed: u64,
    /// The number of random points; the corner and centre points come before them.
    pub points: u32,
    /// The digest over all output bits.
    pub digest: u64,
    /// Its instructions, on boards that can count them.
    pub instructions: Option<Instructions>,
    /// The instructions of one sample from counts to verdict, through filters of the usual length.
    pub sample: Option<Instructions>,
    /// The most that one takes where a block of the monitor ends.
    pub ending: Option<u32>,
    /// The same as `sample` with a line of the mains in either force channel.
    pub humming: Option<Instructions>,
}

/// What the self-test found out about the on-board chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChainReport {
    /// The seed of the fixed motion.
    pub seed: u64,
    /// Samples that went through the chain.
    pub samples: u32,
    /// The digest over all bits of all outputs.
    pub digest: u64,
}

/// What a slot holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SlotState {
    /// The slot holds no model.
    NoModel,
    /// A model, which has its own [`ModelReport`].
    Model,
    /// Something that the device refuses, with its reason.
    Refused(String),
}

/// What the self-test says of one slot of the flash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SlotReport {
    /// The slot: `a` or `b`.
    pub name: String,
    /// What the slot holds.
    pub state: SlotState,
}

/// Everything that a finished self-test has printed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SelfTestReport {
    /// The board: `stm32f405` or `microbit`.
    pub board: String,
    /// What clocks the processor: `crystal` or `internal`.
    pub clock_source: String,
    /// The processor's clock in Hz.
    pub clock_hz: u32,
    /// One entry per model.
    pub models: Vec<ModelReport>,
    /// The on-board chain with the reference model.
    pub chain: Option<ChainReport>,
    /// One entry per slot; none on a board without slots.
    pub slots: Vec<SlotReport>,
    /// The device's own sentences about what was wrong.
    pub complaints: Vec<String>,
    /// How many of its checks failed.
    pub errors: u32,
    /// Whether all of them passed.
    pub passed: bool,
}

impl SelfTestReport {
    /// The model of this name, if the self-test evaluated one.
    pub fn model(&self, name: &str) -> Option<&ModelReport> {
        self.models.iter().find(|model| model.name == name)
    }

    /// What the slot of this name holds, if the board has it.
    pub fn slot(&self, name: &str) -> Option<&SlotState> {
        self.slots
            .iter()
            .find(|slot| slot.name == name)
            .map(|slot| &slot.state)
    }

    /// Takes the instruction counts, and whatever failed, from another run of the same image.
    pub(super) fn add_counts(&mut self, counted: SelfTestReport) {
        for model in &mut self.models {
            let seen = counted.model(&model.name);
            model.instructions = seen.and_then(|seen| seen.instructions);
            model.sample = seen.and_then(|seen| seen.sample);
            model.ending = seen.and_then(|seen| seen.ending);
            model.humming = seen.and_then(|seen| seen.humming);
        }
        self.errors = self.errors.max(counted.errors);
        self.passed &= counted.passed;
        let new = counted.complaints.into_iter();
        let new: Vec<_> = new.filter(|what| !self.complaints.contains(what)).collect();
        self.complaints.extend(new);
    }

    /// Reads the whole text of a run.
    ///
    /// # Errors
    /// Says, as the end of a sentence, what is missing or not understood.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let mut report = Self {
            board: String::new(),
            clock_source: String::new(),
            clock_hz: 0,
            models: Vec::new(),
            chain: None,
            slots: Vec::new(),
            complaints: Vec::new(),
            errors: 0,
            passed: false,
        };
        let mut finished = false;
        for line in text.lines() {
            let read = report.line(line, &mut finished);
            read.ok_or_else(|| format!("its line “{line}” is not understood"))?;
        }
        if finished && !report.board.is_empty() && report.clock_hz > 0 {
            Ok(report)
        } else {
            Err("its text breaks off".to_owned())
        }
    }

    /// Reads one line; `None` when it is not as it should be.
    fn line(&mut self, line: &str, finished: &mut bool) -> Option<()> {
        let words: Vec<&str> = line.split(' ').collect();
        match words[..] {
            ["selftest", _] | ["decoder", ..] => {}
            ["board", name] => self.board = name.to_owned(),
            ["clock", source, hz] => {
                self.clock_source = source.to_owned();
                self.clock_hz = hz.parse().ok()?;
            }
            ["error", ..] => self
                .complaints
                .push(line.strip_prefix("error ")?.to_owned()),
            ["digest", name, "seed", seed, "points", points, digest] => {
                self.models.push(ModelReport {
                    name: name.to_owned(),
                    seed: seed.parse().ok()?,
                    points: points.parse().ok()?,
                    digest: hexadecimal(digest)?,
                    instructions: None,
                    sample: None,
                    ending: None,
                    humming: None,
                });
            }
            ["chain", "seed", seed, "samples", samples, digest] => {
                self.chain = Some(ChainReport {
                    seed: seed.parse().ok()?,
                    samples: samples.parse().ok()?,
                    digest: hexadecimal(digest)?,
                });
            }
            ["instructions" | "sample" | "humming", ..] => self.cost(&words)?,
            ["slot", name, "no", "model"] => self.add_slot(name, SlotState::NoModel),
            ["slot", name, "model"] => self.add_slot(name, SlotState::Model),
            ["slot", name, "refused:", ..] => {
                let (_, why) = line.split_once("refused: ")?;
                self.add_slot(name, SlotState::Refused(why.to_owned()));
            }
            ["errors", errors] => self.errors = errors.parse().ok()?,
            ["result", result] => {
                self.passed = match result {
                    "passed" => true,
                    "failed" => false,
                    _ => return None,
                };
                *finished = true;
            }
            _ => return None,
        }
        Some(())
    }

    /// Reads a line that says how many instructions something takes.
    fn cost(&mut self, words: &[&str]) -> Option<()> {
        let (what, name, count) = match *words {
            [
                what @ "instructions",
                name,
                "inputs",
                inputs,
                "min",
                least,
                "max",
                most,
            ] => (what, name, [inputs, least, most]),
            [
                what @ ("sample" | "humming"),
                name,
                "taps",
                _,
                _,
                "samples",
                samples,
                "min",
                least,
                "max",
                most,
                "ending",
                _,
            ] => (what, name, [samples, least, most]),
            _ => return None,
        };
        let model = self.models.iter_mut().find(|model| model.name == name)?;
        if let ["sample", .., ending] = *words {
            model.ending = Some(ending.parse().ok()?);
        }
        let place = match what {
            "instructions" => &mut model.instructions,
            "sample" => &mut model.sample,
            _ => &mut model.humming,
        };
        *place = Some(Instructions::read(count)?);
        Some(())
    }

    fn add_slot(&mut self, name: &str, state: SlotState) {
        self.slots.push(SlotReport {
            name: name.to_owned(),
            state,
        });
    }
}

fn hexadecimal(text: &str) -> Option<u64> {
    u64::from_str_radix(text.strip_prefix("0x")?, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
selftest 0.1.0
board stm32f405
clock internal 16000000
digest reference seed 7 points 10 0x00000000000000ff
instructions reference inputs 500 min 1200 max 1201
sample reference taps 41 129 samples 1000 min 3000 max 3100 ending 4200
humming reference taps 41 129 samples 1000 min 3090 max 3190 ending 4300
chain seed 7 samples 20 0x000000000000beef
error the instructions of reference depend on its input
decoder taken 2 refused 64 errors 0
slot a model
digest a seed 7 points 10 0xffffffffffffffff
slot b refused: the blob's checksum is 00000000, but its bytes give 12345678
errors 2
result failed
";

    #[test]
    fn every_line_lands_in_its_place() {
        let report = SelfTestReport::parse(TEXT).unwrap();
        assert_eq!(
            (report.board.as_str(), report.clock_hz),
            ("stm32f405", 16_000_000)
        );
        assert_eq!(report.clock_source, "internal");
        let reference = report.model("reference").unwrap();
        assert_eq!(
            (reference.seed, reference.points, reference.digest),
            (7, 10, 255)
        );
        let counted = Instructions {
            inputs: 500,
            least: 1200,
            most: 1201,
        };
        assert_eq!(reference.instructions, Some(counted));
        let counted = Instructions {
            inputs: 1000,
            least: 3000,
            most: 3100,
        };
        assert_eq!(reference.sample, Some(counted));
        assert_eq!(reference.ending, Some(4200));
        assert_eq!(reference.humming.map(|with| with.most), Some(3190));
        assert_eq!(report.model("a").unwrap().digest, u64::MAX);
        let chain = ChainReport {
            seed: 7,
            samples: 20,
            digest: 0xbeef,
        };
        assert_eq!(report.chain, Some(chain));
        assert_eq!(report.slot("a"), Some(&SlotState::Model));
        let Some(SlotState::Refused(why)) = report.slot("b") else {
            panic!("{:?}", report.slots)
        };
        assert!(why.ends_with("give 12345678"));
        assert_eq!(report.complaints.len(), 1);
        assert_eq!((report.errors, report.passed), (2, false));
    }

    #[test]
    fn a_text_that_breaks_off_anywhere_is_refused() {
        for (end, _) in TEXT.match_indices('\n') {
            if end + 1 < TEXT.len() {
                assert!(
                    SelfTestReport::parse(&TEXT[..end]).is_err(),
                    "{}",
                    &TEXT[..end]
                );
            }
        }
    }

    #[test]
    fn a_line_that_is_not_understood_is_named() {
        let why = SelfTestReport::parse("board b\nhello there\n").unwrap_err();
        assert!(why.contains("hello there"), "{why}");
    }

    #[test]
    fn a_failure_while_counting_fails_the_whole() {
        let good = TEXT
            .replace("failed", "passed")
            .replace("errors 2", "errors 0");
        let mut first = SelfTestReport::parse(&good).unwrap();
        first.add_counts(SelfTestReport::parse(TEXT).unwrap());
        assert_eq!((first.errors, first.passed), (2, false));
        assert_eq!(
            first.complaints.len(),
            1,
            "the same sentence is not said twice"
        );
    }
}
