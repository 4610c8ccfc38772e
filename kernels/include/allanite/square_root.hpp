// SPDX-License-Identifier: BSD-3-Clause
// Square-root form of the filter: P = U D U', U unit upper triangular, D diagonal. P stays positive semidefinite
// whatever the rounding, because D is only ever multiplied by, or increased by, what is not negative. Firmware-safe.
//
// Both live in one matrix, D on its diagonal, U above, nothing below. Update: Bierman (1977), V; prediction: rank-one
// sums (Agee and Turner) where F is diagonal, else weighted Gram-Schmidt (Thornton), same book, VI.
#ifndef ALLANITE_SQUARE_ROOT_HPP
#define ALLANITE_SQUARE_ROOT_HPP

#include "diffuse.hpp"

namespace allanite {

/// A variance below this is none, in any unit: its reciprocal would overflow, and digits of it are already lost.
template <class Scalar>
constexpr Scalar least_variance() noexcept {
    if constexpr (sizeof(Scalar) == sizeof(float)) {
        return Scalar(1e-36F);
    } else {
        return Scalar(1e-290);
    }
}

/// A covariance becomes its factors, in place. A pivot that is nothing but rounding counts as zero.
///
/// @param work  (n)
/// @return false if the matrix is not positive semidefinite; it is spoilt then
template <class Scalar>
bool factor(Slice<Scalar> p, Index n, Slice<Scalar> work) noexcept {
    for (Index j = 0; j < n; ++j) work[j] = p[j * n + j];
    for (Index j = n - 1; j >= 0; --j) {
        const Scalar pivot = p[j * n + j], rounding = cancellation<Scalar> * work[j];
        if (!(pivot >= -rounding)) return false;
        const bool vanishes = pivot <= rounding;
        if (vanishes) p[j * n + j] = Scalar(0);
        for (Index i = 0; i < j; ++i) {
            const Scalar coupling = p[i * n + j];
            if (vanishes && coupling * coupling > cancellation<Scalar> * (work[i] * work[j])) return false;
            p[i * n + j] = vanishes ? Scalar(0) : coupling / pivot;
        }
        for (Index i = 0; i < j; ++i) {
            const Scalar factor_i = p[i * n + j] * p[j * n + j];
            for (Index k = i; k < j; ++k) p[i * n + k] -= factor_i * p[k * n + j];
        }
        for (Index k = 0; k < j; ++k) p[j * n + k] = Scalar(0);
    }
    return true;
}

/// Factors become their covariance, in place.
template <class Scalar>
void compose(Slice<Scalar> u, Index n) noexcept {
    for (Index i = 0; i < n; ++i) {
        for (Index j = i; j < n; ++j) {
            Scalar sum = (i == j ? Scalar(1) : u[i * n + j]) * u[j * n + j];
            for (Index k = j + 1; k < n; ++k) sum += u[i * n + k] * u[k * n + k] * u[j * n + k];
            u[i * n + j] = sum;
        }
    }
    for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < i; ++j) u[i * n + j] = u[j * n + i];
    }
}

/// out = P h' from the factors of P.
template <class Scalar>
void product_of_factors(Slice<const Scalar> u, Slice<const Scalar> h, Slice<Scalar> out) noexcept {
    const Index n = h.size;
    for (Index j = 0; j < n; ++j) {
        Scalar f = h[j];
        for (Index i = 0; i < j; ++i) f += u[i * n + j] * h[i];
        f *= u[j * n + j];
        for (Index i = 0; i < j; ++i) out[i] += u[i * n + j] * f;
        out[j] = f;
    }
}

// ---- update ---------------------------------------------------------------------------------------------------------

/// Scratch of an update.
constexpr Index update_factors_scratch(Index n) noexcept { return 2 * n; }

/// As update(), on the factors of P. `work` (update_factors_scratch).
template <int N, class Scalar>
Measured<Scalar> update_factors(Slice<const Scalar> h, Scalar noise, Scalar y, Slice<Scalar> x, Slice<Scalar> u,
                                Slice<Scalar> gain, Slice<Scalar> work) noexcept {
    const Index n = extent<N>(x.size);
    const auto f = work.part(0, n), sums = work.part(n, n);  // U' h', and R + the first j terms of h P h'
    Scalar variance = noise;
    for (Index j = 0; j < n; ++j) {
        Scalar sum = h[j];
        for (Index i = 0; i < j; ++i) sum += u[i * n + j] * h[i];
        f[j] = sum;
        gain[j] = u[j * n + j] * sum;
        sums[j] = variance;
        variance += sum * gain[j];
    }
    const Scalar innovation = y - dot<N>(h, x);
    if (!is_sound(innovation, noise, variance)) return nothing_learnt<Scalar>();
    Scalar inverse_before = Scalar(0);  // never used with j = 0
    for (Index j = 0; j < n; ++j) {
        const Scalar before = sums[j], after = j + 1 < n ? sums[j + 1] : variance;
        const Scalar inverse = where_positive(after, Scalar(1) / after, Scalar(0));
        const Scalar g = gain[j], factor = f[j] * inverse_before, above_it = u[j * n + j];
        u[j * n + j] = where_positive(after, above_it * (before * inverse), above_it);
        for (Index i = 0; i < j; ++i) {
            const Scalar above = u[i * n + j];
            u[i * n + j] = above - factor * gain[i];
            gain[i] += above * g;
        }
        inverse_before = inverse;
    }
    const Scalar inverse = Scalar(1) / variance;
    for (Index i = 0; i < n; ++i) {
        gain[i] *= inverse;
        x[i] += gain[i] * innovation;
    }
    return {Update::ordinary, innovation, variance, inverse};
}

// ---- Gram-Schmidt ---------------------------------------------------------------------------------------------------

/// Sum of a_l b_l in four sums side by side, which need not wait for one another.
template <class A, class B>
auto dot_in_fours(Slice<A> a, Slice<B> b) noexcept {
    decltype(a[0] * b[0]) sums[4] = {};
    Index l = 0;
    for (; l + 4 <= a.size; l += 4) {
        for (Index k = 0; k < 4; ++k) sums[k] += a[l + k] * b[l + k];
    }
    for (Index k = 0; l < a.size; ++l, ++k) sums[k] += a[l] * b[l];
    return (sums[0] + sums[2]) + (sums[1] + sums[3]);
}

/// Factors of W diag(weights) W', W (n * width), which is spoilt. `work` (width).
template <class Scalar>
void orthogonalise(Slice<Scalar> w, Slice<const Scalar> weights, Index n, Slice<Scalar> u,
                   Slice<Scalar> work) noexcept {
    const Index width = weights.size;
    for (Index j = n - 1; j >= 0; --j) {
        const auto row = w.part(j * width, width);
        for (Index l = 0; l < width; ++l) work[l] = weights[l] * row[l];
        const Scalar square = dot_in_fours(work, row);
        u[j * n + j] = square;
        const Scalar inverse = where_positive(square - least_variance<Scalar>(), Scalar(1) / square, Scalar(0));
        for (Index i = 0; i < j; ++i) {
            const auto other = w.part(i * width, width);
            const Scalar share = dot_in_fours(work, other) * inverse;
            u[i * n + j] = share;
            for (Index l = 0; l < width; ++l) other[l] -= share * row[l];
        }
    }
}

/// Scratch of update_factors_diffuse() and of predict_factors(): W, its weights, one more row.
constexpr Index orthogonalise_scratch(Index n, Index columns) noexcept { return (n + 2) * (n + columns); }

/// (I - b h) P (I - b h)' + b R b' on the factors. `work` (orthogonalise_scratch(n, 1)).
template <class Scalar>
void update_factors_diffuse(Slice<const Scalar> h, Slice<const Scalar> b, Scalar noise, Slice<Scalar> u,
                            Slice<Scalar> work) noexcept {
    const Index n = h.size, width = n + 1;
    const auto w = work.part(0, n * width), weights = work.part(n * width, width);
    for (Index j = 0; j < n; ++j) {
        weights[j] = u[j * n + j];
        Scalar seen = h[j];
        for (Index i = 0; i < j; ++i) seen += h[i] * u[i * n + j];
        for (Index i = 0; i < n; ++i) {
            const Scalar element = i < j ? u[i * n + j] : Scalar(i == j ? 1 : 0);
            w[i * width + j] = element - b[i] * seen;
        }
    }
    weights[n] = noise;
    for (Index i = 0; i < n; ++i) w[i * width + n] = b[i];
    orthogonalise(w, fixed(weights), n, u, work.part((n + 1) * width, width));
}

// ---- predict --------------------------------------------------------------------------------------------------------

/// What the prediction of factors needs to know of F and Q.
template <class Scalar>
struct FactorPrediction {
    Slice<const Scalar> ratios;   ///< (n * n) of the diagonal, F_ii / F_jj; empty unless F is diagonal without zeros
    Slice<const Scalar> process;  ///< (n * n) factors of Q
    Slice<const Scalar> columns;  ///< (n * columns) columns of U of Q that carry noise
    Slice<const Scalar> weights;  ///< (columns) D of Q, where it is not zero
    bool is_valid;                ///< false: Q is not positive semidefinite
};

constexpr Index factor_prediction_numbers(Index n) noexcept { return 3 * n * n + n; }

/// Factors Q and packs it. `numbers` (factor_prediction_numbers) belongs to the result.
template <class Scalar>
FactorPrediction<Scalar> plan_factors(const Transition<Scalar>& f, Slice<const Scalar> process,
                                      Slice<Scalar> numbers) noexcept {
    const Index n = f.diagonal.size;
    const auto ratios = numbers.part(0, n * n), q = numbers.part(n * n, n * n);
    const auto columns = numbers.part(2 * n * n, n * n), weights = numbers.part(3 * n * n, n);
    bool is_diagonal = f.n_dense == 0;
    for (Index i = 0; i < n; ++i) is_diagonal = is_diagonal && f.diagonal[i] != Scalar(0);
    for (Index i = 0; is_diagonal && i < n * n; ++i) ratios[i] = f.diagonal[i / n] / f.diagonal[i % n];
    for (Index i = 0; i < n * n; ++i) q[i] = process[i];
    const bool is_valid = factor(q, n, weights);
    Index count = 0;
    for (Index j = 0; j < n; ++j) count += q[j * n + j] > Scalar(0) ? 1 : 0;
    for (Index j = 0, c = 0; is_valid && j < n; ++j) {
        if (!(q[j * n + j] > Scalar(0))) continue;
        weights[c] = q[j * n + j];
        for (Index i = 0; i < n; ++i) {
            columns[i * count + c] = i < j ? q[i * n + j] : Scalar(i == j ? 1 : 0);
        }
        ++c;
    }
    return {fixed(ratios.part(0, is_diagonal ? n * n : 0)), fixed(q), fixed(columns.part(0, n * count)),
            fixed(weights.part(0, count)), is_valid};
}

/// U D U' + c a a', where a is zero below `last`, its element there 1. `a` (last + 1) is spoilt.
template <int N, class Scalar>
void add_rank_one(Slice<Scalar> u, Index states, Index last, Scalar c, Slice<Scalar> a) noexcept {
    const Index n = extent<N>(states);
    for (Index j = last; j > 0; --j) {
        const Scalar s = a[j], before = u[j * n + j], product = c * s, after = before + product * s;
        if (nowhere_positive(after)) continue;  // neither variance nor noise here
        const Scalar inverse = where_positive(after, Scalar(1) / after, Scalar(0)), slope = product * inverse;
        u[j * n + j] = after;
        for (Index i = 0; i < j; ++i) {
            a[i] -= s * u[i * n + j];
            u[i * n + j] += slope * a[i];
        }
        c = where_positive(after, c * (before * inverse), c);
    }
    u[0] += c * a[0] * a[0];
}

/// P = F P F' + Q on the factors, F diagonal. `work` (n).
template <int N, class Scalar>
void predict_factors_diagonal(const Transition<Scalar>& f, const FactorPrediction<Scalar>& plan, Slice<Scalar> u,
                              Slice<Scalar> work) noexcept {
    const Index n = extent<N>(f.diagonal.size);
    for (Index i = 0; i < n; ++i) {
        u[i * n + i] *= f.products[i * n + i];
        for (Index j = i + 1; j < n; ++j) u[i * n + j] *= plan.ratios[i * n + j];
    }
    for (Index j = 0; j < n; ++j) {
        if (plan.process[j * n + j] == Scalar(0)) {  // of a state that died away the column means nothing, and grows
            const bool is_gone = nowhere_positive(u[j * n + j] - least_variance<Scalar>());
            for (Index i = 0; is_gone && i <= j; ++i) u[i * n + j] = Scalar(0);
            continue;
        }
        for (Index i = 0; i < j; ++i) work[i] = plan.process[i * n + j];
        work[j] = Scalar(1);
        add_rank_one<N>(u, n, j, plan.process[j * n + j], work);
    }
}

/// P = F P F' + Q on the factors, any F. `work` (orthogonalise_scratch(n, columns of Q)).
template <int N, class Scalar>
void predict_factors(const Transition<Scalar>& f, const FactorPrediction<Scalar>& plan, Slice<Scalar> u,
                     Slice<Scalar> work) noexcept {
    if (plan.ratios.size > 0) return predict_factors_diagonal<N>(f, plan, u, work);
    const Index n = extent<N>(f.diagonal.size), columns = plan.weights.size, width = n + columns;
    const auto w = work.part(0, n * width), weights = work.part(n * width, width);
    for (Index i = 0; i < n; ++i) {
        const auto row = w.part(i * width, width);
        for (Index j = 0; j < n; ++j) row[j] = Scalar(0);
        for (Index k = 0; k < n; ++k) {
            const Scalar factor_k = f.matrix[i * n + k];
            if (factor_k == Scalar(0)) continue;
            row[k] += factor_k;
            for (Index j = k + 1; j < n; ++j) row[j] += factor_k * u[k * n + j];
        }
        for (Index c = 0; c < columns; ++c) row[n + c] = plan.columns[i * columns + c];
    }
    for (Index j = 0; j < n; ++j) weights[j] = u[j * n + j];
    for (Index c = 0; c < columns; ++c) weights[n + c] = plan.weights[c];
    orthogonalise(w, fixed(weights), n, u, work.part((n + 1) * width, width));
}

}  // namespace allanite

#endif
