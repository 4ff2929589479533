#![doc = "Jointwatch firmware."]
#![no_std]
