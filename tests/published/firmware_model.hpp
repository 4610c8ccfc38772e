// SPDX-License-Identifier: BSD-3-Clause
// Bias filter of channel gy, the worst axis of 2 channels: the largest Allan deviation, averaged over octaves
// written by allanite VERSION from lab bench.csv, SHA-256 abababababababababababababababababababababababababababababababab
// discrete at 10 Hz; a sample is the mean over its interval
// the study has 200 Hz: FEED MEANS of its samples over 1/10 s
// noise: white N = 8.700000e-05 [8.600e-05, 8.800e-05]
// noise: flicker B = 2.400000e-05 [2.200e-05, 2.700e-05]
// noise: K < 4.000000e-07 (95 % upper limit): not resolved, NOT in this filter
// flicker: a sum of Gauss-Markov states from one sample to 100 s, a factor 10 apart
// firmware/bias_filter.hpp of allanite is a filter that uses these constants
#ifndef ALLANITE_SENSOR_MODEL_HPP
#define ALLANITE_SENSOR_MODEL_HPP

namespace sensor {

using Scalar = float;

constexpr int n_states = 7;
//   0: flicker, faster than a sample
//   1: the slow end of flicker, and the turn-on bias, of which nothing is known
//   2: flicker, correlation time 0.1 s
//   3: flicker, correlation time 1 s
//   4: flicker, correlation time 10 s
//   5: flicker, correlation time 100 s
//   6: mean over the sample of the states above

constexpr Scalar rate = 10.0F;  ///< [Hz] samples per second that the filter is fed with
constexpr Scalar noise = 7.5838543e-08F;  ///< [(rad/s)^2] variance of v

/// F, row by row, over one sample interval.
constexpr Scalar transition[n_states * n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.367879441F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.904837418F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.990049834F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.9990005F, 0.0F,
    1.0F, 1.0F, 0.632120559F, 0.95162582F, 0.995016625F, 0.999500167F, 0.0F};

/// Covariance of w [(rad/s)^2], row by row.
constexpr Scalar process[n_states * n_states] = {
    4.26358598e-12F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 4.26358598e-12F,
    0.0F, 9.38157567e-14F, 0.0F, 0.0F, 0.0F, 0.0F, 4.69078783e-14F,
    0.0F, 0.0F, 3.65036286e-10F, 0.0F, 0.0F, 0.0F, 1.68689531e-10F,
    0.0F, 0.0F, 0.0F, 7.6526602e-11F, 0.0F, 0.0F, 3.82314468e-11F,
    0.0F, 0.0F, 0.0F, 0.0F, 8.35954401e-12F, 0.0F, 4.17973717e-12F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 8.43498031e-13F, 4.2174898e-13F,
    4.26358598e-12F, 4.69078783e-14F, 1.68689531e-10F, 3.82314468e-11F, 4.17973717e-12F, 4.2174898e-13F, 1.03641902e-10F};

/// h: what a sample holds of the states.
constexpr Scalar output[n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F};

/// r: the bias [rad/s] is bias . s, at the end of the sample.
constexpr Scalar bias[n_states] = {
    0.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 0.0F};

/// State after the first sample y: start_gain * y.
constexpr Scalar start_gain[n_states] = {
    0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F};

/// Its covariance [(rad/s)^2].
constexpr Scalar start_covariance[n_states * n_states] = {
    4.26358598e-12F, -4.26358598e-12F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    -4.26358598e-12F, 7.73371751e-08F, -2.66862908e-10F, -4.01748733e-10F, -4.20067069e-10F, -4.2195989e-10F, 7.5838543e-08F,
    0.0F, -2.66862908e-10F, 4.22170905e-10F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, -4.01748733e-10F, 0.0F, 4.22170905e-10F, 0.0F, 0.0F, 0.0F,
    0.0F, -4.20067069e-10F, 0.0F, 0.0F, 4.22170905e-10F, 0.0F, 0.0F,
    0.0F, -4.2195989e-10F, 0.0F, 0.0F, 0.0F, 4.22170905e-10F, 0.0F,
    0.0F, 7.5838543e-08F, 0.0F, 0.0F, 0.0F, 0.0F, 7.5838543e-08F};

/// Gain of the filter once it has settled: s += steady_gain * (y - output s), then s = transition s.
constexpr Scalar steady_gain[n_states] = {
    5.540527e-05F, 0.00110414451F, 0.00344312668F, 0.00481772893F, 0.00366626332F, 0.00165429446F, 0.0144786653F};
constexpr Scalar steady_sd = 3.599017e-05F;  ///< [rad/s] of the bias with it, at rest

}  // namespace sensor

#endif
