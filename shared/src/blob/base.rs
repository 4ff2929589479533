//! The base's part of a blob: the blocks of a polynomial or the neurons of a network, in the bytes that both share.

use super::unless_zero;
use crate::error::Error;
use crate::model::Base;
use crate::model::network::{NEURONS, NetworkModel, Neuron};
use crate::model::polynomial::{BLOCKS, Block, PolynomialModel};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Where the base begins.
pub(super) const OFFSET: usize = 216;
/// Its bytes, those of a polynomial; a base that needs fewer leaves zeros behind it.
pub(super) const LEN: usize = 2 * BLOCKS * (16 + 1) * size_of::<i32>();
/// Where the orders and shifts of a polynomial stand in the header.
const ORDERS_OFFSET: usize = 32;

/// The tag of a polynomial base. Tags are never reused.
const POLYNOMIAL: u8 = 1;
/// The tag of a network base.
const NETWORK: u8 = 2;
/// The tag of no base: the force is that of the effects alone.
const NONE: u8 = 3;

/// Neurons of one of the two arrays of a network: an array of 40 is beyond what serde takes.
const HALF_OF_NEURONS: usize = NEURONS / 2;

/// What the header says about the base.
#[derive(Clone, Copy)]
pub(super) struct BaseHeader {
    /// Which kind it is.
    pub(super) tag: u8,
    /// One or two.
    pub(super) axes: u8,
    /// Of a polynomial; 0 for others.
    pub(super) orders: [u8; 4],
    /// Of a polynomial; 0 for others.
    pub(super) shifts: [u8; 2],
}

impl BaseHeader {
    /// Refuses what only a polynomial has.
    fn unless_polynomial(&self) -> Result<(), Error> {
        unless_zero(ORDERS_OFFSET, &self.orders)?;
        unless_zero(ORDERS_OFFSET + self.orders.len(), &self.shifts)
    }
}

/// A stored integer: four bytes, little-endian, instead of postcard's variable length.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Word(#[serde(with = "postcard::fixint::le")] i32);

/// A stored bias: eight bytes, little-endian.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Bias(#[serde(with = "postcard::fixint::le")] i64);

/// A polynomial: 2176 bytes, the whole of the base.
#[derive(Serialize, Deserialize)]
struct PolynomialMessage {
    blocks: [[BlockMessage; BLOCKS]; 2],
}

/// The words of one block, and its gain.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct BlockMessage {
    words: [Word; 16],
    gain: Word,
}

/// A network: 1460 bytes.
#[derive(Serialize, Deserialize)]
struct NetworkMessage {
    #[serde(with = "postcard::fixint::le")]
    neurons: u32,
    output_bias: [Bias; 2],
    neuron: [[NeuronMessage; HALF_OF_NEURONS]; 2],
}

/// One neuron; all zero beyond the number of neurons.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct NeuronMessage {
    weights: [Word; 4],
    outputs: [Word; 2],
    bias: Bias,
    #[serde(with = "postcard::fixint::le")]
    steps: u32,
}

/// What the header says about `base`.
pub(super) fn header(base: &Base) -> BaseHeader {
    match base {
        Base::Polynomial(polynomial) => BaseHeader {
            tag: POLYNOMIAL,
            axes: polynomial.axes,
            orders: polynomial.orders,
            shifts: polynomial.shifts,
        },
        Base::Network(network) => BaseHeader {
            tag: NETWORK,
            axes: network.axes,
            orders: [0; 4],
            shifts: [0; 2],
        },
        Base::None { axes } => BaseHeader {
            tag: NONE,
            axes: *axes,
            orders: [0; 4],
            shifts: [0; 2],
        },
    }
}

/// Writes `base` to the beginning of `bytes`, which are [`LEN`] zeros.
pub(super) fn write(base: &Base, bytes: &mut [u8]) {
    // The messages have fixed lengths of at most LEN, which a test pins.
    let _ = match base {
        Base::Polynomial(polynomial) => {
            postcard::to_slice(&PolynomialMessage::of(polynomial), bytes)
        }
        Base::Network(network) => postcard::to_slice(&NetworkMessage::of(network), bytes),
        Base::None { .. } => Ok(&mut [][..]),
    };
}

/// The base in `bytes`; the sums of its evaluation are checked with the model that it becomes part of.
pub(super) fn read(header: BaseHeader, bytes: &[u8; LEN]) -> Result<Base, Error> {
    // Every field has a fixed width and takes any bytes, so no message fails to be read from bytes enough.
    let too_short = |_| Error::BlobLength {
        seen: OFFSET + LEN,
        wanted: super::BLOB_LEN,
    };
    match header.tag {
        POLYNOMIAL => {
            let message: PolynomialMessage = postcard::from_bytes(bytes).map_err(too_short)?;
            Ok(Base::Polynomial(message.model(header)))
        }
        NETWORK => {
            header.unless_polynomial()?;
            let (message, rest): (NetworkMessage, _) =
                postcard::take_from_bytes(bytes).map_err(too_short)?;
            unless_zero(OFFSET + LEN - rest.len(), rest)?;
            Ok(Base::Network(message.model(header.axes)?))
        }
        NONE => {
            header.unless_polynomial()?;
            unless_zero(OFFSET, bytes)?;
            Ok(Base::None { axes: header.axes })
        }
        seen => Err(Error::BlobField {
            field: "kind of base",
            seen,
        }),
    }
}

impl PolynomialMessage {
    fn of(polynomial: &PolynomialModel) -> Self {
        Self {
            blocks: polynomial.blocks.map(|blocks| {
                blocks.map(|block| BlockMessage {
                    words: block.words.map(Word),
                    gain: Word(block.gain),
                })
            }),
        }
    }

    fn model(&self, header: BaseHeader) -> PolynomialModel {
        PolynomialModel {
            orders: header.orders,
            axes: header.axes,
            shifts: header.shifts,
            blocks: self.blocks.map(|blocks| {
                blocks.map(|block| Block {
                    words: block.words.map(|word| word.0),
                    gain: block.gain.0,
                })
            }),
        }
    }
}

impl NetworkMessage {
    fn of(network: &NetworkModel) -> Self {
        let mut neuron = [[NeuronMessage::EMPTY; HALF_OF_NEURONS]; 2];
        let places = neuron.as_flattened_mut().iter_mut();
        for (place, stored) in places.zip(&network.neurons) {
            *place = NeuronMessage {
                weights: stored.weights.map(Word),
                outputs: stored.outputs.map(Word),
                bias: Bias(stored.bias),
                steps: stored.steps,
            };
        }
        Self {
            neurons: network.neurons.len() as u32,
            output_bias: network.output_bias.map(Bias),
            neuron,
        }
    }

    fn model(&self, axes: u8) -> Result<NetworkModel, Error> {
        let stated = f64::from(self.neurons);
        Error::unless_within("number of neurons", stated, 1.0, NEURONS as f64)?;
        let mut neurons = Vec::new();
        for (number, message) in (0..).zip(self.neuron.as_flattened()) {
            if number < self.neurons {
                // The list holds as many as the arrays do.
                let _ = neurons.push(message.neuron());
            } else {
                message.unless_empty(number as usize)?;
            }
        }
        Ok(NetworkModel {
            axes,
            neurons,
            output_bias: self.output_bias.map(|bias| bias.0),
        })
    }
}

impl NeuronMessage {
    const LEN: usize = 36;

    const EMPTY: Self = Self {
        weights: [Word(0); 4],
        outputs: [Word(0); 2],
        bias: Bias(0),
        steps: 0,
    };

    fn neuron(&self) -> Neuron {
        Neuron {
            weights: self.weights.map(|word| word.0),
            outputs: self.outputs.map(|word| word.0),
            bias: self.bias.0,
            steps: self.steps,
        }
    }

    /// Refuses a byte that is not zero in neuron `number`, which is beyond the last.
    fn unless_empty(&self, number: usize) -> Result<(), Error> {
        let mut bytes = [0; Self::LEN];
        // A neuron always fills its bytes exactly.
        let _ = postcard::to_slice(self, &mut bytes);
        let first = OFFSET + size_of::<u32>() + 2 * size_of::<i64>();
        unless_zero(first + number * Self::LEN, &bytes)
    }
}
