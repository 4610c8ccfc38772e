// SPDX-License-Identifier: BSD-3-Clause
// The strands of a likelihood for one set of machine instructions. For the second set the namespace of the headers goes
// by another name too: two functions of one name that were compiled for different processors would be one for the
// linker, which takes either.
#include "strands_call.hpp"

#ifdef ALLANITE_FOR_AVX2
#define allanite allanite_avx2
#define ALLANITE_STRANDS strands_for_avx2
#else
#define ALLANITE_STRANDS strands_for_all
#endif

#include "allanite/strands.hpp"

namespace {

using allanite::Index;
using allanite::Slice;

template <class T>
Slice<T> slice(T* data, Index size) {
    return {data, size};
}

template <int N>
bool run(const StrandsCall& call) noexcept {
    allanite::StrandRows rows{};
    rows.count = call.rows;
    rows.output_step = call.output_step;
    rows.noise_step = call.noise_step;
    for (Index l = 0; l < allanite::n_lanes; ++l) {
        rows.y[l] = slice(call.y[l], call.rows);
        rows.output[l] = slice(call.output[l], call.output_step > 0 ? call.rows * N : N);
        rows.noise[l] = slice(call.noise[l], call.noise_step > 0 ? call.rows : 1);
    }
    const auto state = allanite::strand_state(N, slice(call.numbers, allanite::strand_numbers(N) * allanite::n_lanes),
                                              slice(call.counters, 2 * allanite::n_lanes));
    const auto scratch = slice(call.scratch, allanite::strand_scratch(N));
    const auto strands = call.square_root ? allanite::strands<N, true> : allanite::strands<N, false>;
    return strands(slice(call.transition, N * N), slice(call.process, N * N), rows, state, scratch);
}

}  // namespace

bool ALLANITE_STRANDS(const StrandsCall& call) noexcept {
    switch (call.states) {
        case 1: return run<1>(call);
        case 2: return run<2>(call);
        case 3: return run<3>(call);
        case 4: return run<4>(call);
        default: return false;
    }
}
