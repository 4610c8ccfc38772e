// SPDX-License-Identifier: BSD-3-Clause
// Bias filter of channel gyro, the only one
// written by allanite 0.1.0 from samples or models in memory
// discrete at 100 Hz; a sample is the mean over its interval
// noise: white N = 8.726646e-05
// noise: flicker B = 2.424068e-05
// noise: random walk K = 4.040114e-07
// flicker: a sum of Gauss-Markov states from one sample to 600 s, a factor 10 apart
// firmware/bias_filter.hpp of allanite is a filter that uses these constants
#ifndef ALLANITE_SENSOR_MODEL_HPP
#define ALLANITE_SENSOR_MODEL_HPP

namespace sensor {

using Scalar = float;

constexpr int n_states = 9;
//   0: flicker, faster than a sample
//   1: flicker, correlation time 0.01 s
//   2: flicker, correlation time 0.1 s
//   3: flicker, correlation time 1 s
//   4: flicker, correlation time 10 s
//   5: flicker, correlation time 100 s
//   6: flicker, correlation time 1000 s
//   7: the random walk of K and the slow end of flicker, and the turn-on bias, of which nothing is known
//   8: mean over the sample of the states above

constexpr Scalar rate = 100.0F;  ///< [Hz] samples per second that the filter is fed with
constexpr Scalar noise = 7.61695087e-07F;  ///< [(rad/s)^2] variance of v

/// F, row by row, over one sample interval.
constexpr Scalar transition[n_states * n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.367879441F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.904837418F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.990049834F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.9990005F, 0.0F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.999900005F, 0.0F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.99999F, 0.0F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F,
    1.0F, 0.632120559F, 0.95162582F, 0.995016625F, 0.999500167F, 0.999950002F, 0.999995F, 1.0F, 0.0F};

/// Covariance of w [(rad/s)^2], row by row.
constexpr Scalar process[n_states * n_states] = {
    4.34952954e-12F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 4.34952954e-12F,
    0.0F, 3.72394532e-10F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.72089903e-10F,
    0.0F, 0.0F, 7.80691928e-11F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 3.90021001e-11F,
    0.0F, 0.0F, 0.0F, 8.52805215e-12F, 0.0F, 0.0F, 0.0F, 0.0F, 4.26399054e-12F,
    0.0F, 0.0F, 0.0F, 0.0F, 8.60500906e-13F, 0.0F, 0.0F, 0.0F, 4.30250417e-13F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 8.61275563e-14F, 0.0F, 0.0F, 4.30637781e-14F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 8.6135308e-15F, 0.0F, 4.3067654e-15F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 2.58932067e-15F, 1.29466033e-15F,
    4.34952954e-12F, 1.72089903e-10F, 3.90021001e-11F, 4.26399054e-12F, 4.30250417e-13F, 4.30637781e-14F, 4.3067654e-15F, 1.29466033e-15F, 1.05731477e-10F};

/// h: what a sample holds of the states.
constexpr Scalar output[n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F};

/// r: the bias [rad/s] is bias . s, at the end of the sample.
constexpr Scalar bias[n_states] = {
    0.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 0.0F};

/// State after the first sample y: start_gain * y.
constexpr Scalar start_gain[n_states] = {
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F, 1.0F};

/// Its covariance [(rad/s)^2].
constexpr Scalar start_covariance[n_states * n_states] = {
    4.34952954e-12F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, -4.34952954e-12F, 0.0F,
    0.0F, 4.30680847e-10F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, -2.72242218e-10F, 0.0F,
    0.0F, 0.0F, 4.30680847e-10F, 0.0F, 0.0F, 0.0F, 0.0F, -4.09847014e-10F, 0.0F,
    0.0F, 0.0F, 0.0F, 4.30680847e-10F, 0.0F, 0.0F, 0.0F, -4.28534603e-10F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 4.30680847e-10F, 0.0F, 0.0F, -4.30465578e-10F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 4.30680847e-10F, 0.0F, -4.30659314e-10F, 0.0F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 4.30680847e-10F, -4.30678693e-10F, 0.0F,
    -4.34952954e-12F, -2.72242218e-10F, -4.09847014e-10F, -4.28534603e-10F, -4.30465578e-10F, -4.30659314e-10F, -4.30678693e-10F, 7.64085243e-07F, 7.61695087e-07F,
    0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 7.61695087e-07F, 7.61695087e-07F};

/// Gain of the filter once it has settled: s += steady_gain * (y - output s), then s = transition s.
constexpr Scalar steady_gain[n_states] = {
    5.69869201e-06F, 0.000356312796F, 0.00052984445F, 0.00051401346F, 0.000375191853F, 0.000171454604F, 4.99049718e-05F, 5.82450966e-05F, 0.00203788362F};
constexpr Scalar steady_sd = 4.18047589e-05F;  ///< [rad/s] of the bias with it, at rest

}  // namespace sensor

#endif
