// SPDX-License-Identifier: BSD-3-Clause
// The door to kernels/gain_filter.cpp, compiled twice as kernels/strands.cpp is, for the same reason.
#ifndef ALLANITE_GAIN_FILTER_CALL_HPP
#define ALLANITE_GAIN_FILTER_CALL_HPP

#include <stddef.h>
#include <stdint.h>

/// What allanite::gain_filter() is given. Pointers of length: transition, process, covariance, directions n * n;
/// output, drift, state n; a, g, h steps * n * n; y, made, drift_mean, drift_sd, standardized rows; readout
/// readouts * n; means, sds instants * readouts; sums 4, counts 6 (carried.hpp); scratch
/// gain_filter_scratch(n, readouts). Where noise is drawn, `made` is `y`, and what only a filter has is null.
struct GainFilterCall {
    ptrdiff_t states, rows, steps, readouts, first, step, instants;
    bool square_root, draws;
    double noise;
    const double *transition, *process, *output, *a, *g, *h, *y, *drift, *readout;
    double *made, *state, *covariance, *directions, *sums;
    int64_t* counts;
    double *drift_mean, *drift_sd, *standardized, *means, *sds, *scratch;
};

ptrdiff_t gain_filter_scratch_of(ptrdiff_t states, ptrdiff_t readouts) noexcept;
bool gain_filter_for_all(const GainFilterCall& call) noexcept;
bool gain_filter_for_avx2(const GainFilterCall& call) noexcept;  // if ALLANITE_WITH_AVX2

/// allanite::lagged_products() of `size` numbers to `count` sums: the innovations of the filter are tested with it.
void lagged_products_for_all(const double* x, ptrdiff_t size, ptrdiff_t first, double* out, ptrdiff_t count) noexcept;
void lagged_products_for_avx2(const double* x, ptrdiff_t size, ptrdiff_t first, double* out, ptrdiff_t count) noexcept;

#endif
