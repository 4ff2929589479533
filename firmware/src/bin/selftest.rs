//! The self-test on the STM32F405, and on the Cortex-M0.
#![no_std]
#![no_main]

#[path = "../image/selftest.rs"]
mod selftest;
