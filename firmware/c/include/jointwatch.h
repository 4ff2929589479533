// Jointwatch for C: model, chain and monitor, in buffers that the caller gives.
//
// Made by cbindgen from firmware/c/src. Do not edit: JOINTWATCH_WRITE_HEADER=1 cargo test -p jointwatch-c --test header
//
// Every function gives a jw_error, JW_OK (0) when it did its work. Nothing allocates; nothing that runs per sample can
// panic. An object belongs to one thread of control at a time. Signatures are not checked here: load only models that
// you trust, or check the signature of the slot first (docs/reference/slot.md).

#ifndef JOINTWATCH_H
#define JOINTWATCH_H

#include <stddef.h>
#include <stdint.h>

// Bytes of a model blob and of a rig block.
#define JW_BLOB_LENGTH 4096

// The alignment of every buffer, in bytes.
#define JW_ALIGN 16

// Bytes of a model's buffer.
#define JW_MODEL_SIZE 4096

// Bytes of a chain's buffer.
#define JW_CHAIN_SIZE 14336

// Bytes of a monitor's buffer.
#define JW_MONITOR_SIZE 6144

// The output holds states and forces: the filters are full.
#define JW_FLAG_VALID (1 << 16)

// residual_band holds a value, which comes at every so many samples.
#define JW_FLAG_BAND (1 << 17)

// State i is outside the training range: JW_FLAG_OUTSIDE << i; the input of axis a:
// JW_FLAG_OUTSIDE << (4 + a).
#define JW_FLAG_OUTSIDE 1

// A force of axis a is at the rail of its 32 bits: JW_FLAG_RAIL << a.
#define JW_FLAG_RAIL (1 << 8)

// A fault is within the filters: mains hum was subtracted with its last amplitude and phase.
#define JW_FLAG_HELD (1 << 10)

// What a call came to. The numbers never change their meaning; new ones may be added.
enum jw_error
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It did its work.
  JW_OK = 0,
  // A pointer is null.
  JW_NULL = 1,
  // A pointer is not aligned as its object has to be; a buffer has to be a multiple of JW_ALIGN.
  JW_ALIGNMENT = 2,
  // A buffer is too small: the sizes are JW_MODEL_SIZE, JW_CHAIN_SIZE and JW_MONITOR_SIZE.
  JW_TOO_SMALL = 3,
  // A model blob or rig block has another length than JW_BLOB_LENGTH.
  JW_LENGTH = 4,
  // The bytes do not begin as a model blob or a rig block does.
  JW_MAGIC = 5,
  // The bytes are of a format version that this library does not read: export them again.
  JW_VERSION = 6,
  // The checksum does not match: the bytes are damaged.
  JW_CHECKSUM = 7,
  // A field or a quantity is not usable: `jointwatch inspect` says which.
  JW_VALUE = 8,
  // The rig block or its limits were made for another model.
  JW_OTHER_MODEL = 9,
  // The rig block has no limits for the monitor.
  JW_NO_LIMITS = 10,
  // The pointer is not to an object of this kind that this library made.
  JW_NO_OBJECT = 11,
  // There is no such axis or window.
  JW_RANGE = 12,
  // There is no value yet.
  JW_NOTHING = 13,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum jw_error jw_error;
#else
typedef int32_t jw_error;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// How the joint stands.
enum jw_state
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  JW_UNJUDGED = 0,
  JW_HEALTHY = 1,
  JW_SUSPECT = 2,
  JW_ALARM = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum jw_state jw_state;
#else
typedef uint8_t jw_state;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why; jw_cause_name gives the words. 32 to 47: the joint changed. 48 to 63: a sensor fails.
enum jw_cause
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  JW_STARTING = 0,
  JW_AS_EXPECTED = 1,
  JW_NO_MODEL = 2,
  JW_NO_RIG = 3,
  JW_WITHOUT_LIMITS = 4,
  JW_LIMITS_OF_OTHER_MODEL = 5,
  JW_TOO_GENTLE = 6,
  JW_SENSOR_FAULT = 7,
  JW_SAMPLES_LOST = 8,
  JW_OUTSIDE_RANGE = 16,
  JW_ERROR_GREW = 32,
  JW_STIFFER = 33,
  JW_SOFTER = 34,
  JW_MORE_FRICTION = 35,
  JW_LESS_FRICTION = 36,
  JW_FORCE_GONE = 37,
  JW_FORCE_UNEXPECTED = 38,
  JW_STUCK = 48,
  JW_SATURATED = 49,
  JW_OUT_OF_RANGE = 50,
  JW_WRONG_CHECKSUM = 51,
  JW_TIME_OUT = 52,
  JW_MISSING = 53,
  JW_REFERENCE_LOST = 54,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum jw_cause jw_cause;
#else
typedef uint8_t jw_cause;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The chain of a rig and its state, with the model behind it.
typedef struct jw_chain jw_chain;

// A model, checked in every respect.
typedef struct jw_model jw_model;

// The monitor and its state.
typedef struct jw_monitor jw_monitor;

// Counts of one axis at one instant, with the signs that the rig's wiring gives them; what a rig
// has not is 0.
typedef struct {
  // Encoder counters: far side and near side.
  int32_t displacement[2];
  // Encoder counter of the body that carries the inertia.
  int32_t body;
  // Accelerometer code of the body that carries the inertia.
  int32_t acceleration;
  // Force or torque code.
  int32_t force;
  // Converter code of the input that effects of the axis follow.
  int32_t input;
} jw_axis_counts;

// Counts of one instant, both axes.
typedef struct {
  // The second stays 0 on a rig of one axis.
  jw_axis_counts axis[2];
} jw_counts;

// What went wrong with the sensors at one instant. Bit 6*axis + channel of a word stands for one
// channel: far counter, near counter, body counter, accelerometer, force, input.
typedef struct {
  // The converter stood at a rail of its code.
  uint16_t saturated;
  // The value was outside what the sensor's data sheet allows.
  uint16_t out_of_range;
  // The checksum of the transfer was wrong.
  uint16_t checksum;
  // The sensor did not answer in time, or the bus failed.
  uint16_t time_out;
  // There was no new value.
  uint16_t missing;
  // The counter lost its count and began anew, for as long as that is so.
  uint16_t reference_lost;
  // Samples that were lost right before this one.
  uint32_t lost;
} jw_faults;

// What the chain says of the instant jw_chain_delay samples ago. Forces are in counts of
// jw_model_force_unit.
typedef struct {
  // Normalised states [x, v, phi, omega] in Q31.
  int32_t state[4];
  // Restoring force from the equation of motion, per axis.
  int32_t measured[2];
  // Restoring force from the model.
  int32_t predicted[2];
  // Measured minus predicted restoring force, per axis.
  int32_t residual[2];
  // The residual in the common band, older still; with JW_FLAG_BAND only.
  int32_t residual_band[2];
  // JW_FLAG_VALID and the others; all else is 0 without that one.
  uint32_t flags;
} jw_output;

// What the monitor says.
typedef struct {
  // A jw_state: how it stands.
  uint8_t state;
  // A jw_cause: why it stands so.
  uint8_t cause;
  // The axis that it is about, from 0.
  uint8_t axis;
  // The channel of that axis, when a sensor is meant, as in jw_faults. Of a change of the joint
  // how it came: 1 suddenly, 2 slowly.
  uint8_t channel;
  // How far it is, in 1/1000 of the threshold for a change of the joint, of the time for
  // everything else.
  uint16_t permille;
} jw_verdict;

// How one axis stands, and how much that says.
typedef struct {
  // How it stands, and why.
  jw_verdict verdict;
  // The part of the recent blocks that was judged, in 1/1000.
  uint16_t judged_permille;
  // Samples since the last judged block ended.
  uint32_t unjudged_samples;
} jw_health;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The name of an error's number, as in this header; "unknown" for any other number.
const char *jw_error_name(int32_t error);

// The words of a jw_state, "unknown" for any other number.
const char *jw_state_name(uint8_t state);

// The words of a jw_cause, "unknown" for any other number.
const char *jw_cause_name(uint8_t cause);

// Makes a model in `room`, which has `room_size` bytes, from the `length` bytes of `jointwatch
// export`. The bytes are not needed afterwards.
//
// # Safety
// The pointers are to as much memory as this says, which nothing else uses meanwhile.
jw_error jw_model_load(const uint8_t *bytes, size_t length, void *room, size_t room_size, jw_model **model);

// How many axes a model has, 1 or 2.
//
// # Safety
// The pointers are to a model and to room for the result.
jw_error jw_model_axes(const jw_model *model, uint32_t *axes);

// What one count of an axis's force is worth, in N or N m.
//
// # Safety
// The pointers are to a model and to room for the result.
jw_error jw_model_force_unit(const jw_model *model, uint32_t axis, double *unit);

// Makes the chain of a rig block and a model in `room`, which has `room_size` bytes. The model has
// to stay where it is as long as the chain is in use; the bytes of the rig block are not needed
// afterwards.
//
// # Safety
// The pointers are to as much memory as this says, which nothing else uses meanwhile.
jw_error jw_chain_new(const uint8_t *rig,
                      size_t length,
                      const jw_model *model,
                      void *room,
                      size_t room_size,
                      jw_chain **chain);

// By how many samples an output lags behind the newest sample.
//
// # Safety
// The pointers are to a chain and to room for the result.
jw_error jw_chain_delay(const jw_chain *chain, uint32_t *samples);

// How often the rig is to be sampled, in Hz.
//
// # Safety
// The pointers are to a chain and to room for the result.
jw_error jw_chain_sample_rate(const jw_chain *chain, double *hz);

// Takes one sample in: counts, and what was wrong with the sensors (null: nothing). `output` has
// JW_FLAG_VALID as soon as the filters are full. Integers only.
//
// # Safety
// The pointers are to what their types say, which nothing else uses meanwhile.
jw_error jw_chain_step(jw_chain *chain, const jw_counts *counts, const jw_faults *wrong, jw_output *output);

// Makes the monitor of a chain in `room`, which has `room_size` bytes, with the limits of the
// chain's rig block.
//
// # Safety
// The pointers are to as much memory as this says, which nothing else uses meanwhile.
jw_error jw_monitor_new(const jw_chain *chain, void *room, size_t room_size, jw_monitor **monitor);

// Takes one sample in: counts, what the chain made of them, and what was wrong with the sensors
// (null: nothing). Integers only.
//
// # Safety
// The pointers are to what their types say, which nothing else uses meanwhile.
jw_error jw_monitor_step(jw_monitor *monitor,
                         const jw_counts *counts,
                         const jw_output *output,
                         const jw_faults *wrong,
                         jw_verdict *verdict);

// The last verdict.
//
// # Safety
// The pointers are to a monitor and to room for the result.
jw_error jw_monitor_verdict(const jw_monitor *monitor, jw_verdict *verdict);

// How an axis stands, and how much that says.
//
// # Safety
// The pointers are to a monitor and to room for the result.
jw_error jw_monitor_health(const jw_monitor *monitor, uint32_t axis, jw_health *health);

// The NMSE of an axis in 1/1000 %, over the last 16 blocks or so (`slow` 0) or 1024 (`slow` 1).
// Has a long division: not for every sample. JW_NOTHING while the force does not vary.
//
// # Safety
// The pointers are to a monitor and to room for the result.
jw_error jw_monitor_nmse(const jw_monitor *monitor, uint32_t axis, uint32_t slow, uint32_t *nmse);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* JOINTWATCH_H */
