// The fixed motion and the digest of the self-test (shared/src/selftest), written once more in C.
#ifndef MOTION_H
#define MOTION_H

#include "jointwatch.h"

// The seed of the device's self-test.
#define SEED 20070099u

struct motion {
    uint64_t points;
    int32_t position[4];
    int32_t velocity[4];
};

static inline int32_t as_signed(uint32_t word) {
    // Modulo 2^32, as every compiler for these processors does it.
    return (int32_t)word;
}

static inline int32_t plus(int32_t a, int32_t b) {
    return as_signed((uint32_t)a + (uint32_t)b);
}

static inline int32_t times(int32_t a, uint32_t b) {
    return as_signed((uint32_t)a * b);
}

// Rounds down, whatever the compiler does with negative numbers.
static inline int32_t shifted(int32_t value, unsigned by) {
    return value < 0 ? ~(~value >> by) : value >> by;
}

static inline int32_t next_word(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return as_signed((uint32_t)(*state >> 32));
}

static inline jw_counts next_counts(struct motion *motion) {
    int32_t at[4];
    jw_counts counts;
    for (unsigned n = 0; n < 4; n++) {
        int32_t kick = shifted(next_word(&motion->points), 21);
        int32_t velocity = motion->velocity[n];
        motion->velocity[n] = velocity - shifted(velocity, 6) - shifted(motion->position[n], 7 + n) + kick;
        motion->position[n] += motion->velocity[n];
        at[n] = shifted(motion->position[n], 6);
    }
    for (unsigned axis = 0; axis < 2; axis++) {
        int32_t far = at[2 * axis], near = at[2 * axis + 1];
        counts.axis[axis].displacement[0] = plus(INT32_MAX, far);
        counts.axis[axis].displacement[1] = plus(INT32_MAX, near);
        counts.axis[axis].body = near;
        counts.axis[axis].acceleration = times(far, 37);
        counts.axis[axis].force = times(near, 101);
        counts.axis[axis].input = 0;
    }
    return counts;
}

// An eighth of the motion, which stays inside the training range.
static inline jw_counts next_small_counts(struct motion *motion) {
    jw_counts counts = next_counts(motion);
    for (unsigned axis = 0; axis < 2; axis++) {
        for (unsigned side = 0; side < 2; side++) {
            int32_t *count = &counts.axis[axis].displacement[side];
            *count = shifted(plus(*count, -INT32_MAX), 3);
        }
    }
    return counts;
}

// FNV-1a, a word at a time.
static inline void add_word(uint64_t *digest, int32_t word) {
    *digest = (*digest ^ (uint32_t)word) * 0x100000001b3u;
}

static inline void add_output(uint64_t *digest, const jw_output *output) {
    if ((output->flags & JW_FLAG_VALID) == 0) {
        return;
    }
    for (unsigned n = 0; n < 4; n++) {
        add_word(digest, output->state[n]);
    }
    add_word(digest, as_signed(output->flags & 0xFFFFu));
    add_word(digest, output->measured[0]);
    add_word(digest, output->measured[1]);
    add_word(digest, output->predicted[0]);
    add_word(digest, output->predicted[1]);
    add_word(digest, output->residual[0]);
    add_word(digest, output->residual[1]);
    add_word(digest, (output->flags & JW_FLAG_BAND) != 0);
    add_word(digest, output->residual_band[0]);
    add_word(digest, output->residual_band[1]);
}

static inline void add_verdict(uint64_t *digest, const jw_verdict *verdict) {
    add_word(digest, verdict->state);
    add_word(digest, verdict->cause);
    add_word(digest, verdict->axis);
    add_word(digest, verdict->channel);
    add_word(digest, verdict->permille);
}

#define NEW_DIGEST 0xcbf29ce484222325u

#ifdef __cplusplus
#define ALIGNED alignas(JW_ALIGN)
#else
#define ALIGNED _Alignas(JW_ALIGN)
#endif
ALIGNED static unsigned char model_room[JW_MODEL_SIZE];
ALIGNED static unsigned char chain_room[JW_CHAIN_SIZE];
ALIGNED static unsigned char monitor_room[JW_MONITOR_SIZE];

// The digest of the chain over the fixed motion; 0 when something fails.
static inline uint64_t chain_digest(const uint8_t *model_bytes, const uint8_t *rig, uint32_t samples) {
    struct motion motion = {SEED, {0}, {0}};
    uint64_t digest = NEW_DIGEST;
    jw_model *model;
    jw_chain *chain;
    if (jw_model_load(model_bytes, JW_BLOB_LENGTH, model_room, sizeof model_room, &model) != JW_OK ||
        jw_chain_new(rig, JW_BLOB_LENGTH, model, chain_room, sizeof chain_room, &chain) != JW_OK) {
        return 0;
    }
    for (uint32_t n = 0; n < samples; n++) {
        jw_counts counts = next_counts(&motion);
        jw_output output;
        if (jw_chain_step(chain, &counts, NULL, &output) != JW_OK) {
            return 0;
        }
        add_output(&digest, &output);
    }
    return digest;
}

// Model, chain and monitor of a rig; null when something fails.
static inline jw_monitor *watch(const uint8_t *model_bytes, const uint8_t *rig, jw_chain **chain) {
    jw_model *model;
    jw_monitor *monitor = NULL;
    if (jw_model_load(model_bytes, JW_BLOB_LENGTH, model_room, sizeof model_room, &model) == JW_OK &&
        jw_chain_new(rig, JW_BLOB_LENGTH, model, chain_room, sizeof chain_room, chain) == JW_OK) {
        (void)jw_monitor_new(*chain, monitor_room, sizeof monitor_room, &monitor);
    }
    return monitor;
}

// One sample through chain and monitor.
static inline jw_error step(jw_chain *chain, jw_monitor *monitor, const jw_counts *counts, const jw_faults *faults,
                     jw_output *output, jw_verdict *verdict) {
    jw_error error = jw_chain_step(chain, counts, faults, output);
    return error != JW_OK ? error : jw_monitor_step(monitor, counts, output, faults, verdict);
}

// The digest of outputs and verdicts over the small motion, with a fault at every 1000th sample; 0 when something fails.
static inline uint64_t watched_digest(const uint8_t *model_bytes, const uint8_t *rig, uint32_t samples) {
    struct motion motion = {SEED, {0}, {0}};
    uint64_t digest = NEW_DIGEST;
    jw_chain *chain;
    jw_monitor *monitor = watch(model_bytes, rig, &chain);
    if (monitor == NULL) {
        return 0;
    }
    for (uint32_t n = 0; n < samples; n++) {
        jw_counts counts = next_small_counts(&motion);
        jw_faults faults = {0, 0, 0, 0, 0, 0, 0};
        jw_output output;
        jw_verdict verdict;
        faults.checksum = n % 1000 == 999 ? 1u << 4 : 0;
        if (step(chain, monitor, &counts, &faults, &output, &verdict) != JW_OK) {
            return 0;
        }
        add_output(&digest, &output);
        add_verdict(&digest, &verdict);
    }
    return digest;
}

#endif
