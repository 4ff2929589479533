// The C++ wrapper on a computer: the digest of the chain, and an error.
#include "jointwatch.hpp"
#include "motion.h"
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

static std::vector<std::uint8_t> block(const char *name) {
    std::ifstream file(name, std::ios::binary);
    return std::vector<std::uint8_t>(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
}

static jointwatch::Model model;
static jointwatch::Chain chain;
static jointwatch::Monitor monitor;

int main(int count, char **words) {
    if (count != 6) {
        return 2;
    }
    const auto model_bytes = block(words[1]), rig = block(words[2]), watched_rig = block(words[3]);
    struct motion motion = {SEED, {0}, {0}};
    std::uint64_t digest = NEW_DIGEST;
    jw_output output;
    jw_counts counts = next_counts(&motion);
    // Nothing is made yet.
    if (chain.step(counts, output) != JW_NULL || chain.make(rig.data(), rig.size(), model) != JW_NULL) {
        return 1;
    }
    motion = {SEED, {0}, {0}};
    if (model.load(model_bytes.data(), model_bytes.size()) != JW_OK || model.axes() != 2 ||
        chain.make(rig.data(), rig.size(), model) != JW_OK || monitor.make(chain) != JW_NO_LIMITS) {
        return 1;
    }
    const unsigned long samples = std::strtoul(words[5], nullptr, 10);
    for (unsigned long n = 0; n < samples; n++) {
        counts = next_counts(&motion);
        if (chain.step(counts, output) != JW_OK) {
            return 1;
        }
        add_output(&digest, &output);
    }
    jw_verdict verdict;
    if (chain.make(watched_rig.data(), watched_rig.size(), model) != JW_OK || monitor.make(chain) != JW_OK ||
        chain.step(counts, output) != JW_OK || monitor.step(counts, output, verdict) != JW_OK) {
        return 1;
    }
    std::printf("chain %016" PRIx64 "\n", digest);
    return 0;
}
