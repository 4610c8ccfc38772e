// SPDX-License-Identifier: BSD-3-Clause
// Variances of a phase span: Allan, Hadamard, modified, total. The exact overlapping sums, in the caller's memory.
//
// Conventions: n rate samples y_k in, phase in sample units, n + 1 points: x_0 = 0, x_k = sum_{i<k} (y_i - offset).
// A missing sample adds nothing to the phase. The phase is therefore always finite; which differences may be used is
// said apart, as runs of starts whose whole window is present. With M starts,
//     AVAR(m)  = sum of (second difference at spacing m)^2 / (2 m^2 M),           window 2m samples, M = n - 2m + 1
//     HVAR(m)  = sum of (third difference at spacing m)^2 / (6 m^2 M),            window 3m samples, M = n - 3m + 1
//     MVAR(m)  = sum of (mean of m adjacent second differences)^2 / (2 m^2 M),    3m - 1 samples,    M = n - 3m + 2
//     TOTVAR(m) = sum over the centres 1..n-1 of the reflected phase / (2 m^2 M),                    M = n - 1
// (Riley, Handbook of Frequency Stability Analysis, NIST SP 1065, sections 5.2.4, 5.2.5, 5.2.10, 5.2.11.)
#ifndef ALLANITE_ALLAN_HPP
#define ALLANITE_ALLAN_HPP

#include <stdint.h>

#include "phase.hpp"

namespace allanite {

/// Phase of one block of rate samples: out[i] = start + sum_{k<=i} (block[k] - offset). Returns the last value.
/// One addition per sample in order: cutting the record into other blocks gives the same digits.
///
/// @param block  (n) rate samples        @param offset  removed from each sample, so that no digits are lost
/// @param start  phase before the block  @param out     (n) phase after each sample
inline double integrate(Slice<const double> block, double offset, double start, Slice<double> out) noexcept {
    double phase = start;
    for (Index i = 0; i < block.size; ++i) {
        if (!is_missing(block[i])) phase += block[i] - offset;
        out[i] = phase;
    }
    return phase;
}

/// Half-open runs [first, last) of missing samples. Writes at most `runs.size / 2` of them and returns how many
/// there are: call once with an empty slice to count, then again.
///
/// @param block (n) rate samples   @param start index of block[0] in the record   @param runs (k * 2) out
inline Index missing_runs(Slice<const double> block, int64_t start, Slice<int64_t> runs) noexcept {
    Index found = 0;
    for (Index i = 0; i < block.size;) {
        if (!is_missing(block[i])) {
            ++i;
            continue;
        }
        const Index first = i;
        while (i < block.size && is_missing(block[i])) ++i;
        if (2 * found + 1 < runs.size) {
            runs[2 * found] = start + first;
            runs[2 * found + 1] = start + i;
        }
        ++found;
    }
    return found;
}

/// Index of the first run, in a sorted list of half-open runs (k * 2), that ends after `start`.
inline Index first_run_after(Slice<const int64_t> runs, Index start) noexcept {
    Index low = 0, high = runs.size / 2;
    while (low < high) {
        const Index middle = low + (high - low) / 2;
        if (runs[2 * middle + 1] <= start) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

/// Sum of squared differences of one lag over the starts of `runs` that lie in [first, last).
template <int order>
double sum_squares_of_runs(Slice<const double> phase, Index lag, Slice<const int64_t> runs, Index first,
                           Index last) noexcept {
    double sum = 0.0;
    for (Index r = first_run_after(runs, first); r < runs.size / 2 && runs[2 * r] < last; ++r) {
        const Index begin = runs[2 * r] > first ? Index(runs[2 * r]) : first;
        const Index end = runs[2 * r + 1] < last ? Index(runs[2 * r + 1]) : last;
        sum += sum_squares<order>(phase, lag, begin, end - begin);
    }
    return sum;
}

/// Sums of squared differences at several lags, block of starts by block of starts.
///
/// All lags are taken over one block before the next, so that it stays in cache: 1.4 times faster than one lag after
/// another. A sum depends on its block and lag alone; who adds the blocks in order gets the same digits from any
/// number of threads.
///
/// @tparam order       2: second differences (Allan); 3: third differences (Hadamard)
/// @param phase        (n + 1)
/// @param lags         (L) spacings in samples
/// @param runs         (R * 2) half-open, sorted runs of starts whose window is complete, lag after lag
/// @param run_offsets  (L + 1) the runs of lag l are run_offsets[l] to run_offsets[l + 1]
/// @param first_block  block b holds the starts [b block, (b + 1) block)
/// @param sums         (blocks * L) out, for the blocks from first_block on
template <int order>
void difference_squares(Slice<const double> phase, Slice<const int64_t> lags, Slice<const int64_t> runs,
                        Slice<const int64_t> run_offsets, Index first_block, Index block, Slice<double> sums) noexcept {
    for (Index b = 0; b < sums.size / lags.size; ++b) {
        const Index first = (first_block + b) * block;
        for (Index l = 0; l < lags.size; ++l) {
            const auto own = runs.part(2 * run_offsets[l], 2 * (run_offsets[l + 1] - run_offsets[l]));
            sums[b * lags.size + l] = sum_squares_of_runs<order>(phase, lags[l], own, first, first + block);
        }
    }
}

/// Sum over `lag` adjacent second differences from `start` on: what the modified variance averages.
inline double adjacent_second_differences(Slice<const double> phase, Index lag, Index start) noexcept {
    double sum = 0.0;
    for (Index i = start; i < start + lag; ++i) sum += difference<2>(phase, i, lag);
    return sum;
}

/// Modified Allan variance: sum over the starts of `runs` of (mean of m adjacent second differences)^2.
/// The window of a start holds 3m - 1 samples, phase[start] to phase[start + 3m - 1].
///
/// The sum of m terms slides along the record (one third difference per step) and is begun anew every
/// max(4096, m) starts, so that rounding cannot pile up and the cost stays linear in the record.
///
/// @param phase (n + 1)   @param runs (R * 2) half-open, sorted runs of complete starts
inline double modified_squares(Slice<const double> phase, Index lag, Slice<const int64_t> runs) noexcept {
    const Index stretch = lag > 4096 ? lag : 4096;
    double total = 0.0;
    for (Index r = 0; r < runs.size / 2; ++r) {
        for (Index begin = runs[2 * r]; begin < runs[2 * r + 1]; begin += stretch) {
            const Index end = begin + stretch < runs[2 * r + 1] ? begin + stretch : Index(runs[2 * r + 1]);
            double window = adjacent_second_differences(phase, lag, begin), squares = window * window;
            for (Index i = begin; i + 1 < end; ++i) {
                window += difference<3>(phase, i, lag);
                squares += window * window;
            }
            total += squares;
        }
    }
    return total / (double(lag) * double(lag));
}

/// Phase at index i, continued beyond both ends by reflection about the end point (SP 1065, 5.2.11).
inline double reflected(Slice<const double> phase, Index i) noexcept {
    const Index last = phase.size - 1;
    if (i < 0) return 2.0 * phase[0] - phase[-i];
    if (i > last) return 2.0 * phase[last] - phase[2 * last - i];
    return phase[i];
}

/// Total Allan variance: sum over the centres 1..n-1 of the squared second difference of the reflected phase.
/// The record has no gaps. 1 <= lag <= n.
///
/// @param phase (n + 1)
inline double total_squares(Slice<const double> phase, Index lag) noexcept {
    constexpr Index stretch = 4096;  // partial sums keep the rounding error small
    const Index last = phase.size - 1;
    double total = 0.0;
    for (Index begin = 1; begin < last; begin += stretch) {
        const Index end = begin + stretch < last ? begin + stretch : last;
        double squares = 0.0;
        for (Index i = begin; i < end; ++i) {
            const double d = (reflected(phase, i + lag) - phase[i]) - (phase[i] - reflected(phase, i - lag));
            squares += d * d;
        }
        total += squares;
    }
    return total;
}

}  // namespace allanite

#endif
