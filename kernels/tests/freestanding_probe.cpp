// SPDX-License-Identifier: BSD-3-Clause
// Compiled for a microcontroller, never run: the headers need no heap, no exceptions, no operating system, and in
// float no software double. It is also the smallest example of use.
#include "allanite/online_allan.hpp"
#include "allanite/smoother.hpp"
#include "allanite/whiten.hpp"

using allanite::Index;
using allanite::Slice;

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

// A filter of three states: flicker as one Gauss-Markov state, a walk, and the Earth's rotation that changes its sign
// as the sensor is turned. Of the last nothing is known at the start.
namespace {

constexpr Index n = 3;
constexpr Scalar transition[n * n] = {Scalar(0.999F), 0, 0, 0, 1, 0, 0, 0, 1};
constexpr Scalar process[n * n] = {Scalar(1e-4F), 0, 0, 0, Scalar(1e-8F), 0, 0, 0, 0};
constexpr Scalar noise[1] = {Scalar(1e-2F)};
constexpr Scalar readout[n] = {0, 0, 1};

Scalar estimate[n], covariance[n * n] = {Scalar(1e-2F), 0, 0, 0, 0, 0, 0, 0, 0}, directions[n * n] = {0, 0, 1};
Scalar scratch[allanite::filter_scratch(n, 1)];
Index rank = 1;

template <class T, Index size>
constexpr Slice<T> all(T (&array)[size]) noexcept {
    return {array, size};
}

template <int N>
void filter_sample(Scalar sample, Scalar sign, bool square_root, Scalar* mean, Scalar* sd) noexcept {
    const Scalar output[n] = {1, 1, sign};
    const allanite::Model<Scalar> model{n, 1, all(transition), all(process), all(output), all(noise), 0, 0};
    allanite::FilterState<Scalar> carried{all(estimate), all(covariance), {all(directions), rank}, {}};
    const allanite::FilterOutput<Scalar> out{1, all(readout), {mean, 1}, {sd, 1}, {nullptr, 0}, {nullptr, 0}};
    allanite::filter<N>(model, square_root, {1, {&sample, 1}, {nullptr, 0}}, carried, out,
                        allanite::Trace<Scalar>{}, all(scratch));
    rank = carried.directions.rank;
}

}  // namespace

extern "C" void filter_on_sample(Scalar sample, Scalar sign, bool square_root, Scalar* mean, Scalar* sd) {
    filter_sample<n>(sample, sign, square_root, mean, sd);
}

extern "C" void filter_of_any_size_on_sample(Scalar sample, Scalar sign, bool square_root, Scalar* mean, Scalar* sd) {
    filter_sample<allanite::any_size>(sample, sign, square_root, mean, sd);
}

extern "C" Scalar likelihood_of(const allanite::Likelihood<Scalar>* sums) { return allanite::log_likelihood(*sums); }

extern "C" void smooth_block(const allanite::Transition<Scalar>* f, const allanite::Trace<Scalar>* trace,
                             const allanite::Future<Scalar>* future, Slice<Scalar>* means, Slice<Scalar>* work) {
    allanite::smooth<Scalar>(*f, *trace, 0, *future, all(readout), *means, *means, *work);
}

extern "C" Scalar whiten_block(const allanite::Whitening<Scalar>* w, Slice<const Scalar>* noise_of_rows,
                               Slice<Scalar>* rows, Slice<Scalar>* work) {
    return allanite::whiten<Scalar>(*w, *noise_of_rows, allanite::fixed(*rows), *rows, *work);
}
