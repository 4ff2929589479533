// The library on a computer: the digests of two rigs, and every bad input with its error.
//
// host MODEL RIG WATCHED_RIG OTHER_MODEL SAMPLES: files of `jointwatch export`; the second rig has limits for the monitor.
#include "motion.h"
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

static void expect_code(int line, jw_error seen, jw_error wanted) {
    if (seen != wanted) {
        printf("line %d: %s, not %s\n", line, jw_error_name(seen), jw_error_name(wanted));
        failures++;
    }
}

static void expect_true(int line, bool holds) {
    if (!holds) {
        printf("line %d: it does not hold\n", line);
        failures++;
    }
}

#define CODE(call, wanted) expect_code(__LINE__, (call), (wanted))
#define TRUE(condition) expect_true(__LINE__, (condition))

static uint8_t model_bytes[JW_BLOB_LENGTH];
static uint8_t rig[JW_BLOB_LENGTH];
static uint8_t watched_rig[JW_BLOB_LENGTH];
static uint8_t other_model[JW_BLOB_LENGTH];

static void read_block(const char *name, uint8_t *place) {
    FILE *file = fopen(name, "rb");
    if (file == NULL || fread(place, 1, JW_BLOB_LENGTH, file) != JW_BLOB_LENGTH) {
        printf("%s is not readable\n", name);
        exit(2);
    }
    (void)fclose(file);
}

static jw_error load(const uint8_t *bytes, size_t length, jw_model **model) {
    return jw_model_load(bytes, length, model_room, sizeof model_room, model);
}

static jw_error build(const uint8_t *bytes, size_t length, const jw_model *model, jw_chain **chain) {
    return jw_chain_new(bytes, length, model, chain_room, sizeof chain_room, chain);
}

static jw_error watch_chain(const jw_chain *chain, jw_monitor **monitor) {
    return jw_monitor_new(chain, monitor_room, sizeof monitor_room, monitor);
}

// A block with one byte changed.
static const uint8_t *changed(const uint8_t *block, size_t at) {
    static uint8_t copy[JW_BLOB_LENGTH];
    memcpy(copy, block, sizeof copy);
    copy[at] ^= 0x20;
    return copy;
}

static void bad_models(void) {
    jw_model *model = NULL;
    jw_model **misplaced = (jw_model **)(void *)((char *)&model + 1);
    uint32_t axes = 0;
    double unit = 0;
    CODE(load(NULL, JW_BLOB_LENGTH, &model), JW_NULL);
    TRUE(model == NULL);
    CODE(load(model_bytes, JW_BLOB_LENGTH, NULL), JW_NULL);
    CODE(load(model_bytes, JW_BLOB_LENGTH, misplaced), JW_ALIGNMENT);
    CODE(load(model_bytes, JW_BLOB_LENGTH - 1, &model), JW_LENGTH);
    CODE(load(model_bytes, 0, &model), JW_LENGTH);
    CODE(load(changed(model_bytes, 0), JW_BLOB_LENGTH, &model), JW_MAGIC);
    CODE(load(changed(model_bytes, 4), JW_BLOB_LENGTH, &model), JW_VERSION);
    CODE(load(changed(model_bytes, 1000), JW_BLOB_LENGTH, &model), JW_CHECKSUM);
    CODE(load(rig, JW_BLOB_LENGTH, &model), JW_MAGIC);
    CODE(jw_model_load(model_bytes, JW_BLOB_LENGTH, NULL, JW_MODEL_SIZE, &model), JW_NULL);
    CODE(jw_model_load(model_bytes, JW_BLOB_LENGTH, model_room + 4, JW_MODEL_SIZE, &model), JW_ALIGNMENT);
    CODE(jw_model_load(model_bytes, JW_BLOB_LENGTH, model_room, JW_MODEL_SIZE - 1, &model), JW_TOO_SMALL);
    TRUE(model == NULL);
    CODE(jw_model_axes(NULL, &axes), JW_NULL);
    CODE(jw_model_axes((const jw_model *)(const void *)rig, &axes), JW_NO_OBJECT);
    CODE(load(model_bytes, JW_BLOB_LENGTH, &model), JW_OK);
    CODE(jw_model_axes((const jw_model *)(const void *)(model_room + 1), &axes), JW_ALIGNMENT);
    CODE(jw_model_axes(model, NULL), JW_NULL);
    CODE(jw_model_axes(model, &axes), JW_OK);
    TRUE(axes == 2);
    CODE(jw_model_force_unit(model, 1, &unit), JW_OK);
    TRUE(unit > 0);
    CODE(jw_model_force_unit(model, 2, &unit), JW_RANGE);
}

static void bad_chains(void) {
    jw_model *model;
    jw_chain *chain;
    uint32_t delay = 0;
    double hz = 0;
    jw_counts counts = {0};
    jw_output output;
    CODE(load(model_bytes, JW_BLOB_LENGTH, &model), JW_OK);
    CODE(build(NULL, JW_BLOB_LENGTH, model, &chain), JW_NULL);
    CODE(build(rig, JW_BLOB_LENGTH, NULL, &chain), JW_NULL);
    CODE(build(rig, JW_BLOB_LENGTH + 1, model, &chain), JW_LENGTH);
    CODE(build(changed(rig, 0), JW_BLOB_LENGTH, model, &chain), JW_MAGIC);
    CODE(build(changed(rig, 4), JW_BLOB_LENGTH, model, &chain), JW_VERSION);
    CODE(build(changed(rig, 99), JW_BLOB_LENGTH, model, &chain), JW_CHECKSUM);
    CODE(jw_chain_new(rig, JW_BLOB_LENGTH, model, chain_room, JW_CHAIN_SIZE - 1, &chain), JW_TOO_SMALL);
    CODE(jw_chain_new(rig, JW_BLOB_LENGTH, model, chain_room + 2, JW_CHAIN_SIZE, &chain), JW_ALIGNMENT);
    TRUE(chain == NULL);
    CODE(load(other_model, JW_BLOB_LENGTH, &model), JW_OK);
    CODE(build(rig, JW_BLOB_LENGTH, model, &chain), JW_OTHER_MODEL);
    CODE(load(model_bytes, JW_BLOB_LENGTH, &model), JW_OK);
    CODE(build(rig, JW_BLOB_LENGTH, (const jw_model *)(const void *)monitor_room, &chain), JW_NO_OBJECT);
    CODE(build(rig, JW_BLOB_LENGTH, model, &chain), JW_OK);
    CODE(jw_chain_delay(chain, &delay), JW_OK);
    TRUE(delay == 2);
    CODE(jw_chain_sample_rate(chain, &hz), JW_OK);
    TRUE(hz > 31.9 && hz < 32.1);
    CODE(jw_chain_step(NULL, &counts, NULL, &output), JW_NULL);
    CODE(jw_chain_step((jw_chain *)(void *)model, &counts, NULL, &output), JW_NO_OBJECT);
    CODE(jw_chain_step(chain, NULL, NULL, &output), JW_NULL);
    CODE(jw_chain_step(chain, &counts, NULL, NULL), JW_NULL);
    CODE(jw_chain_step(chain, (jw_counts *)(void *)(chain_room + 1), NULL, &output), JW_ALIGNMENT);
    CODE(jw_chain_step(chain, &counts, (jw_faults *)(void *)(chain_room + 1), &output), JW_ALIGNMENT);
    CODE(jw_chain_step(chain, &counts, NULL, (jw_output *)(void *)(monitor_room + 1)), JW_ALIGNMENT);
    CODE(jw_chain_step(chain, &counts, NULL, &output), JW_OK);
    TRUE(output.flags == 0);
}

static void bad_monitors(void) {
    jw_model *model;
    jw_chain *chain;
    jw_monitor *monitor;
    jw_counts counts = {0};
    jw_output output = {0};
    jw_verdict verdict;
    jw_health health;
    uint32_t nmse = 0;
    CODE(load(model_bytes, JW_BLOB_LENGTH, &model), JW_OK);
    CODE(build(rig, JW_BLOB_LENGTH, model, &chain), JW_OK);
    CODE(watch_chain(chain, &monitor), JW_NO_LIMITS);
    TRUE(monitor == NULL);
    CODE(build(watched_rig, JW_BLOB_LENGTH, model, &chain), JW_OK);
    CODE(watch_chain(NULL, &monitor), JW_NULL);
    CODE(watch_chain((const jw_chain *)(const void *)model, &monitor), JW_NO_OBJECT);
    CODE(jw_monitor_new(chain, monitor_room, JW_MONITOR_SIZE - 1, &monitor), JW_TOO_SMALL);
    CODE(watch_chain(chain, &monitor), JW_OK);
    CODE(jw_monitor_step(NULL, &counts, &output, NULL, &verdict), JW_NULL);
    CODE(jw_monitor_step((jw_monitor *)(void *)chain, &counts, &output, NULL, &verdict), JW_NO_OBJECT);
    CODE(jw_monitor_step(monitor, NULL, &output, NULL, &verdict), JW_NULL);
    CODE(jw_monitor_step(monitor, &counts, NULL, NULL, &verdict), JW_NULL);
    CODE(jw_monitor_step(monitor, &counts, &output, NULL, NULL), JW_NULL);
    CODE(jw_monitor_step(monitor, &counts, &output, NULL, &verdict), JW_OK);
    TRUE(verdict.state == JW_UNJUDGED && verdict.cause == JW_STARTING);
    CODE(jw_monitor_verdict(monitor, NULL), JW_NULL);
    CODE(jw_monitor_verdict(monitor, &verdict), JW_OK);
    CODE(jw_monitor_health(monitor, 2, &health), JW_RANGE);
    CODE(jw_monitor_health(monitor, 1, &health), JW_OK);
    TRUE(health.verdict.axis == 1);
    CODE(jw_monitor_nmse(monitor, 0, 2, &nmse), JW_RANGE);
    CODE(jw_monitor_nmse(monitor, 2, 0, &nmse), JW_RANGE);
    CODE(jw_monitor_nmse(monitor, 0, 0, &nmse), JW_NOTHING);
}

static void names(void) {
    TRUE(strcmp(jw_error_name(JW_OK), "JW_OK") == 0);
    TRUE(strcmp(jw_error_name(JW_NOTHING), "JW_NOTHING") == 0);
    TRUE(strcmp(jw_error_name(-1), "unknown") == 0);
    TRUE(strcmp(jw_error_name(14), "unknown") == 0);
    TRUE(strcmp(jw_state_name(JW_ALARM), "alarm") == 0);
    TRUE(strcmp(jw_state_name(9), "unknown") == 0);
    TRUE(strcmp(jw_cause_name(JW_FORCE_UNEXPECTED), "force that the model does not expect") == 0);
    TRUE(strcmp(jw_cause_name(255), "unknown") == 0);
}

int main(int count, char **words) {
    if (count != 6) {
        return 2;
    }
    read_block(words[1], model_bytes);
    read_block(words[2], rig);
    read_block(words[3], watched_rig);
    read_block(words[4], other_model);
    uint32_t samples = (uint32_t)strtoul(words[5], NULL, 10);
    bad_models();
    bad_chains();
    bad_monitors();
    names();
    printf("chain %016" PRIx64 "\n", chain_digest(model_bytes, rig, samples));
    printf("watched %016" PRIx64 "\n", watched_digest(model_bytes, watched_rig, samples));
    printf("failures %d\n", failures);
    return failures == 0 ? 0 : 1;
}
