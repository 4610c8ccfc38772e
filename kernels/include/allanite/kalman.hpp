// SPDX-License-Identifier: BSD-3-Clause
// Kalman filter of one step: predict, and update with one scalar measurement. Covariance form.
// Firmware-safe: nothing allocates, throws or prints; no double constants where the scalar is float.
//
//     s' = F s + u + w,  Cov w = Q          y = h s + v,  Var v = R
//
// The state that is kept is the prediction for the next measurement: update first, then predict. Matrices are row by
// row and symmetric ones are stored whole; both halves hold the same digits at all times.
//
// Where a measurement may be free of noise (R = 0) the square-root form is the one to use: a state that is known
// exactly stays so there, here only up to rounding.
//
// N is the number of states where it is known to the compiler, which then unrolls every loop (for small filters), and
// `any_size` where it is not.
#ifndef ALLANITE_KALMAN_HPP
#define ALLANITE_KALMAN_HPP

#include <math.h>

#include "bits.hpp"
#include "slice.hpp"

namespace allanite {

constexpr int any_size = -1;

/// Number of states: N, or what the slices say.
template <int N>
constexpr Index extent(Index size) noexcept {
    return N == any_size ? size : Index(N);
}

/// Where a loop over one row of a symmetric matrix begins. Unrolled, only the upper half is computed, and copied to
/// the lower half at no cost; otherwise whole rows, which the compiler can do several elements at a time.
template <int N>
constexpr Index first_column(Index row) noexcept {
    return N == any_size ? 0 : row;
}

template <class Scalar>
constexpr Scalar not_a_number() noexcept {
    return Scalar(NAN);
}

template <class Scalar>
constexpr Scalar infinity() noexcept {
    return Scalar(INFINITY);
}

/// a where x > 0, else b. This and the next are all that a kernel asks about the sign of what it computes; scalars that
/// are several numbers side by side (lanes.hpp) answer for each of them.
template <class Scalar>
constexpr Scalar where_positive(Scalar x, Scalar a, Scalar b) noexcept {
    return x > Scalar(0) ? a : b;
}

template <class Scalar>
constexpr bool nowhere_positive(Scalar x) noexcept {
    return !(x > Scalar(0));
}

// ---- the transition -------------------------------------------------------------------------------------------------

/// A transition matrix that is known to be diagonal but for some rows, as those of noise models are: a Markov state
/// depends on itself alone, the mean over an interval on all of them.
template <class Scalar>
struct Transition {
    Slice<const Scalar> matrix;    ///< (n * n)
    Slice<const Scalar> diagonal;  ///< (n) of the diagonal rows; zero for the others
    Slice<const Scalar> products;  ///< (n * n) diagonal_i diagonal_j
    Slice<const Scalar> dense;     ///< (n) 1 where the row is not diagonal
    Index n_dense;
};

/// Number of Scalars that describe a transition of n states.
constexpr Index transition_numbers(Index n) noexcept { return n * n + 2 * n; }

template <class Scalar>
bool row_is_diagonal(Slice<const Scalar> row, Index i) noexcept {
    for (Index j = 0; j < row.size; ++j) {
        if (j != i && row[j] != Scalar(0)) return false;
    }
    return true;
}

/// Finds the diagonal rows of F. `numbers` (transition_numbers) belongs to the result.
template <class Scalar>
Transition<Scalar> split_transition(Slice<const Scalar> matrix, Index n, Slice<Scalar> numbers) noexcept {
    const auto diagonal = numbers.part(0, n), dense = numbers.part(n, n), products = numbers.part(2 * n, n * n);
    Index n_dense = 0;
    for (Index i = 0; i < n; ++i) {
        const bool is_diagonal = row_is_diagonal(matrix.part(i * n, n), i);
        diagonal[i] = is_diagonal ? matrix[i * n + i] : Scalar(0);
        dense[i] = Scalar(is_diagonal ? 0 : 1);
        n_dense += is_diagonal ? 0 : 1;
    }
    for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) products[i * n + j] = diagonal[i] * diagonal[j];
    }
    return {matrix, fixed(diagonal), fixed(products), fixed(dense), n_dense};
}

// ---- small products -------------------------------------------------------------------------------------------------

template <int N, class A, class B>
auto dot(Slice<A> a, Slice<B> b) noexcept {
    const Index n = extent<N>(a.size);
    auto sum = n > 0 ? a[0] * b[0] : A(0);
    for (Index i = 1; i < n; ++i) sum += a[i] * b[i];
    return sum;
}

/// out = P v for a symmetric P, row by row: v is mostly zeros, and rows are adjacent in memory.
template <int N, class P, class V, class Scalar>
void symmetric_product(Slice<P> p, Slice<V> v, Slice<Scalar> out) noexcept {
    const Index n = extent<N>(v.size);
    bool is_first = true;
    for (Index k = 0; k < n; ++k) {
        const Scalar factor = v[k];
        if (N == any_size && factor == Scalar(0)) continue;
        const auto row = p.part(k * n, n);
        for (Index j = 0; j < n; ++j) out[j] = is_first ? factor * row[j] : out[j] + factor * row[j];
        is_first = false;
    }
    for (Index j = 0; is_first && j < n; ++j) out[j] = Scalar(0);
}

// ---- predict --------------------------------------------------------------------------------------------------------

/// x = F x. `work` (n).
template <int N, class Scalar>
void predict_state(const Transition<Scalar>& f, Slice<Scalar> x, Slice<Scalar> work) noexcept {
    const Index n = extent<N>(x.size);
    if (f.n_dense == 0) {
        for (Index i = 0; i < n; ++i) x[i] *= f.diagonal[i];
        return;
    }
    for (Index i = 0; i < n; ++i) {
        work[i] = f.dense[i] != Scalar(0) ? dot<N>(f.matrix.part(i * n, n), x) : f.diagonal[i] * x[i];
    }
    for (Index i = 0; i < n; ++i) x[i] = work[i];
}

/// P = F P F' + Q for the rows of F that are diagonal; for the others zero + Q.
template <int N, class Scalar>
void predict_covariance_diagonal(const Transition<Scalar>& f, Slice<const Scalar> process, Slice<Scalar> p) noexcept {
    const Index n = extent<N>(f.diagonal.size);
    for (Index i = 0; i < n; ++i) {
        const auto row = p.part(i * n, n);
        const auto products = f.products.part(i * n, n), noise = process.part(i * n, n);
        for (Index j = first_column<N>(i); j < n; ++j) row[j] = products[j] * row[j] + noise[j];
        for (Index j = i + 1; N != any_size && j < n; ++j) p[j * n + i] = row[j];
    }
}

/// P = F P F' + Q. `work` (n * n).
template <int N, class Scalar>
void predict_covariance(const Transition<Scalar>& f, Slice<const Scalar> process, Slice<Scalar> p,
                        Slice<Scalar> work) noexcept {
    const Index n = extent<N>(f.diagonal.size);
    if (f.n_dense == 0) return predict_covariance_diagonal<N>(f, process, p);
    for (Index i = 0; i < n; ++i) {
        if (f.dense[i] != Scalar(0)) symmetric_product<N>(p, f.matrix.part(i * n, n), work.part(i * n, n));
    }
    predict_covariance_diagonal<N>(f, process, p);
    for (Index i = 0; i < n; ++i) {
        if (f.dense[i] == Scalar(0)) continue;
        const auto row = p.part(i * n, n), product = work.part(i * n, n);
        for (Index j = 0; j < n; ++j) row[j] += f.diagonal[j] * product[j];
        for (Index j = i; j < n; ++j) {
            if (f.dense[j] != Scalar(0)) row[j] += dot<N>(f.matrix.part(j * n, n), product);
        }
        for (Index j = 0; j < n; ++j) p[j * n + i] = row[j];
    }
}

// ---- update ---------------------------------------------------------------------------------------------------------

/// What a measurement did to the state.
enum class Update {
    none,      ///< nothing: it is missing, or of no use
    ordinary,  ///< the usual
    diffuse,   ///< it met a direction of which nothing was known: its innovation cannot be compared with anything
};

/// A measurement beside its prediction: v = y - h x, its variance S = h P h' + R, and 1 / S.
template <class Scalar>
struct Measured {
    Update kind;
    Scalar innovation, variance, inverse;
};

template <class Scalar>
constexpr Measured<Scalar> nothing_learnt() noexcept {
    return {Update::none, not_a_number<Scalar>(), not_a_number<Scalar>(), Scalar(0)};
}

/// Can an innovation with this variance be used? R >= 0 and 0 < S, all of them finite.
template <class Scalar>
bool is_sound(Scalar innovation, Scalar noise, Scalar variance) noexcept {
    return noise >= Scalar(0) && variance > Scalar(0) && is_finite(variance + innovation);
}

/// P = P - m m' / S.
template <int N, class Scalar>
void update_covariance(Slice<const Scalar> m, Scalar inverse, Slice<Scalar> p) noexcept {
    const Index n = extent<N>(m.size);
    for (Index i = 0; i < n; ++i) {
        const auto row = p.part(i * n, n);
        const Scalar factor = m[i];
        for (Index j = first_column<N>(i); j < n; ++j) row[j] -= (factor * m[j]) * inverse;
        for (Index j = i + 1; N != any_size && j < n; ++j) p[j * n + i] = row[j];
    }
}

/// x = x + k v, P = P - k k' S with v = y - h x, S = h P h' + R, k = P h' / S. Changes nothing where v and S cannot
/// be used: a missing y is not a number.
///
/// @param gain  (n) k, out
template <int N, class Scalar>
Measured<Scalar> update(Slice<const Scalar> h, Scalar noise, Scalar y, Slice<Scalar> x, Slice<Scalar> p,
                        Slice<Scalar> gain) noexcept {
    symmetric_product<N>(p, h, gain);
    const Scalar innovation = y - dot<N>(h, x), variance = noise + dot<N>(h, gain);
    if (!is_sound(innovation, noise, variance)) return nothing_learnt<Scalar>();
    const Scalar inverse = Scalar(1) / variance, step = inverse * innovation;
    update_covariance<N>(fixed(gain), inverse, p);
    for (Index i = 0; i < extent<N>(x.size); ++i) {
        x[i] += gain[i] * step;
        gain[i] *= inverse;
    }
    return {Update::ordinary, innovation, variance, inverse};
}

}  // namespace allanite

#endif
