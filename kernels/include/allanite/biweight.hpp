// SPDX-License-Identifier: BSD-3-Clause
// The two sums of the robust Allan variance: Tukey's biweight of the second differences of the phase, at a trial scale.
//
// With u = (x[i+2m] - 2 x[i+m] + x[i])^2 / scale and t = 1 - u/c^2 (0 where u > c^2), the estimating function is
//     psi(u) = u t^4,       u psi'(u) = u t^3 (t - 4 u/c^2):
// each difference squared, with the square of Tukey's weight. (Mondal and Percival, "M-estimation of wavelet variance",
// 2012; Guerrier, Molinari, Victoria-Feser and Xu, "Robust two-step wavelet-based inference for time series", 2022.)
#ifndef ALLANITE_BIWEIGHT_HPP
#define ALLANITE_BIWEIGHT_HPP

#include <stdint.h>

#include "phase.hpp"

namespace allanite {

struct BiweightSums {
    double psi;    ///< sum of psi(u)
    double slope;  ///< sum of u psi'(u) = -d/d(ln scale) of the other
};

/// Both sums over `count` starts from `first` on.
ALLANITE_WIDE inline BiweightSums biweight_stretch(Slice<const double> phase, Index lag, Index first, Index count,
                                                   double per_scale, double per_cut) noexcept {
    double psi[lanes] = {}, slope[lanes] = {};
    Index i = 0;
    for (; i + lanes <= count; i += lanes) {
        for (Index j = 0; j < lanes; ++j) {
            const double d = difference<2>(phase, first + i + j, lag);
            const double u = d * d * per_scale, v = u * per_cut;
            const double t = v < 1.0 ? 1.0 - v : 0.0, cubed = u * t * t * t;
            psi[j] += cubed * t;
            slope[j] += cubed * (t - 4.0 * v);
        }
    }
    for (Index j = 0; i < count; ++i, ++j) {
        const double d = difference<2>(phase, first + i, lag);
        const double u = d * d * per_scale, v = u * per_cut;
        const double t = v < 1.0 ? 1.0 - v : 0.0, cubed = u * t * t * t;
        psi[j] += cubed * t;
        slope[j] += cubed * (t - 4.0 * v);
    }
    return {sum_of_lanes(psi), sum_of_lanes(slope)};
}

/// Both sums over the starts of `runs`.
///
/// @param phase (n + 1)       @param lag  spacing in samples
/// @param runs  (R * 2) half-open, sorted runs of starts whose window of 2 lag samples is complete
/// @param scale trial value of the mean squared second difference, positive
/// @param cut   c^2
inline BiweightSums biweight_sums(Slice<const double> phase, Index lag, Slice<const int64_t> runs, double scale,
                                  double cut) noexcept {
    constexpr Index stretch = 4096;  // partial sums keep the rounding error small
    BiweightSums total{0.0, 0.0};
    for (Index r = 0; r < runs.size / 2; ++r) {
        for (Index begin = runs[2 * r]; begin < runs[2 * r + 1]; begin += stretch) {
            const Index end = begin + stretch < runs[2 * r + 1] ? begin + stretch : Index(runs[2 * r + 1]);
            const BiweightSums part = biweight_stretch(phase, lag, begin, end - begin, 1.0 / scale, 1.0 / cut);
            total.psi += part.psi;
            total.slope += part.slope;
        }
    }
    return total;
}

}  // namespace allanite

#endif
