// SPDX-License-Identifier: BSD-3-Clause
// From rate samples to squared differences of phase: what the exact and the online Allan family share.
// Firmware-safe: nothing allocates, throws or prints.
#ifndef ALLANITE_PHASE_HPP
#define ALLANITE_PHASE_HPP

#include "bits.hpp"
#include "slice.hpp"

// The one loop that nearly all time is spent in is compiled twice where the compiler can do so: for any x86-64 and for
// AVX2, chosen when the program loads. A quarter faster, and the same digits: see `lanes`.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define ALLANITE_WIDE __attribute__((target_clones("default", "avx2"), noinline))
#else
#define ALLANITE_WIDE
#endif

namespace allanite {

/// A sample is missing where it is NaN, infinite, or an instrument's overload word (9.9e37 and beyond).
template <class Scalar>
bool is_missing(Scalar sample) noexcept {
    return magnitude_bits(sample) >= magnitude_bits(Scalar(9.9e37));
}

/// Difference of the phase x over a window of `order` steps of length m, as a difference of smaller differences:
/// where the phase varies slowly, those are exact.
///     order 2:  x[i+2m] - 2 x[i+m] + x[i]                 (Allan)
///     order 3:  x[i+3m] - 3 x[i+2m] + 3 x[i+m] - x[i]     (Hadamard)
template <int order, class Scalar>
Scalar difference(Slice<const Scalar> x, Index i, Index m) noexcept {
    static_assert(order == 2 || order == 3, "second or third difference");
    if constexpr (order == 2) {
        return (x[i + 2 * m] - x[i + m]) - (x[i + m] - x[i]);
    } else {
        return (x[i + 3 * m] - x[i]) - Scalar(3) * (x[i + 2 * m] - x[i + m]);
    }
}

/// Partial sums that are kept side by side. The order of additions is fixed by this number and by nothing else, so
/// every vector width gives the same digits.
constexpr Index lanes = 8;

template <class Scalar>
Scalar sum_of_lanes(const Scalar (&lane)[lanes]) noexcept {
    return ((lane[0] + lane[4]) + (lane[2] + lane[6])) + ((lane[1] + lane[5]) + (lane[3] + lane[7]));
}

/// Sum of the squared differences that start at `first`, `first + 1`, ..., `first + count - 1`.
template <int order, class Scalar>
ALLANITE_WIDE Scalar sum_squares(Slice<const Scalar> phase, Index step, Index first, Index count) noexcept {
    Scalar lane[lanes] = {};
    Index i = 0;
    for (; i + lanes <= count; i += lanes) {
        for (Index j = 0; j < lanes; ++j) {
            const Scalar d = difference<order>(phase, first + i + j, step);
            lane[j] += d * d;
        }
    }
    for (Index j = 0; i < count; ++i, ++j) {
        const Scalar d = difference<order>(phase, first + i, step);
        lane[j] += d * d;
    }
    return sum_of_lanes(lane);
}

}  // namespace allanite

#endif
