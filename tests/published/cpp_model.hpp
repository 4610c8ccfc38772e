// SPDX-License-Identifier: BSD-3-Clause
// Bias filter of channel gy, the worst axis of 2 channels: the largest Allan deviation, averaged over octaves
// written by allanite VERSION from lab bench.csv, SHA-256 abababababababababababababababababababababababababababababababab
// discrete at 10 Hz; a sample is the mean over its interval
// the study has 200 Hz: FEED MEANS of its samples over 1/10 s
// noise: white N = 8.700000e-05 rad/s/sqrt(Hz) [8.600e-05, 8.800e-05]
// noise: flicker B = 2.400000e-05 rad/s [2.200e-05, 2.700e-05]
// noise: K < 4.000000e-07 rad/s/sqrt(s) (95 % upper limit): not resolved, NOT in this filter
// flicker: a sum of Gauss-Markov states from one sample to 100 s, a factor 10 apart
// needs the headers allanite/*.hpp of kernels/include, C++17, no heap, no exceptions
#ifndef ALLANITE_SENSOR_MODEL_HPP
#define ALLANITE_SENSOR_MODEL_HPP

#include <allanite/kalman.hpp>
#include <allanite/square_root.hpp>

namespace sensor {

using Scalar = float;

constexpr int n_states = 8;
//   0: flicker, faster than a sample
//   1: the slow end of flicker, and the turn-on bias, of which nothing is known
//   2: flicker, correlation time 0.01581 s
//   3: flicker, correlation time 0.1581 s
//   4: flicker, correlation time 1.581 s
//   5: flicker, correlation time 15.81 s
//   6: flicker, correlation time 158.1 s
//   7: mean over the sample of the states above

constexpr Scalar rate = 10.0F;  ///< [Hz] samples per second that the filter is fed with
constexpr Scalar noise = 7.58435759e-08F;  ///< [(rad/s)^2] variance of v

/// F, row by row, over one sample interval.
constexpr Scalar transition[n_states * n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.00179176283F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.531285609F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.938712941F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.993695403F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.999367744F, 0.0F,
    1.0F, 1.0F, 0.15783058F, 0.741102524F, 0.969033481F, 0.996844378F, 0.999683839F, 0.0F};

/// Covariance of w [(rad/s)^2], row by row.
constexpr Scalar process[n_states * n_states] = {
    1.06608814e-13F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.06608814e-13F,
    0.0F, 5.93342943e-14F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 2.96671471e-14F,
    0.0F, 0.0F, 4.2216955e-10F, 0.0F, 0.0F, 0.0F, 0.0F, 6.65120912e-11F,
    0.0F, 0.0F, 0.0F, 3.03007088e-10F, 0.0F, 0.0F, 0.0F, 1.46647573e-10F,
    0.0F, 0.0F, 0.0F, 0.0F, 5.01615083e-11F, 0.0F, 0.0F, 2.50723973e-11F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 5.30645477e-12F, 0.0F, 2.65321854e-12F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 5.33671054e-13F, 2.66835518e-13F,
    1.06608814e-13F, 2.96671471e-14F, 6.65120912e-11F, 1.46647573e-10F, 2.50723973e-11F, 2.65321854e-12F, 2.66835518e-13F, 9.55659751e-11F};

/// h: what a sample holds of the states.
constexpr Scalar output[n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F};

/// r: the bias [rad/s] is r . s, at the end of the sample.
constexpr Scalar bias_of_states[n_states] = {
    0.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 0.0F};

/// State after the first sample y: start_gain * y.
constexpr Scalar start_gain[n_states] = {
    0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F};

/// Its covariance [(rad/s)^2].
constexpr Scalar start_covariance[n_states * n_states] = {
    1.06608814e-13F, -1.06608814e-13F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    -1.06608814e-13F, 7.74194792e-08F, -6.6631479e-11F, -3.12871923e-10F, -4.09097742e-10F, -4.20838693e-10F, -4.22037431e-10F, 7.58435759e-08F,
    0.0F, -6.6631479e-11F, 4.22170905e-10F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, -3.12871923e-10F, 0.0F, 4.22170905e-10F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, -4.09097742e-10F, 0.0F, 0.0F, 4.22170905e-10F, 0.0F, 0.0F, 0.0F,
    0.0F, -4.20838693e-10F, 0.0F, 0.0F, 0.0F, 4.22170905e-10F, 0.0F, 0.0F,
    0.0F, -4.22037431e-10F, 0.0F, 0.0F, 0.0F, 0.0F, 4.22170905e-10F, 0.0F,
    0.0F, 7.58435759e-08F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 7.58435759e-08F};

/// Gain of the filter once it has settled: s += steady_gain * (y - output s), then s = transition s.
constexpr Scalar steady_gain[n_states] = {
    1.38544312e-06F, 0.000878113561F, 0.000865894018F, 0.00401233199F, 0.00473917283F, 0.00328110393F, 0.00136477321F, 0.0143689232F};
constexpr Scalar steady_sd = 4.0380255e-05F;  ///< [rad/s] of the bias with it, at rest

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
