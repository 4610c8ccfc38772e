// SPDX-License-Identifier: BSD-3-Clause
// The same filter on a desk: a series that every machine makes alike, and what the filter makes of it, one line for
// each sample: y, innovation, bias, its variance, bias with the fixed gain.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include <model.hpp>  // of the folder that the compiler is told: -I

namespace {

/// Uniform in [-1, 1): the upper bits of a linear congruential generator (Knuth's MMIX constants).
double next_uniform(uint64_t& seed) {
    seed = seed * 6364136223846793005U + 1442695040888963407U;
    return double(seed >> 40) / double(1 << 23) - 1;
}

}  // namespace

int main(int count, char** words) {
    const long rows = count > 1 ? std::strtol(words[1], nullptr, 10) : 2000;
    static sensor::BiasFilter filter;
    static sensor::FixedGainFilter fixed;
    sensor::begin(filter);
    uint64_t seed = 1;
    const double sd = std::sqrt(double(sensor::noise));
    for (long k = 0; k < rows; ++k) {
        const bool moves = k % 400 >= 350 || k == 0;
        const double noise = std::sqrt(3.0) * sd * next_uniform(seed);
        const double drift = 2 * sd * std::sin(double(k) / 500) + 10 * sd;
        const auto y = moves ? allanite::not_a_number<sensor::Scalar>() : sensor::Scalar(noise + drift);
        if (k == 1) sensor::begin(fixed, y);
        const auto innovation = sensor::on_sample(filter, y);
        if (k > 0) sensor::on_sample(fixed, y);
        std::printf("%.17g %.17g %.17g %.17g %.17g\n", double(y), double(innovation), double(sensor::bias(filter)),
                    double(sensor::bias_variance(filter)), double(sensor::bias(fixed)));
    }
    return 0;
}
