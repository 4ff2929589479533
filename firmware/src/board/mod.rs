//! The boards: what differs between one microcontroller and another, and the only `unsafe` code of
//! the firmware.

#[cfg(feature = "an500")]
pub mod an500;
#[cfg(any(feature = "stm32", feature = "nrf52840", feature = "rp2350"))]
mod chips;
#[cfg(feature = "stm32")]
mod chunks;
#[cfg(any(
    all(feature = "stm32", not(feature = "semihosting-link")),
    feature = "nrf52840",
    feature = "rp2350"
))]
mod driver;
#[cfg(any(feature = "stm32", feature = "an500", feature = "nrf52840"))]
mod kernels;
#[cfg(feature = "semihosting-link")]
pub mod link;
#[cfg(feature = "microbit")]
pub mod microbit;
#[cfg(feature = "nrf52840")]
pub mod nrf52840;
#[cfg(feature = "stm32")]
pub mod restart;
#[cfg(feature = "rp2350")]
pub mod rp2350;
#[cfg(feature = "stm32")]
mod rtt;
pub mod semihosting;
#[cfg(any(
    feature = "stm32",
    feature = "an500",
    feature = "nrf52840",
    feature = "rp2350"
))]
mod slots;
#[cfg(feature = "stm32")]
pub mod stack;
#[cfg(feature = "stm32")]
pub mod stm32f405;

#[cfg(not(any(feature = "stm32", feature = "an500", feature = "nrf52840")))]
pub use jointwatch_shared::base::kernels::Portable as Kernels;
/// The inner loops of a sample on this board, chosen here and nowhere else: in assembly where
/// the processor has the instructions.
#[cfg(any(feature = "stm32", feature = "an500", feature = "nrf52840"))]
pub use kernels::Assembly as Kernels;
