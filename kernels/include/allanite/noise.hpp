// SPDX-License-Identifier: BSD-3-Clause
// Correlated noise from normal numbers that the caller supplies.
#ifndef ALLANITE_NOISE_HPP
#define ALLANITE_NOISE_HPP

#include "slice.hpp"

namespace allanite {

/// Adds a weighted sum of J first-order Markov states to `out`:
///     s_j(k+1) = phi_j s_j(k) + step_sd_j normals[k, j]
///     out[k] += sum_j weight_now_j s_j(k) + weight_next_j s_j(k+1)
///
/// phi = 1 is a random walk. Point samples of the states have weight_now = 1, weight_next = 0. The mean of a Markov
/// state over an interval, given its two end points, is w (s(k) + s(k+1)) plus noise that is independent from
/// interval to interval: weight_now = weight_next = w, and that noise belongs to the caller's white noise.
///
/// @param normals      (n * J) standard normal numbers, the J numbers of one step side by side
/// @param phi, step_sd, weight_now, weight_next  (J)
/// @param state        (J) s(0) in, s(n) out: the next call goes on where this one ended
/// @param out          (n)
inline void markov_noise(Slice<const double> normals, Slice<const double> phi, Slice<const double> step_sd,
                         Slice<const double> weight_now, Slice<const double> weight_next, Slice<double> state,
                         Slice<double> out) noexcept {
    const Index states = state.size;
    for (Index k = 0; k < out.size; ++k) {
        double sum = 0.0;
        for (Index j = 0; j < states; ++j) {
            const double next = phi[j] * state[j] + step_sd[j] * normals[k * states + j];
            sum += weight_now[j] * state[j] + weight_next[j] * next;
            state[j] = next;
        }
        out[k] += sum;
    }
}

}  // namespace allanite

#endif
