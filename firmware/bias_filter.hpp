// SPDX-License-Identifier: BSD-3-Clause
// The bias of a sensor: better known with every sample at rest, predicted while the sensor moves.
//
// The constants are those that `allanite export firmware study.json -o model.hpp` writes; the arithmetic is that of
// kernels/include/allanite, which the Python package runs too. No heap, no exceptions, fixed time per sample.
#ifndef BIAS_FILTER_HPP
#define BIAS_FILTER_HPP

#include "allanite/square_root.hpp"
#include <model.hpp>  // of the folder that the compiler is told: -I

namespace firmware {

using allanite::Index;
using allanite::Slice;
using sensor::Scalar;

constexpr int n = sensor::n_states;

template <class T, Index size>
constexpr Slice<T> all_of(T (&array)[size]) noexcept {
    return {array, size};
}

/// Everything the filter carries, and its scratch. The covariance is kept as its factors U and D (one matrix): no
/// rounding can make it less than positive, whatever the length of the run.
struct BiasFilter {
    Scalar state[n];
    Scalar factors[n * n];
    bool is_started;
    Scalar gain[n];
    Scalar transition_parts[allanite::transition_numbers(n)];
    Scalar process_parts[allanite::factor_prediction_numbers(n)];
    Scalar work[allanite::orthogonalise_scratch(n, n)];
    allanite::Transition<Scalar> transition;
    allanite::FactorPrediction<Scalar> process;
};

/// Before the first sample.
inline void begin(BiasFilter& f) noexcept {
    f.is_started = false;
    f.transition = allanite::split_transition<Scalar>(all_of(sensor::transition), n, all_of(f.transition_parts));
    f.process = allanite::plan_factors<Scalar>(f.transition, all_of(sensor::process), all_of(f.process_parts));
    for (Index i = 0; i < n; ++i) f.state[i] = Scalar(0);
}

/// State and covariance of the next sample.
inline void predict(BiasFilter& f) noexcept {
    allanite::predict_state<n, Scalar>(f.transition, all_of(f.state), all_of(f.gain));
    allanite::predict_factors<n, Scalar>(f.transition, f.process, all_of(f.factors), all_of(f.work));
}

/// One sample: y at rest; not a number while the sensor moves, or where the sample is missing. Returns the innovation,
/// not a number where there is none.
inline Scalar on_sample(BiasFilter& f, Scalar y) noexcept {
    Scalar innovation = allanite::not_a_number<Scalar>();
    if (!f.is_started) {
        if (!allanite::is_finite(y)) return innovation;
        for (Index i = 0; i < n; ++i) f.state[i] = sensor::start_gain[i] * y;
        for (Index i = 0; i < n * n; ++i) f.factors[i] = sensor::start_covariance[i];
        f.is_started = allanite::factor<Scalar>(all_of(f.factors), n, all_of(f.gain));
    } else {
        innovation = allanite::update_factors<n, Scalar>(all_of(sensor::output), sensor::noise, y, all_of(f.state),
                                                         all_of(f.factors), all_of(f.gain), all_of(f.work))
                         .innovation;
    }
    predict(f);
    return innovation;
}

/// What to subtract from the samples; 0 before the first.
inline Scalar bias(const BiasFilter& f) noexcept {
    return allanite::dot<n>(all_of(sensor::bias), all_of(f.state));
}

/// Its variance; not a number before the first sample.
inline Scalar bias_variance(const BiasFilter& f) noexcept {
    if (!f.is_started) return allanite::not_a_number<Scalar>();
    Scalar product[n];
    allanite::product_of_factors<Scalar>(all_of(f.factors), all_of(sensor::bias), all_of(product));
    return allanite::dot<n>(all_of(sensor::bias), all_of(product));
}

/// The same with the gain that the filter settles at: no covariance, a few multiplications per sample. It takes long to
/// forget where it starts, so begin() it with a mean of samples at rest.
struct FixedGainFilter {
    Scalar state[n];
};

inline void begin(FixedGainFilter& f, Scalar mean_at_rest) noexcept {
    for (Index i = 0; i < n; ++i) f.state[i] = sensor::start_gain[i] * mean_at_rest;
}

inline void on_sample(FixedGainFilter& f, Scalar y) noexcept {
    const Scalar innovation = y - allanite::dot<n>(all_of(sensor::output), all_of(f.state));
    Scalar next[n];
    for (Index i = 0; allanite::is_finite(y) && i < n; ++i) f.state[i] += sensor::steady_gain[i] * innovation;
    for (Index i = 0; i < n; ++i) {
        next[i] = Scalar(0);
        for (Index j = 0; j < n; ++j) next[i] += sensor::transition[i * n + j] * f.state[j];
    }
    for (Index i = 0; i < n; ++i) f.state[i] = next[i];
}

inline Scalar bias(const FixedGainFilter& f) noexcept {
    return allanite::dot<n>(all_of(sensor::bias), all_of(f.state));
}

}  // namespace firmware

#endif
