//! The C boundary: the functions that C calls, and the only `unsafe` code of the library.
//!
//! A pointer is looked at for null and for its alignment before it is used; an object also for the
//! word that it begins with. That it points to as much memory as the header says, which nothing
//! else writes meanwhile, is for the caller to keep.
#![deny(unsafe_op_in_unsafe_fn)]

use crate::error::jw_error::{self, *};
use crate::objects::Object;
pub use crate::objects::{jw_chain, jw_model, jw_monitor};
use crate::types::{
    JW_ALIGN, JW_BLOB_LENGTH, cause_name, jw_counts, jw_faults, jw_health, jw_output, jw_verdict,
    state_name,
};
use core::ffi::{c_char, c_void};
use core::mem::MaybeUninit;
use core::ptr::null_mut;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::monitor::{Faults, Window};

/// Whether a pointer can be one to a `T`.
#[inline(always)]
fn usable<T>(at: *const T) -> Result<(), jw_error> {
    if at.is_null() {
        return Err(JW_NULL);
    }
    if !at.is_aligned() {
        return Err(JW_ALIGNMENT);
    }
    Ok(())
}

/// What C points to, to be read.
///
/// # Safety
/// A pointer that is neither null nor misaligned is to a `T` that nothing writes during the call.
#[inline(always)]
unsafe fn read<'a, T>(at: *const T) -> Result<&'a T, jw_error> {
    usable(at)?;
    // SAFETY: it is neither null nor misaligned, and the caller vouches for the rest.
    Ok(unsafe { &*at })
}

/// Hands a value to C.
///
/// # Safety
/// A pointer that is neither null nor misaligned is to room for a `T`.
#[inline(always)]
unsafe fn hand<T>(at: *mut T, value: T) -> Result<(), jw_error> {
    // SAFETY: the caller vouches for the pointer.
    unsafe { room(at) }?.write(value);
    Ok(())
}

/// Room for a value that C gets.
///
/// # Safety
/// As [`hand`]; nothing else uses it during the call.
#[inline(always)]
unsafe fn room<'a, T>(at: *mut T) -> Result<&'a mut MaybeUninit<T>, jw_error> {
    usable(at)?;
    // SAFETY: it is neither null nor misaligned, and the caller vouches for the rest.
    Ok(unsafe { &mut *at.cast() })
}

/// The bytes of a model blob or a rig block.
///
/// # Safety
/// A pointer that is not null is to `length` bytes that nothing writes during the call.
unsafe fn block<'a>(at: *const u8, length: usize) -> Result<&'a [u8; JW_BLOB_LENGTH], jw_error> {
    usable(at)?;
    if length != JW_BLOB_LENGTH {
        return Err(JW_LENGTH);
    }
    // SAFETY: the length is that of the array, and the caller vouches for the rest.
    Ok(unsafe { &*at.cast() })
}

/// Whether a pointer is to an object of this kind.
///
/// # Safety
/// A pointer that is neither null nor misaligned is to a buffer of `T::SIZE` bytes that were
/// written once.
#[inline(always)]
unsafe fn known<T: Object>(at: *const T) -> Result<(), jw_error> {
    usable(at)?;
    // SAFETY: the buffer begins with the word, and every pattern of bits is one.
    let tag = unsafe { at.cast::<u32>().read() };
    if tag == T::TAG {
        Ok(())
    } else {
        Err(JW_NO_OBJECT)
    }
}

/// An object, to be read.
///
/// # Safety
/// As [`known`]; nothing writes the object for as long as it is in use.
#[inline(always)]
unsafe fn object<'a, T: Object>(at: *const T) -> Result<&'a T, jw_error> {
    // SAFETY: the caller vouches for the pointer; its word says that the object was made here.
    unsafe {
        known(at)?;
        Ok(&*at)
    }
}

/// An object, to be changed.
///
/// # Safety
/// As [`known`]; nothing else reads or writes the object during the call.
#[inline(always)]
unsafe fn object_mut<'a, T: Object>(at: *mut T) -> Result<&'a mut T, jw_error> {
    // SAFETY: the caller vouches for the pointer; its word says that the object was made here.
    unsafe {
        known(at)?;
        Ok(&mut *at)
    }
}

/// Makes an object in a buffer and hands its place out; hands out null when that fails.
///
/// # Safety
/// Pointers that are neither null nor misaligned are to `size` bytes that nothing else uses, and to
/// room for a pointer.
unsafe fn make<T: Object>(
    room: *mut c_void,
    size: usize,
    place: *mut *mut T,
    made: impl FnOnce() -> Result<T, jw_error>,
) -> Result<(), jw_error> {
    // SAFETY: as above.
    unsafe { hand(place, null_mut())? };
    if room.is_null() {
        return Err(JW_NULL);
    }
    if !room.addr().is_multiple_of(JW_ALIGN) {
        return Err(JW_ALIGNMENT);
    }
    if size < T::SIZE {
        return Err(JW_TOO_SMALL);
    }
    // SAFETY: it is aligned and has room for a `T`, which a constant assertion holds under
    // `T::SIZE`.
    let room = unsafe { &mut *room.cast::<MaybeUninit<T>>() };
    let object = room.write(made()?);
    // SAFETY: as above.
    unsafe { hand(place, object) }
}

/// Counts that C gave. `types.rs` holds that they are the bytes of Rust's.
///
/// # Safety
/// As [`read`].
#[inline(always)]
unsafe fn sample<'a>(at: *const jw_counts) -> Result<&'a RawSample, jw_error> {
    // SAFETY: the caller vouches for the pointer.
    unsafe { read(at.cast()) }
}

/// Faults that C gave, likewise; null says that there are none.
///
/// # Safety
/// As [`read`].
#[inline(always)]
unsafe fn faults<'a>(at: *const jw_faults) -> Result<Option<&'a Faults>, jw_error> {
    if at.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller vouches for the pointer.
    unsafe { read(at.cast()) }.map(Some)
}

#[inline(always)]
fn code(outcome: Result<(), jw_error>) -> jw_error {
    outcome.err().unwrap_or(JW_OK)
}

/// The name of an error's number, as in this header; "unknown" for any other number.
#[unsafe(no_mangle)]
pub extern "C" fn jw_error_name(error: i32) -> *const c_char {
    jw_error::name_of(error).as_ptr()
}

/// The words of a jw_state, "unknown" for any other number.
#[unsafe(no_mangle)]
pub extern "C" fn jw_state_name(state: u8) -> *const c_char {
    state_name(state).as_ptr().cast()
}

/// The words of a jw_cause, "unknown" for any other number.
#[unsafe(no_mangle)]
pub extern "C" fn jw_cause_name(cause: u8) -> *const c_char {
    cause_name(cause).as_ptr().cast()
}

/// Makes a model in `room`, which has `room_size` bytes, from the `length` bytes of `jointwatch
/// export`. The bytes are not needed afterwards.
///
/// # Safety
/// The pointers are to as much memory as this says, which nothing else uses meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_model_load(
    bytes: *const u8,
    length: usize,
    room: *mut c_void,
    room_size: usize,
    model: *mut *mut jw_model,
) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe {
        make(room, room_size, model, || {
            jw_model::load(block(bytes, length)?)
        })
    })
}

/// How many axes a model has, 1 or 2.
///
/// # Safety
/// The pointers are to a model and to room for the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_model_axes(model: *const jw_model, axes: *mut u32) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe { object(model).and_then(|model| hand(axes, model.model.axes() as u32)) })
}

/// What one count of an axis's force is worth, in N or N m.
///
/// # Safety
/// The pointers are to a model and to room for the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_model_force_unit(
    model: *const jw_model,
    axis: u32,
    unit: *mut f64,
) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe {
        object(model).and_then(|model| {
            let output = model.model.outputs().get(axis as usize);
            hand(unit, output.ok_or(JW_RANGE)?.force_per_lsb)
        })
    })
}

/// Makes the chain of a rig block and a model in `room`, which has `room_size` bytes. The model has
/// to stay where it is as long as the chain is in use; the bytes of the rig block are not needed
/// afterwards.
///
/// # Safety
/// The pointers are to as much memory as this says, which nothing else uses meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_chain_new(
    rig: *const u8,
    length: usize,
    model: *const jw_model,
    room: *mut c_void,
    room_size: usize,
    chain: *mut *mut jw_chain,
) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe {
        make(room, room_size, chain, || {
            jw_chain::new(block(rig, length)?, object(model)?)
        })
    })
}

/// By how many samples an output lags behind the newest sample.
///
/// # Safety
/// The pointers are to a chain and to room for the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_chain_delay(chain: *const jw_chain, samples: *mut u32) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe { object(chain).and_then(|chain| hand(samples, chain.chain.delay() as u32)) })
}

/// How often the rig is to be sampled, in Hz.
///
/// # Safety
/// The pointers are to a chain and to room for the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_chain_sample_rate(chain: *const jw_chain, hz: *mut f64) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe { object(chain).and_then(|chain| hand(hz, chain.sample_rate_hz)) })
}

/// Takes one sample in: counts, and what was wrong with the sensors (null: nothing). `output` has
/// JW_FLAG_VALID as soon as the filters are full. Integers only.
///
/// # Safety
/// The pointers are to what their types say, which nothing else uses meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_chain_step(
    chain: *mut jw_chain,
    counts: *const jw_counts,
    wrong: *const jw_faults,
    output: *mut jw_output,
) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe {
        object_mut(chain).and_then(|chain| {
            let wrong = faults(wrong)?;
            // Nothing is taken in that could not be handed out.
            let output = room(output)?;
            output.write(chain.step(sample(counts)?, wrong));
            Ok(())
        })
    })
}

/// Makes the monitor of a chain in `room`, which has `room_size` bytes, with the limits of the
/// chain's rig block.
///
/// # Safety
/// The pointers are to as much memory as this says, which nothing else uses meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_monitor_new(
    chain: *const jw_chain,
    room: *mut c_void,
    room_size: usize,
    monitor: *mut *mut jw_monitor,
) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe { make(room, room_size, monitor, || jw_monitor::new(object(chain)?)) })
}

/// Takes one sample in: counts, what the chain made of them, and what was wrong with the sensors
/// (null: nothing). Integers only.
///
/// # Safety
/// The pointers are to what their types say, which nothing else uses meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_monitor_step(
    monitor: *mut jw_monitor,
    counts: *const jw_counts,
    output: *const jw_output,
    wrong: *const jw_faults,
    verdict: *mut jw_verdict,
) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe {
        object_mut(monitor).and_then(|monitor| {
            let wrong = faults(wrong)?;
            let verdict = room(verdict)?;
            let said = monitor.step(sample(counts)?, read(output)?, wrong);
            verdict.write(said.into());
            Ok(())
        })
    })
}

/// The last verdict.
///
/// # Safety
/// The pointers are to a monitor and to room for the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_monitor_verdict(
    monitor: *const jw_monitor,
    verdict: *mut jw_verdict,
) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe {
        object(monitor).and_then(|monitor| hand(verdict, monitor.state.verdict().into()))
    })
}

/// How an axis stands, and how much that says.
///
/// # Safety
/// The pointers are to a monitor and to room for the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_monitor_health(
    monitor: *const jw_monitor,
    axis: u32,
    health: *mut jw_health,
) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe {
        object(monitor).and_then(|monitor| {
            if axis >= monitor.axes {
                return Err(JW_RANGE);
            }
            let of_axis = monitor.state.axis(&monitor.monitor, axis as usize);
            hand(health, of_axis.into())
        })
    })
}

/// The NMSE of an axis in 1/1000 %, over the last 16 blocks or so (`slow` 0) or 1024 (`slow` 1).
/// Has a long division: not for every sample. JW_NOTHING while the force does not vary.
///
/// # Safety
/// The pointers are to a monitor and to room for the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jw_monitor_nmse(
    monitor: *const jw_monitor,
    axis: u32,
    slow: u32,
    nmse: *mut u32,
) -> jw_error {
    // SAFETY: the caller vouches for the pointers.
    code(unsafe {
        object(monitor).and_then(|monitor| {
            let window = match slow {
                0 => Window::Fast,
                1 => Window::Slow,
                _ => return Err(JW_RANGE),
            };
            if axis >= monitor.axes {
                return Err(JW_RANGE);
            }
            let seen = monitor.state.nmse(&monitor.monitor, axis as usize, window);
            hand(nmse, seen.ok_or(JW_NOTHING)?)
        })
    })
}
