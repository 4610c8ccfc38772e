// SPDX-License-Identifier: BSD-3-Clause
// What a control loop calls. Compiled for a Cortex-M4F in CI, with the filter and with its steady gain alone; nothing
// here needs an operating system.
#include <model.hpp>  // of the folder that the compiler is told: -I

namespace {

sensor::FILTER filter;

}  // namespace

#ifdef WITH_STEADY_GAIN
extern "C" void bias_begin(sensor::Scalar mean_at_rest) { sensor::begin(filter, mean_at_rest); }
#else
extern "C" void bias_begin() { sensor::begin(filter); }

extern "C" sensor::Scalar bias_variance() { return sensor::bias_variance(filter); }
#endif

/// y: a sample at rest, or not a number while the sensor moves. Returns the bias to subtract.
extern "C" sensor::Scalar bias_on_sample(sensor::Scalar y) {
    sensor::on_sample(filter, y);
    return sensor::bias(filter);
}
