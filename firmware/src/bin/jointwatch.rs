//! The image that is flashed.
#![no_std]
#![no_main]

#[path = "../image/mod.rs"]
mod image;
