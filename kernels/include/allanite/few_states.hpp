// SPDX-License-Identifier: BSD-3-Clause
// An update and a prediction in one, for a few states, N of them, and a diagonal transition: the same as in kalman.hpp
// but for rounding, in the order that makes the processor wait least. Firmware-safe.
#ifndef ALLANITE_FEW_STATES_HPP
#define ALLANITE_FEW_STATES_HPP

#include "square_root.hpp"

namespace allanite {

/// Sum of a few terms by halves: the shortest chain of additions that wait for one another.
template <int count, class Scalar>
Scalar sum_by_halves(const Scalar* terms) noexcept {
    if constexpr (count == 1) {
        return terms[0];
    } else {
        return sum_by_halves<count / 2>(terms) + sum_by_halves<count - count / 2>(terms + count / 2);
    }
}

/// S = h P h' + R from the upper half of P. Loops here run over all of P, so that the compiler unrolls them.
template <int N, class Scalar>
Scalar innovation_variance(Slice<const Scalar> h, Scalar noise, Slice<const Scalar> p) noexcept {
    constexpr int count = N * (N + 1) / 2 + 1;
    Scalar terms[count];
    Index next = 0;
    for (Index i = 0; i < N; ++i) {
        for (Index j = 0; j < N; ++j) {
            if (j >= i) terms[next++] = (i == j ? h[i] * h[i] : (h[i] + h[i]) * h[j]) * p[i * N + j];
        }
    }
    terms[next] = noise;
    return sum_by_halves<count>(terms);
}

/// update() and the prediction with a diagonal F in one: the same but for rounding. Little waits for the division:
///     P = (f_i f_j P_ij + Q_ij) - (f_i m_i) (f_j m_j) / S
template <int N, class Scalar>
Measured<Scalar> update_and_predict(const Transition<Scalar>& f, Slice<const Scalar> process, Slice<const Scalar> h,
                                    Scalar noise, Scalar y, Slice<Scalar> x, Slice<Scalar> p,
                                    Slice<Scalar> m) noexcept {
    const Scalar innovation = y - dot<N>(h, x), variance = innovation_variance<N>(h, noise, fixed(p));
    const bool is_used = is_sound(innovation, noise, variance);
    const Scalar inverse = is_used ? Scalar(1) / variance : Scalar(0);
    const Scalar step = is_used ? inverse * innovation : Scalar(0);
    symmetric_product<N>(p, h, m);
    for (Index i = 0; i < N; ++i) m[i] *= f.diagonal[i];
    for (Index i = 0; i < N; ++i) {
        x[i] = f.diagonal[i] * x[i] + m[i] * step;
        for (Index j = 0; j < N; ++j) {
            if (j < i) continue;
            const Scalar predicted = f.products[i * N + j] * p[i * N + j] + process[i * N + j];
            p[i * N + j] = p[j * N + i] = predicted - (m[i] * m[j]) * inverse;
        }
    }
    if (!is_used) return nothing_learnt<Scalar>();
    return {Update::ordinary, innovation, variance, inverse};
}

/// The same on factors: an update, then a prediction.
template <int N, class Scalar>
Measured<Scalar> update_and_predict_factors(const Transition<Scalar>& f, const FactorPrediction<Scalar>& plan,
                                            Slice<const Scalar> h, Scalar noise, Scalar y, Slice<Scalar> x,
                                            Slice<Scalar> u, Slice<Scalar> gain, Slice<Scalar> work) noexcept {
    const auto measured = update_factors<N>(h, noise, y, x, u, gain, work);
    for (Index i = 0; i < N; ++i) x[i] *= f.diagonal[i];
    predict_factors_diagonal<N>(f, plan, u, work);
    return measured;
}

}  // namespace allanite

#endif
