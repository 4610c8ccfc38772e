// SPDX-License-Identifier: BSD-3-Clause
// The door to kernels/strands.cpp, which is compiled once for every processor and, on x86-64, once more for those with
// wide vectors. Nothing of the headers is in it: they are compiled twice as well, each time under another name.
#ifndef ALLANITE_STRANDS_CALL_HPP
#define ALLANITE_STRANDS_CALL_HPP

#include <stddef.h>
#include <stdint.h>

/// What allanite::strands() is given. Pointers of length: transition, process n * n; y rows; output rows * n or
/// n; noise rows or 1; numbers 4 * strand_numbers(n); counters 8; scratch strand_scratch(n).
struct StrandsCall {
    ptrdiff_t states, rows, output_step, noise_step;
    bool square_root;
    const double *transition, *process;
    const double *y[4], *output[4], *noise[4];
    double* numbers;
    int64_t* counters;
    double* scratch;
};

constexpr ptrdiff_t strands_most_states = 4;

bool strands_for_all(const StrandsCall& call) noexcept;
bool strands_for_avx2(const StrandsCall& call) noexcept;  // if ALLANITE_WITH_AVX2

#endif
