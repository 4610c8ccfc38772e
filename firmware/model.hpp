// SPDX-License-Identifier: BSD-3-Clause
// Bias filter of channel gyro, the only one
// written by allanite 0.1.0 from samples or models in memory
// discrete at 100 Hz; a sample is the mean over its interval
// noise: white N = 8.726646e-05 rad/s/sqrt(Hz)
// noise: flicker B = 2.424068e-05 rad/s
// noise: random walk K = 4.040114e-07 rad/s/sqrt(s)
// flicker: a sum of Gauss-Markov states from one sample to 600 s, a factor 10 apart
// C++17 with <math.h>, <stddef.h> and <stdint.h>; no other file, no heap, no exceptions
#ifndef ALLANITE_SENSOR_MODEL_HPP
#define ALLANITE_SENSOR_MODEL_HPP

// -- allanite/bits.hpp ---
// SPDX-License-Identifier: BSD-3-Clause
// Is a number finite? Asked of its bits: with -ffast-math (-Ofast, -ffinite-math-only) a compiler takes it for granted
// that there is no NaN, and removes every comparison that would find one. Firmware-safe.
#ifndef ALLANITE_BITS_HPP
#define ALLANITE_BITS_HPP

#include <stdint.h>

// clang may take even the bits of an argument for those of a finite number.
#if defined(__clang__) && defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error "allanite marks a missing sample with NaN, which clang removes with -ffast-math: add -fno-finite-math-only"
#endif

namespace allanite {

template <int bytes>
struct WordOf;
template <>
struct WordOf<4> {
    using type = uint32_t;
    static constexpr type sign = 0x80000000U, infinity = 0x7F800000U;
};
template <>
struct WordOf<8> {
    using type = uint64_t;
    static constexpr type sign = 0x8000000000000000U, infinity = 0x7FF0000000000000U;
};

/// The bits of |x|, float or double, as a whole number: it grows with |x|, and is largest where x is NaN.
template <class Scalar>
typename WordOf<sizeof(Scalar)>::type magnitude_bits(Scalar x) noexcept {
    typename WordOf<sizeof(Scalar)>::type word = 0;
#if defined(__GNUC__)
    __builtin_memcpy(&word, &x, sizeof word);
#else
    const auto* from = reinterpret_cast<const unsigned char*>(&x);
    auto* to = reinterpret_cast<unsigned char*>(&word);
    for (unsigned i = 0; i < sizeof word; ++i) to[i] = from[i];
#endif
    return word & ~WordOf<sizeof(Scalar)>::sign;
}

template <class Scalar>
bool is_finite(Scalar x) noexcept {
    return magnitude_bits(x) < WordOf<sizeof(Scalar)>::infinity;
}

}  // namespace allanite

#endif

// -- allanite/slice.hpp ---
// SPDX-License-Identifier: BSD-3-Clause
// A pointer and a length, and the index type of all kernels.
#ifndef ALLANITE_SLICE_HPP
#define ALLANITE_SLICE_HPP

#include <stddef.h>
#include <stdint.h>

// A function that takes in all that it calls; not in the test build, where each access carries its check.
#if defined(ALLANITE_CHECK_BOUNDS) || !defined(__GNUC__)
#define ALLANITE_FLAT
#else
#define ALLANITE_FLAT __attribute__((flatten))
#endif

namespace allanite {

using Index = ptrdiff_t;

/// A view of `size` elements owned by the caller. Off-by-one in windows of m, 2m, 3m samples is *the* bug of this
/// field: with ALLANITE_CHECK_BOUNDS each access is checked (the test build); without it this is a bare pointer.
template <class T>
struct Slice {
    T* data;
    Index size;

    T& operator[](Index i) const noexcept {
#ifdef ALLANITE_CHECK_BOUNDS
        if (i < 0 || i >= size) __builtin_trap();
#endif
        return data[i];
    }

    /// Elements [start, start + length).
    Slice part(Index start, Index length) const noexcept {
#ifdef ALLANITE_CHECK_BOUNDS
        if (start < 0 || length < 0 || start + length > size) __builtin_trap();
#endif
        return {data + start, length};
    }
};

/// The same elements, not to be changed.
template <class T>
constexpr Slice<const T> fixed(Slice<T> slice) noexcept {
    return {slice.data, slice.size};
}

}  // namespace allanite

#endif

// -- allanite/kalman.hpp ---
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

// -- allanite/diffuse.hpp ---
// SPDX-License-Identifier: BSD-3-Clause
// Exact diffuse start: states of which nothing is known yet. Firmware-safe, as kalman.hpp.
//
//     x = known part + sum over k of d_k a_k,   d_k of infinite variance and independent of all else
//
// The known part has the mean x and the covariance P of the filter. Directions a_k are kept, not the matrix sum a a':
// a measurement y = h x + v that sees any of them takes one of them, a, away: with b = a / (h a)
//     x = x + b (y - h x),   P = (I - b h) P (I - b h)' + b R b',   a_k = a_k - b (h a_k),
// which is the limit of an infinite variance, without large numbers. Its innovation has no likelihood; ln (h a)^2
// summed over these updates is what the exact filter calls the sum of ln F_inf, once no direction is left; before that
// it depends on the units of the states. When none is left the filter is an ordinary one.
// Exact initial filter: Koopman (1997); one scalar at a time: Koopman and Durbin (2000).
//
// "Does h see a?" is decided by cancellation alone: a sum of products counts as zero where it is less than a few digits
// of its own terms. So it depends neither on the unit of the data nor on that of any state.
#ifndef ALLANITE_DIFFUSE_HPP
#define ALLANITE_DIFFUSE_HPP


namespace allanite {

/// The first `rank` rows of a matrix of the caller.
template <class Scalar>
struct Directions {
    Slice<Scalar> rows;  ///< (n * n)
    Index rank;
};

/// A sum below this share of its terms is what rounding left of them.
template <class Scalar>
constexpr Scalar cancellation = sizeof(Scalar) > 4 ? Scalar(1) / Scalar(int64_t(1) << 40) : Scalar(1) / Scalar(1 << 14);

template <class Scalar>
constexpr Scalar magnitude(Scalar x) noexcept {
    return x < Scalar(0) ? -x : x;
}

/// a + b, or zero where they cancel.
template <class Scalar>
constexpr Scalar sum_or_zero(Scalar a, Scalar b) noexcept {
    const Scalar sum = a + b;
    return magnitude(sum) <= cancellation<Scalar> * (magnitude(a) + magnitude(b)) ? Scalar(0) : sum;
}

/// A sum of products, and the sum of their magnitudes.
template <class Scalar>
struct Seen {
    Scalar sum, terms;
};

/// Sum of a_i b_i, zero where they cancel.
template <class A, class B>
auto dot_or_zero(Slice<A> a, Slice<B> b) noexcept {
    Seen<decltype(a[0] * b[0])> seen{0, 0};
    for (Index i = 0; i < a.size; ++i) {
        seen.sum += a[i] * b[i];
        seen.terms += magnitude(a[i] * b[i]);
    }
    if (magnitude(seen.sum) <= cancellation<decltype(seen.sum)> * seen.terms) seen.sum = 0;
    return seen;
}

/// Does the output h depend on a direction that is still diffuse?
template <class H, class Scalar>
bool sees_diffuse(Slice<H> h, const Directions<Scalar>& a) noexcept {
    for (Index k = 0; k < a.rank; ++k) {
        if (dot_or_zero(h, a.rows.part(k * h.size, h.size)).sum != Scalar(0)) return true;
    }
    return false;
}

/// Row k goes; the last row takes its place.
template <class Scalar>
void drop_direction(Directions<Scalar>& a, Index k, Index n) noexcept {
    --a.rank;
    for (Index i = 0; i < n; ++i) a.rows[k * n + i] = a.rows[a.rank * n + i];
}

template <class Scalar>
void drop_vanished(Directions<Scalar>& a, Index n) noexcept {
    for (Index k = a.rank - 1; k >= 0; --k) {
        bool vanished = true;
        for (Index i = 0; i < n; ++i) vanished = vanished && a.rows[k * n + i] == Scalar(0);
        if (vanished) drop_direction(a, k, n);
    }
}

/// a_k = F a_k. A direction that F takes to nothing is dropped. `work` (n).
template <class Scalar>
void predict_directions(const Transition<Scalar>& f, Directions<Scalar>& a, Slice<Scalar> work) noexcept {
    const Index n = f.diagonal.size;
    for (Index k = 0; k < a.rank; ++k) {
        const auto row = a.rows.part(k * n, n);
        for (Index i = 0; i < n; ++i) {
            work[i] = f.dense[i] != Scalar(0) ? dot_or_zero(f.matrix.part(i * n, n), row).sum : f.diagonal[i] * row[i];
        }
        for (Index i = 0; i < n; ++i) row[i] = work[i];
    }
    drop_vanished(a, n);
}

/// The direction that h sees best, relative to the terms of h a: the pivot. Its h a too; zero if h sees none.
template <class Scalar>
struct Pivot {
    Index row;
    Scalar seen;
};

template <class Scalar>
Pivot<Scalar> find_pivot(Slice<const Scalar> h, const Directions<Scalar>& a) noexcept {
    Pivot<Scalar> pivot{0, Scalar(0)};
    Scalar best = Scalar(0);
    for (Index k = 0; k < a.rank; ++k) {
        const auto seen = dot_or_zero(h, a.rows.part(k * h.size, h.size));
        if (magnitude(seen.sum) <= best * seen.terms) continue;
        best = magnitude(seen.sum) / seen.terms;
        pivot = {k, seen.sum};
    }
    return pivot;
}

/// Takes the pivot away from the directions. `b` (n): pivot / (h pivot), out.
template <class Scalar>
void take_direction(Slice<const Scalar> h, Pivot<Scalar> pivot, Directions<Scalar>& a, Slice<Scalar> b) noexcept {
    const Index n = h.size;
    for (Index i = 0; i < n; ++i) b[i] = a.rows[pivot.row * n + i] / pivot.seen;
    drop_direction(a, pivot.row, n);
    for (Index k = 0; k < a.rank; ++k) {
        const auto row = a.rows.part(k * n, n);
        const Scalar seen = dot_or_zero(h, row).sum;
        for (Index i = 0; i < n; ++i) row[i] = sum_or_zero(row[i], -(seen * b[i]));
    }
    drop_vanished(a, n);
}

/// P = (I - b h) P (I - b h)' + b R b'.
///
/// @param m         (n) P h'
/// @param variance  S = h P h' + R
template <class Scalar>
void update_covariance_diffuse(Slice<const Scalar> b, Slice<const Scalar> m, Scalar variance,
                               Slice<Scalar> p) noexcept {
    const Index n = b.size;
    for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) p[i * n + j] += (b[i] * b[j]) * variance - (b[i] * m[j] + m[i] * b[j]);
    }
}

}  // namespace allanite

#endif

// -- allanite/square_root.hpp ---
// SPDX-License-Identifier: BSD-3-Clause
// Square-root form of the filter: P = U D U', U unit upper triangular, D diagonal. P stays positive semidefinite
// whatever the rounding, because D is only ever multiplied by, or increased by, what is not negative. Firmware-safe.
//
// Both live in one matrix, D on its diagonal, U above, nothing below. Update: Bierman (1977), V; prediction: rank-one
// sums (Agee and Turner) where F is diagonal, else weighted Gram-Schmidt (Thornton), same book, VI.
#ifndef ALLANITE_SQUARE_ROOT_HPP
#define ALLANITE_SQUARE_ROOT_HPP


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

/// r: the bias [rad/s] is r . s, at the end of the sample.
constexpr Scalar bias_of_states[n_states] = {
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
constexpr Scalar steady_sd = 4.1961022e-05F;  ///< [rad/s] of bias(), the prediction for the next sample, with it, at rest
constexpr Scalar steady_innovation_sd = 0.000873642223F;  ///< [rad/s] of y less its prediction

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
    Scalar gate;   ///< standard deviations of the innovation beyond which a sample is left out; 0: none is
    int left_out;  ///< samples in a row that were left out so
    bool is_started;
    Scalar gain[n_states];
    Scalar transition_parts[allanite::transition_numbers(n_states)];
    Scalar process_parts[allanite::factor_prediction_numbers(n_states)];
    Scalar work[allanite::orthogonalise_scratch(n_states, n_states)];
    allanite::Transition<Scalar> transition_plan;
    allanite::FactorPrediction<Scalar> process_plan;
};

/// Before the first sample. The filter must stay where it is in memory from then on: it points into itself.
/// gate: see there; 5 is usual where samples may be spikes.
inline void begin(BiasFilter& f, Scalar gate = Scalar(0)) noexcept {
    f.gate = gate;
    f.left_out = 0;
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

/// The variance of readout . s, from the factors.
inline Scalar variance_of(const BiasFilter& f, Slice<const Scalar> readout) noexcept {
    Scalar product[n_states];
    allanite::product_of_factors<Scalar>(all_of(f.factors), readout, all_of(product));
    return allanite::dot<n_states>(readout, all_of(product));
}

/// The innovation that y would have, without using y: y less its prediction. Not a number where there is none: before
/// the first sample, or y is missing.
inline Scalar innovation(const BiasFilter& f, Scalar y) noexcept {
    if (!f.is_started || !allanite::is_finite(y)) return allanite::not_a_number<Scalar>();
    return y - allanite::dot<n_states>(all_of(output), all_of(f.state));
}

/// Its variance; not a number before the first sample.
inline Scalar innovation_variance(const BiasFilter& f) noexcept {
    return f.is_started ? variance_of(f, all_of(output)) + noise : allanite::not_a_number<Scalar>();
}

/// Is y further from its prediction than the gate lets pass?
inline bool is_beyond_gate(const BiasFilter& f, Scalar y) noexcept {
    if (!(f.gate > Scalar(0)) || !f.is_started || !allanite::is_finite(y)) return false;
    const Scalar v = innovation(f, y);
    return v * v > f.gate * f.gate * innovation_variance(f);
}

/// One sample: y at rest; not a number while the sensor moves, or where the sample is missing. Returns the innovation,
/// that of a sample too that the gate leaves out; not a number where there is none.
inline Scalar on_sample(BiasFilter& f, Scalar y) noexcept {
    const Scalar found = innovation(f, y);
    const bool is_left_out = is_beyond_gate(f, y);
    if (is_left_out) {
        ++f.left_out;
    } else if (allanite::is_finite(y)) {
        f.left_out = 0;
    }
    if (f.is_started && !is_left_out) {
        allanite::update_factors<n_states, Scalar>(all_of(output), noise, y, all_of(f.state), all_of(f.factors),
                                                   all_of(f.gain), all_of(f.work));
    } else if (!f.is_started) {
        if (!allanite::is_finite(y)) return found;
        for (Index i = 0; i < n_states; ++i) f.state[i] = start_gain[i] * y;
        for (Index i = 0; i < n_states * n_states; ++i) f.factors[i] = start_covariance[i];
        f.is_started = allanite::factor<Scalar>(all_of(f.factors), n_states, all_of(f.gain));
    }
    predict(f);
    return found;
}

/// What to subtract from the samples; 0 before the first.
inline Scalar bias(const BiasFilter& f) noexcept {
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(f.state));
}

/// Its variance; not a number before the first sample.
inline Scalar bias_variance(const BiasFilter& f) noexcept {
    return f.is_started ? variance_of(f, all_of(bias_of_states)) : allanite::not_a_number<Scalar>();
}

// -- with the steady gain ---------------------------------------------------------------------------------------------

/// The same with the gain that the filter settles at: no covariance, a few multiplications per sample. It is slow to
/// forget its start: initialize it with begin() and the mean of some samples at rest.
struct FixedGainFilter {
    Scalar state[n_states];
    Scalar gate;   ///< as that of BiasFilter, in standard deviations of the settled innovation
    int left_out;  ///< samples in a row that were left out so
};

inline void begin(FixedGainFilter& f, Scalar mean_at_rest, Scalar gate = Scalar(0)) noexcept {
    f.gate = gate;
    f.left_out = 0;
    for (Index i = 0; i < n_states; ++i) f.state[i] = start_gain[i] * mean_at_rest;
}

/// As innovation() of BiasFilter.
inline Scalar innovation(const FixedGainFilter& f, Scalar y) noexcept {
    if (!allanite::is_finite(y)) return allanite::not_a_number<Scalar>();
    return y - allanite::dot<n_states>(all_of(output), all_of(f.state));
}

/// As on_sample() of BiasFilter.
inline Scalar on_sample(FixedGainFilter& f, Scalar y) noexcept {
    const Scalar found = innovation(f, y), most = f.gate * steady_innovation_sd;
    const bool is_there = allanite::is_finite(y), is_left_out = is_there && most > Scalar(0) && found * found > most * most;
    if (is_there) f.left_out = is_left_out ? f.left_out + 1 : 0;
    Scalar next[n_states];
    for (Index i = 0; is_there && !is_left_out && i < n_states; ++i) f.state[i] += steady_gain[i] * found;
    for (Index i = 0; i < n_states; ++i) {
        next[i] = Scalar(0);
        for (Index j = 0; j < n_states; ++j) next[i] += transition[i * n_states + j] * f.state[j];
    }
    for (Index i = 0; i < n_states; ++i) f.state[i] = next[i];
    return found;
}

inline Scalar bias(const FixedGainFilter& f) noexcept {
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(f.state));
}

}  // namespace sensor

#endif
