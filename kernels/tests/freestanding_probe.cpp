// SPDX-License-Identifier: BSD-3-Clause
// Compiled for a microcontroller, never run: the headers need no heap, no exceptions, no operating system, and in
// float no software double. It is also the smallest example of use.
#include "allanite/online_allan.hpp"

using allanite::Index;

namespace {

using Scalar = SCALAR;

// Octave lags from 1 to 32768 samples, at least 4 phase points per window.
constexpr int64_t lags[] = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
constexpr Index n_lags = 16, positions = 4, block = 8;
constexpr int order = 2;
constexpr Index n_levels = allanite::online_levels(lags[n_lags - 1], positions);

Scalar numbers[allanite::online_numbers(n_lags, n_levels, order, positions, block)];
int64_t counters[allanite::online_counters(n_lags, n_levels)];

allanite::OnlinePlan plan() noexcept { return {{lags, n_lags}, order, positions, block}; }

auto state() noexcept {
    return allanite::online_state<Scalar>(plan(), {numbers, Index(sizeof numbers / sizeof *numbers)},
                                          {counters, Index(sizeof counters / sizeof *counters)});
}

}  // namespace

extern "C" void allan_on_sample(Scalar sample) {
    allanite::online_feed<Scalar>(plan(), state(), {&sample, 1}, Scalar(0));
}

extern "C" void allan_read(Scalar* sums, int64_t* counts) {
    allanite::online_read<Scalar>(plan(), state(), {sums, n_lags}, {counts, n_lags});
}
