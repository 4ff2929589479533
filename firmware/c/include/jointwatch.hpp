// Jointwatch for C++11: jointwatch.h in classes that hold their own buffers. No exceptions, no heap.
//
// A model has to outlive its chain. Objects are large (JW_CHAIN_SIZE): make them static, not on a small stack.
#ifndef JOINTWATCH_HPP
#define JOINTWATCH_HPP

#include "jointwatch.h"
#include <cstddef>
#include <cstdint>

namespace jointwatch {

// A buffer, and the object in it once it was made. It cannot be copied: the object stays where it is.
template <typename T, std::size_t Size> class Object {
public:
    Object() = default;
    Object(const Object &) = delete;
    Object &operator=(const Object &) = delete;

    // The object as C has it; null before it was made.
    T *get() const { return object_; }

protected:
    alignas(JW_ALIGN) unsigned char room_[Size];
    T *object_ = nullptr;
};

// A model from the bytes of `jointwatch export`.
class Model : public Object<jw_model, JW_MODEL_SIZE> {
public:
    jw_error load(const std::uint8_t *bytes, std::size_t length) {
        return jw_model_load(bytes, length, room_, sizeof room_, &object_);
    }

    // 0 before it was loaded.
    std::uint32_t axes() const {
        std::uint32_t axes = 0;
        (void)jw_model_axes(object_, &axes);
        return axes;
    }

    jw_error force_unit(std::uint32_t axis, double &unit) const { return jw_model_force_unit(object_, axis, &unit); }
};

// The chain of a rig block and a model.
class Chain : public Object<jw_chain, JW_CHAIN_SIZE> {
public:
    jw_error make(const std::uint8_t *rig, std::size_t length, const Model &model) {
        return jw_chain_new(rig, length, model.get(), room_, sizeof room_, &object_);
    }

    jw_error step(const jw_counts &counts, jw_output &output, const jw_faults *faults = nullptr) {
        return jw_chain_step(object_, &counts, faults, &output);
    }

    jw_error delay(std::uint32_t &samples) const { return jw_chain_delay(object_, &samples); }
    jw_error sample_rate(double &hz) const { return jw_chain_sample_rate(object_, &hz); }
};

// The monitor of a chain.
class Monitor : public Object<jw_monitor, JW_MONITOR_SIZE> {
public:
    jw_error make(const Chain &chain) { return jw_monitor_new(chain.get(), room_, sizeof room_, &object_); }

    jw_error step(const jw_counts &counts, const jw_output &output, jw_verdict &verdict,
                  const jw_faults *faults = nullptr) {
        return jw_monitor_step(object_, &counts, &output, faults, &verdict);
    }

    jw_error verdict(jw_verdict &verdict) const { return jw_monitor_verdict(object_, &verdict); }
    jw_error health(std::uint32_t axis, jw_health &health) const { return jw_monitor_health(object_, axis, &health); }
};

} // namespace jointwatch

#endif
