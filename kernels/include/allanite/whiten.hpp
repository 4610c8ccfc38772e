// SPDX-License-Identifier: BSD-3-Clause
// Whitening of several series at once: regression with correlated noise.
#ifndef ALLANITE_WHITEN_HPP
#define ALLANITE_WHITEN_HPP

#include "likelihood.hpp"

namespace allanite {

/// One covariance recursion and c series that share its gain: each becomes innovation / sqrt(S), which is white with
/// unit variance where the series is noise of this model, and linear in the series.
template <class Scalar>
struct Whitening {
    Transition<Scalar> transition;
    Slice<const Scalar> process;  ///< (n * n)
    Slice<const Scalar> output;   ///< (n)
    Slice<Scalar> covariance;     ///< (n * n) of the predicted state, in and out
    Slice<Scalar> states;         ///< (n * c) predicted states, one column per series, in and out
    Index columns;                ///< c
};

/// Scratch: m, and the dense rows of F times the covariance or the states.
constexpr Index whiten_scratch(Index n, Index columns) noexcept { return n + n * (n > columns ? n : columns); }

template <class Scalar>
bool all_finite(Slice<const Scalar> values) noexcept {
    for (Index i = 0; i < values.size; ++i) {
        if (!is_finite(values[i])) return false;
    }
    return true;
}

/// out = series - h x, then x += m / S out, then out /= sqrt(S): one row of all series.
template <class Scalar>
void whiten_row(const Whitening<Scalar>& w, Slice<const Scalar> series, Slice<const Scalar> m, Scalar variance,
                Slice<Scalar> out) noexcept {
    const Index n = w.output.size, columns = w.columns;
    const Scalar inverse = Scalar(1) / variance, scale = Scalar(1) / square_root(variance);
    for (Index c = 0; c < columns; ++c) out[c] = series[c];
    for (Index i = 0; i < n; ++i) {
        const Scalar h = w.output[i];
        if (h == Scalar(0)) continue;
        for (Index c = 0; c < columns; ++c) out[c] -= h * w.states[i * columns + c];
    }
    for (Index i = 0; i < n; ++i) {
        const Scalar gain = m[i] * inverse;
        for (Index c = 0; c < columns; ++c) w.states[i * columns + c] += gain * out[c];
    }
    for (Index c = 0; c < columns; ++c) out[c] *= scale;
}

/// X = F X for all series. `work` (n * c).
template <class Scalar>
void predict_states(const Whitening<Scalar>& w, Slice<Scalar> work) noexcept {
    const Index n = w.output.size, columns = w.columns;
    for (Index i = 0; w.transition.n_dense > 0 && i < n; ++i) {
        if (w.transition.dense[i] == Scalar(0)) continue;
        const auto row = work.part(i * columns, columns);
        for (Index c = 0; c < columns; ++c) row[c] = Scalar(0);
        for (Index k = 0; k < n; ++k) {
            const Scalar f = w.transition.matrix[i * n + k];
            if (f == Scalar(0)) continue;
            for (Index c = 0; c < columns; ++c) row[c] += f * w.states[k * columns + c];
        }
    }
    for (Index i = 0; i < n; ++i) {
        const bool is_dense = w.transition.dense[i] != Scalar(0);
        for (Index c = 0; c < columns; ++c) {
            Scalar& x = w.states[i * columns + c];
            x = is_dense ? work[i * columns + c] : w.transition.diagonal[i] * x;
        }
    }
}

/// A row with a sample that is not finite, or whose noise is not, is missing: NaN in `out`, predict only. The same
/// goes for a row without a positive innovation variance, and then the sum is NaN.
///
/// @param noise    (rows) variance of v
/// @param series   (rows * c)
/// @param out      (rows * c) may be the series itself
/// @param scratch  (whiten_scratch)
/// @return sum of ln S over the rows that are present
template <class Scalar>
Scalar whiten(const Whitening<Scalar>& w, Slice<const Scalar> noise, Slice<const Scalar> series, Slice<Scalar> out,
              Slice<Scalar> scratch) noexcept {
    const Index n = w.output.size, columns = w.columns;
    const auto m = scratch.part(0, n), work = scratch.part(n, scratch.size - n);
    LogProduct<Scalar> variances;
    bool sound = true;
    for (Index k = 0; k < noise.size; ++k) {
        const auto row = series.part(k * columns, columns);
        const auto out_row = out.part(k * columns, columns);
        Scalar variance = noise[k];
        bool present = is_finite(variance) && all_finite(row);
        if (present) {
            symmetric_product<any_size>(w.covariance, w.output, m);
            for (Index i = 0; i < n; ++i) variance += w.output[i] * m[i];
            present = variance > Scalar(0) && is_finite(variance);
            sound = sound && present && !(noise[k] < Scalar(0));
        }
        if (present) {
            whiten_row(w, row, fixed(m), variance, out_row);
            update_covariance<any_size>(fixed(m), Scalar(1) / variance, w.covariance);
            multiply(variances, variance);
        } else {
            for (Index c = 0; c < columns; ++c) out_row[c] = not_a_number<Scalar>();
        }
        predict_covariance<any_size>(w.transition, w.process, w.covariance, work);
        predict_states(w, work);
    }
    return sound ? log_of(variances) : not_a_number<Scalar>();
}

}  // namespace allanite

#endif
