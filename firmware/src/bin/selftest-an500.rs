//! The self-test on the AN500, in a file of its own: its target is the STM32F405's.
#![no_std]
#![no_main]

#[path = "../image/selftest.rs"]
mod selftest;
