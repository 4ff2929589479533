//! The base's part of a blob: the blocks of a polynomial or the neurons of a network, in the bytes
//! that both share.

use crate::base::Base;
use crate::base::network::{NEURONS, NetworkModel, Neuron};
use crate::base::polynomial::{BLOCKS, Block, PolynomialModel};
use crate::fault::{Checks, Error};
use crate::wire::layout::{Field, Reader, Writer, laid_out, unless_zero};
use heapless::Vec;

/// Where the base begins.
pub(super) const OFFSET: usize = 216;
/// Its bytes, those of a polynomial; a base that needs fewer leaves zeros behind it.
pub(super) const LEN: usize = 2 * BLOCKS * Block::LEN;
/// Where the orders and shifts of a polynomial stand in the header.
const ORDERS_OFFSET: usize = 32;

/// The tag of a polynomial base. Tags are never reused.
const POLYNOMIAL: u8 = 1;
/// The tag of a network base.
const NETWORK: u8 = 2;
/// The tag of no base: the force is that of the effects alone.
const NONE: u8 = 3;

/// What the header says about the base.
#[derive(Clone, Copy)]
pub(super) struct BaseHeader {
    /// Which kind it is.
    pub(super) tag: u8,
    /// Axes of the model, one or two.
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

laid_out! {
/// A network: 1460 bytes.
struct NetworkMessage {
    neurons: u32,
    output_bias: [i64; 2],
    /// All zero beyond the number of neurons.
    neuron: [Neuron; NEURONS],
}
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
    let to = &mut Writer::new(bytes);
    match base {
        Base::Polynomial(polynomial) => polynomial.blocks.write(to),
        Base::Network(network) => {
            let mut neuron = [Neuron::NONE; NEURONS];
            for (place, stored) in neuron.iter_mut().zip(&network.neurons) {
                *place = *stored;
            }
            NetworkMessage {
                neurons: network.neurons.len() as u32,
                output_bias: network.output_bias,
                neuron,
            }
            .write(to);
        }
        Base::None { .. } => {}
    }
}

/// The base in `bytes`; the sums of its evaluation are checked with the model that it becomes part
/// of.
pub(super) fn read(header: BaseHeader, bytes: &[u8; LEN]) -> Result<Base, Error> {
    let mut from = Reader::new(bytes);
    match header.tag {
        POLYNOMIAL => {
            let mut polynomial = PolynomialModel {
                orders: header.orders,
                axes: header.axes,
                shifts: header.shifts,
                blocks: [[Block::EMPTY; BLOCKS]; 2],
            };
            // In place: an array read as a whole would stand on the stack twice.
            for block in polynomial.blocks.as_flattened_mut() {
                *block = Block::read(&mut from);
            }
            Ok(Base::Polynomial(polynomial))
        }
        NETWORK => {
            header.unless_polynomial()?;
            network(header.axes, from).map(Base::Network)
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

/// Reads a network: the number of neurons, the biases of the outputs, the neurons.
fn network(axes: u8, mut from: Reader<'_>) -> Result<NetworkModel, Error> {
    let count = u32::read(&mut from);
    let mut checks = Checks::new();
    checks.long("number of neurons", u64::from(count), 1, NEURONS as u64);
    checks.done()?;
    let mut network = NetworkModel {
        axes,
        output_bias: Field::read(&mut from),
        neurons: Vec::new(),
    };
    for _ in 0..count {
        // The list holds as many as were stated.
        let _ = network.neurons.push(Neuron::read(&mut from));
    }
    let rest = from.rest();
    unless_zero(OFFSET + LEN - rest.len(), rest)?;
    Ok(network)
}
