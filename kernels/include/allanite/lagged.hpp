// SPDX-License-Identifier: BSD-3-Clause
// Sums of products of a series with itself, shifted.
#ifndef ALLANITE_LAGGED_HPP
#define ALLANITE_LAGGED_HPP

#include "slice.hpp"

namespace allanite {

/// sum of a b, as four sums side by side.
inline double product_sum(Slice<const double> a, Slice<const double> b) noexcept {
    double sums[4] = {};
    Index i = 0;
    for (; i + 4 <= a.size; i += 4) {
        for (Index l = 0; l < 4; ++l) sums[l] += a[i + l] * b[i + l];
    }
    for (; i < a.size; ++i) sums[0] += a[i] * b[i];
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

/// out[j] = sum of x[i] x[i - j] over i >= max(first, j), in pieces that stay in the cache for all shifts.
inline void lagged_products(Slice<const double> x, Index first, Slice<double> out) noexcept {
    constexpr Index piece = 1024;
    for (Index j = 0; j < out.size; ++j) out[j] = 0.0;
    for (Index start = first; start < x.size; start += piece) {
        const Index stop = start + piece < x.size ? start + piece : x.size;
        for (Index j = 0; j < out.size; ++j) {
            const Index from = start < j ? j : start;
            if (from < stop) out[j] += product_sum(x.part(from, stop - from), x.part(from - j, stop - from));
        }
    }
}

}  // namespace allanite

#endif
