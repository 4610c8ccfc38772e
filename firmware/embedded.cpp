// SPDX-License-Identifier: BSD-3-Clause
// What a control loop calls. Compiled for a Cortex-M4 in CI; nothing here needs an operating system.
#include "bias_filter.hpp"

namespace {

firmware::BiasFilter filter;

}  // namespace

extern "C" void bias_begin() { firmware::begin(filter); }

/// y: a sample at rest, or not a number while the sensor moves. Returns the bias to subtract.
extern "C" firmware::Scalar bias_on_sample(firmware::Scalar y) {
    firmware::on_sample(filter, y);
    return firmware::bias(filter);
}

extern "C" firmware::Scalar bias_variance() { return firmware::bias_variance(filter); }
