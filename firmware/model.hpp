// SPDX-License-Identifier: BSD-3-Clause
// Bias filter of channel gyro, the only one
// written by allanite 0.1.0 from samples or models in memory
// discrete at 100 Hz; a sample is the mean over its interval
// noise: white N = 8.726646e-05 rad/s/sqrt(Hz)
// noise: flicker B = 2.424068e-05 rad/s
// noise: random walk K = 4.040114e-07 rad/s/sqrt(s)
// flicker: a sum of Gauss-Markov states from one sample to 600 s, a factor 10 apart
// needs the headers allanite/*.hpp of kernels/include, C++17, no heap, no exceptions
#ifndef ALLANITE_SENSOR_MODEL_HPP
#define ALLANITE_SENSOR_MODEL_HPP

#include <allanite/kalman.hpp>
#include <allanite/square_root.hpp>

namespace sensor {

using Scalar = float;

constexpr int n_states = 9;
//   0: flicker, faster than a sample
//   1: flicker, correlation time 0.009487 s
//   2: flicker, correlation time 0.09487 s
//   3: flicker, correlation time 0.9487 s
//   4: flicker, correlation time 9.487 s
//   5: flicker, correlation time 94.87 s
//   6: flicker, correlation time 948.7 s
//   7: the random walk of K and the slow end of flicker, and the turn-on bias, of which nothing is known
//   8: mean over the sample of the states above

constexpr Scalar rate = 100.0F;  ///< [Hz] samples per second that the filter is fed with
constexpr Scalar noise = 7.61695189e-07F;  ///< [(rad/s)^2] variance of v

/// F, row by row, over one sample interval.
constexpr Scalar transition[n_states * n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.348508537F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.899956135F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.989514435F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.998946463F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.999894596F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.999989459F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F,
    1.0F, 0.61805907F, 0.949099435F, 0.994748007F, 0.999473139F, 0.999947297F, 0.99999473F, 1.0F, 0.0F};

/// Covariance of w [(rad/s)^2], row by row.
constexpr Scalar process[n_states * n_states] = {
    3.91487063e-12F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 3.91487063e-12F,
    0.0F, 3.78371126e-10F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.73418039e-10F,
    0.0F, 0.0F, 8.18633651e-11F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 4.08938249e-11F,
    0.0F, 0.0F, 0.0F, 8.98451165e-12F, 0.0F, 0.0F, 0.0F, 0.0F, 4.49221423e-12F,
    0.0F, 0.0F, 0.0F, 0.0F, 9.06998551e-13F, 0.0F, 0.0F, 0.0F, 4.53499233e-13F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 9.07859247e-14F, 0.0F, 0.0F, 4.53929623e-14F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 9.07945376e-15F, 0.0F, 4.53972688e-15F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 2.64109095e-15F, 1.32054548e-15F,
    3.91487063e-12F, 1.73418039e-10F, 4.08938249e-11F, 4.49221423e-12F, 4.53499233e-13F, 4.53929623e-14F, 4.53972688e-15F, 1.32054548e-15F, 1.06323658e-10F};

/// h: what a sample holds of the states.
constexpr Scalar output[n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F};

/// r: the bias [rad/s] is r . s, at the end of the sample.
constexpr Scalar bias_of_states[n_states] = {
    0.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 0.0F};

/// State after the first sample y: start_gain * y.
constexpr Scalar start_gain[n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F, 1.0F};

/// Its covariance [(rad/s)^2].
constexpr Scalar start_covariance[n_states * n_states] = {
    3.91487063e-12F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, -3.91487063e-12F, 0.0F,
    0.0F, 4.30680847e-10F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, -2.66186204e-10F, 0.0F,
    0.0F, 0.0F, 4.30680847e-10F, 0.0F, 0.0F, 0.0F, 0.0F, -4.08758948e-10F, 0.0F,
    0.0F, 0.0F, 0.0F, 4.30680847e-10F, 0.0F, 0.0F, 0.0F, -4.28418914e-10F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 4.30680847e-10F, 0.0F, 0.0F, -4.30453938e-10F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 4.30680847e-10F, 0.0F, -4.30658149e-10F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 4.30680847e-10F, -4.30678577e-10F, 0.0F,
    -3.91487063e-12F, -2.66186204e-10F, -4.08758948e-10F, -4.28418914e-10F, -4.30453938e-10F, -4.30658149e-10F, -4.30678577e-10F, 7.64075607e-07F, 7.61695189e-07F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 7.61695189e-07F, 7.61695189e-07F};

/// Gain of the filter once it has settled: s += steady_gain * (y - output s), then s = transition s.
constexpr Scalar steady_gain[n_states] = {
    5.12920651e-06F, 0.000348415088F, 0.000528765438F, 0.00051563495F, 0.000379737043F, 0.000175452379F, 5.15354378e-05F, 5.88244755e-05F, 0.0020380515F};
constexpr Scalar steady_sd = 4.1922471e-05F;  ///< [rad/s] of the bias with it, at rest

// -- the filter -------------------------------------------------------------------------------------------------------

using allanite::Index;
using allanite::Slice;

template <class T, Index size>
constexpr Slice<T> all_of(T (&array)[size]) noexcept {
    return {array, size};
}

/// Everything the filter carries, and its scratch. The covariance is kept as its factors U and D (one matrix): no
/// rounding can make it less than positive, whatever the length of the run.
struct BiasFilter {
    Scalar state[n_states];
    Scalar factors[n_states * n_states];
    bool is_started;
    Scalar gain[n_states];
    Scalar transition_parts[allanite::transition_numbers(n_states)];
    Scalar process_parts[allanite::factor_prediction_numbers(n_states)];
    Scalar work[allanite::orthogonalise_scratch(n_states, n_states)];
    allanite::Transition<Scalar> transition_plan;
    allanite::FactorPrediction<Scalar> process_plan;
};

/// Before the first sample. The filter must stay where it is in memory from then on: it points into itself.
inline void begin(BiasFilter& f) noexcept {
    f.is_started = false;
    f.transition_plan = allanite::split_transition<Scalar>(all_of(transition), n_states, all_of(f.transition_parts));
    f.process_plan = allanite::plan_factors<Scalar>(f.transition_plan, all_of(process), all_of(f.process_parts));
    for (Index i = 0; i < n_states; ++i) f.state[i] = Scalar(0);
}

/// State and covariance of the next sample.
inline void predict(BiasFilter& f) noexcept {
    allanite::predict_state<n_states, Scalar>(f.transition_plan, all_of(f.state), all_of(f.gain));
    allanite::predict_factors<n_states, Scalar>(f.transition_plan, f.process_plan, all_of(f.factors), all_of(f.work));
}

/// One sample: y at rest; not a number while the sensor moves, or where the sample is missing. Returns the innovation,
/// not a number where there is none.
inline Scalar on_sample(BiasFilter& f, Scalar y) noexcept {
    Scalar innovation = allanite::not_a_number<Scalar>();
    if (!f.is_started) {
        if (!allanite::is_finite(y)) return innovation;
        for (Index i = 0; i < n_states; ++i) f.state[i] = start_gain[i] * y;
        for (Index i = 0; i < n_states * n_states; ++i) f.factors[i] = start_covariance[i];
        f.is_started = allanite::factor<Scalar>(all_of(f.factors), n_states, all_of(f.gain));
    } else {
        innovation = allanite::update_factors<n_states, Scalar>(all_of(output), noise, y, all_of(f.state),
                                                                all_of(f.factors), all_of(f.gain), all_of(f.work))
                         .innovation;
    }
    predict(f);
    return innovation;
}

/// What to subtract from the samples; 0 before the first.
inline Scalar bias(const BiasFilter& f) noexcept {
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(f.state));
}

/// Its variance; not a number before the first sample.
inline Scalar bias_variance(const BiasFilter& f) noexcept {
    if (!f.is_started) return allanite::not_a_number<Scalar>();
    Scalar product[n_states];
    allanite::product_of_factors<Scalar>(all_of(f.factors), all_of(bias_of_states), all_of(product));
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(product));
}

// -- with the steady gain ---------------------------------------------------------------------------------------------

/// The same with the gain that the filter settles at: no covariance, a few multiplications per sample. It takes long to
/// forget where it starts, so begin() it with a mean of samples at rest.
struct FixedGainFilter {
    Scalar state[n_states];
};

inline void begin(FixedGainFilter& f, Scalar mean_at_rest) noexcept {
    for (Index i = 0; i < n_states; ++i) f.state[i] = start_gain[i] * mean_at_rest;
}

inline void on_sample(FixedGainFilter& f, Scalar y) noexcept {
    const Scalar innovation = y - allanite::dot<n_states>(all_of(output), all_of(f.state));
    Scalar next[n_states];
    for (Index i = 0; allanite::is_finite(y) && i < n_states; ++i) f.state[i] += steady_gain[i] * innovation;
    for (Index i = 0; i < n_states; ++i) {
        next[i] = Scalar(0);
        for (Index j = 0; j < n_states; ++j) next[i] += transition[i * n_states + j] * f.state[j];
    }
    for (Index i = 0; i < n_states; ++i) f.state[i] = next[i];
}

inline Scalar bias(const FixedGainFilter& f) noexcept {
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(f.state));
}

}  // namespace sensor

#endif
