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

#include "kalman.hpp"

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
