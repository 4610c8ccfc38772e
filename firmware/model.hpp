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

/// r: the bias [rad/s] is bias . s, at the end of the sample.
constexpr Scalar bias[n_states] = {
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

}  // namespace sensor

#endif
