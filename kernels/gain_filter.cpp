// SPDX-License-Identifier: BSD-3-Clause
// The filter that takes its gain from polynomials, for one set of machine instructions; see strands.cpp.
#include "gain_filter_call.hpp"

#ifdef ALLANITE_FOR_AVX2
#define allanite allanite_avx2
#define ALLANITE_GAIN_FILTER gain_filter_for_avx2
#define ALLANITE_LAGGED_PRODUCTS lagged_products_for_avx2
#else
#define ALLANITE_GAIN_FILTER gain_filter_for_all
#define ALLANITE_LAGGED_PRODUCTS lagged_products_for_all
#endif

#include "allanite/gain_filter.hpp"
#include "allanite/lagged.hpp"
#include "carried.hpp"

namespace {

using allanite::Index;
using allanite::Slice;

template <bool draws>
allanite::GainRows of_size(Index n, bool square_root) noexcept {
    switch (n) {
#ifndef ALLANITE_FALLBACK  // processors without AVX2 make do with one size for all: the wheel is to be small
        case 1: return allanite::gain_rows_of<1, draws>(square_root);
        case 2: return allanite::gain_rows_of<2, draws>(square_root);
        case 3: return allanite::gain_rows_of<3, draws>(square_root);
        case 4: return allanite::gain_rows_of<4, draws>(square_root);
#endif
        default: return allanite::gain_rows_of<allanite::any_size, draws>(square_root);
    }
}

}  // namespace

bool ALLANITE_GAIN_FILTER(const GainFilterCall& c) noexcept {
    const Index n = c.states, size = n * n, g = c.readouts, made = c.draws ? c.rows : 0, filtered = c.rows - made;
    const Index some = c.instants * g, drift = c.draws ? 0 : n;
    const allanite::Model<double> model{
        n, 1, {c.transition, size}, {c.process, size}, {c.output, n}, {&c.noise, 1}, 0, 0};
    const allanite::RiccatiSteps steps{c.steps, {c.a, c.steps * size}, {c.g, c.steps * size}, {c.h, c.steps * size}};
    const allanite::DriftOutput out{{c.drift_mean, filtered}, {c.drift_sd, filtered}, {c.standardized, filtered},
                                    c.first, c.step, {c.means, some}, {c.sds, some}};
    allanite::FilterState<double> state{{c.state, n}, {c.covariance, size}, {{c.directions, size}, Index(c.counts[2])},
                                        allanite::likelihood_in(c.sums, c.counts)};
    const auto rows = c.draws ? of_size<true>(n, c.square_root) : of_size<false>(n, c.square_root);
    const bool done = allanite::gain_filter(rows, model, c.square_root, steps, {c.y, c.rows}, {c.made, made},
                                            {c.drift, drift}, {c.readout, g * n}, state, out,
                                            {c.scratch, allanite::gain_filter_scratch(n, g)});
    allanite::keep(state.likelihood, state.directions.rank, c.sums, c.counts);
    return done;
}

void ALLANITE_LAGGED_PRODUCTS(const double* x, ptrdiff_t size, ptrdiff_t first, double* out, ptrdiff_t count) noexcept {
    allanite::lagged_products({x, size}, first, {out, count});
}

#ifndef ALLANITE_FOR_AVX2
ptrdiff_t gain_filter_scratch_of(ptrdiff_t states, ptrdiff_t readouts) noexcept {
    return allanite::gain_filter_scratch(states, readouts);
}
#endif
