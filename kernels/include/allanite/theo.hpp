// SPDX-License-Identifier: BSD-3-Clause
// Theo1: squares of every inner difference of a window, for averaging times beyond half of the record.
//
// In a window of m samples (m even), d = 1..m/2, the difference of the sums of its last d and of its first d samples is
//     z_d(i) = (x[i+m] - x[i+m-d]) - (x[i+d] - x[i]),
//     Theo1(m) = sum over the M windows and d of z_d^2/d / (0.75 m^2 M),   averaging time 0.75 m.
// (Howe and Peppler, "Very long-term frequency stability", 2003; Riley, NIST SP 1065, section 5.2.15.)
#ifndef ALLANITE_THEO_HPP
#define ALLANITE_THEO_HPP

#include <stdint.h>

#include "phase.hpp"

namespace allanite {

/// Sum of the squared inner differences at one distance d over `count` windows from `first` on.
///
/// @param head  phase at the first point of each window, every step-th point of the record
/// @param tail  phase `depth` steps before the last point of each window: tail[first + depth] ends window `first`
ALLANITE_WIDE inline double inner_squares(Slice<const double> head, Slice<const double> tail, Index depth, Index d,
                                          Index first, Index count) noexcept {
    double lane[lanes] = {};
    Index i = 0;
    for (; i + lanes <= count; i += lanes) {
        for (Index j = 0; j < lanes; ++j) {
            const Index a = first + i + j, b = a + depth;
            const double z = (tail[b] - tail[b - d]) - (head[a + d] - head[a]);
            lane[j] += z * z;
        }
    }
    for (Index j = 0; i < count; ++i, ++j) {
        const Index a = first + i, b = a + depth;
        const double z = (tail[b] - tail[b - d]) - (head[a + d] - head[a]);
        lane[j] += z * z;
    }
    return sum_of_lanes(lane);
}

/// Sum over the windows of `runs` and d = 1..depth of z_d^2/d.
///
/// The windows are taken stretch by stretch, all d over one before the next, so that both ends stay in cache. With
/// two arrays one loop serves the phase itself (tail = phase from m - depth on) and every step-th point of it.
///
/// @param head  (W + depth at least) see inner_squares
/// @param tail  (W + depth at least)
/// @param depth m/2, in steps
/// @param runs  (R * 2) half-open, sorted runs of complete windows, in steps
inline double theo_squares(Slice<const double> head, Slice<const double> tail, Index depth,
                           Slice<const int64_t> runs) noexcept {
    constexpr Index stretch = 1024;
    double total = 0.0;
    for (Index r = 0; r < runs.size / 2; ++r) {
        for (Index begin = runs[2 * r]; begin < runs[2 * r + 1]; begin += stretch) {
            const Index end = begin + stretch < runs[2 * r + 1] ? begin + stretch : Index(runs[2 * r + 1]);
            double sum = 0.0;
            for (Index d = depth; d >= 1; --d) {
                sum += inner_squares(head, tail, depth, d, begin, end - begin) / double(d);
            }
            total += sum;
        }
    }
    return total;
}

}  // namespace allanite

#endif
