// SPDX-License-Identifier: BSD-3-Clause
// The likelihood as the arrays `sums` (4) and `counts` (6) of Python carry it from block to block.
#ifndef ALLANITE_CARRIED_HPP
#define ALLANITE_CARRIED_HPP

#include "allanite/likelihood.hpp"

namespace allanite {

constexpr size_t n_sums = 4, n_counts = 6;

inline Likelihood<double> likelihood_in(const double* sums, const int64_t* counts) noexcept {
    return {{sums[0], counts[1]}, {sums[3], counts[4]}, sums[1], sums[2], counts[0], counts[3], counts[5]};
}

inline void keep(const Likelihood<double>& likelihood, ptrdiff_t rank, double* sums, int64_t* counts) noexcept {
    const double new_sums[n_sums] = {likelihood.variances.mantissa, likelihood.squares, likelihood.remainder,
                                     likelihood.diffuse_variances.mantissa};
    const int64_t new_counts[n_counts] = {likelihood.innovations,
                                          likelihood.variances.exponent,
                                          int64_t(rank),
                                          likelihood.diffuse_updates,
                                          likelihood.diffuse_variances.exponent,
                                          likelihood.skipped};
    for (size_t i = 0; i < n_sums; ++i) sums[i] = new_sums[i];
    for (size_t i = 0; i < n_counts; ++i) counts[i] = new_counts[i];
}

}  // namespace allanite

#endif
