// SPDX-License-Identifier: BSD-3-Clause
// Bias filter of channel gy, the worst axis of 2 channels: the largest Allan deviation, averaged over octaves
// written by allanite VERSION from lab bench.csv, SHA-256 abababababababababababababababababababababababababababababababab
// discrete at 10 Hz; a sample is the mean over its interval
// the study has 200 Hz: FEED MEANS of its samples over 1/10 s
// noise: white N = 8.700000e-05 rad/s/sqrt(Hz) [8.600e-05, 8.800e-05]
// noise: flicker B = 2.400000e-05 rad/s [2.200e-05, 2.700e-05]
// noise: K < 4.000000e-07 rad/s/sqrt(s) (95 % upper limit): not resolved, NOT in this filter
// flicker: a sum of Gauss-Markov states from one sample to 100 s, a factor 10 apart
// C++17 with <math.h>, <stddef.h> and <stdint.h>; no other file, no heap, no exceptions
#ifndef ALLANITE_SENSOR_MODEL_HPP
#define ALLANITE_SENSOR_MODEL_HPP

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
constexpr Scalar steady_sd = 4.05981097e-05F;  ///< [rad/s] of bias(), the prediction for the next sample, with it, at rest
constexpr Scalar steady_innovation_sd = 0.000277397285F;  ///< [rad/s] of y less its prediction

