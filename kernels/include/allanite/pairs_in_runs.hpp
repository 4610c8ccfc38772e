// SPDX-License-Identifier: BSD-3-Clause
// Pairs of windows of a record with gaps: n(k), how many positions i of one set of runs have i + k in another.
// The variance of an Allan curve weights every distance k with it, and k runs over hundreds of nodes for each two lags.
#ifndef ALLANITE_PAIRS_IN_RUNS_HPP
#define ALLANITE_PAIRS_IN_RUNS_HPP

#include "slice.hpp"

namespace allanite {

/// How many positions of some runs lie before a place, which need not be whole: linear inside of a run.
///
/// The record is cut into as many equal cells as there are runs; each cell knows the last run that begins at or before
/// it, so that a search has few runs to look at.
struct RunPositions {
    Slice<const int64_t> runs;  // begin and end of each, rising
    Slice<double> before;       // positions before each run
    Slice<int64_t> nearest;     // one more than cells
    double begin, per_unit;

    RunPositions(Slice<const int64_t> of, Slice<double> counts, Slice<int64_t> cells) noexcept
        : runs(of), before(counts), nearest(cells), begin(double(of[0])), per_unit(0.0) {
        const Index n = runs.size / 2;
        double total = 0.0;
        for (Index j = 0; j < n; ++j) {
            before[j] = total;
            total += double(runs[2 * j + 1] - runs[2 * j]);
        }
        per_unit = double(n) / (double(runs[2 * n - 1]) - begin);
        for (Index cell = 0, j = 0; cell <= n; ++cell) {
            while (j + 1 < n && double(runs[2 * (j + 1)]) <= begin + double(cell) / per_unit) ++j;
            nearest[cell] = j;
        }
    }

    /// The last run that begins at or before a place; the first one where none does.
    Index run_of(double place) const noexcept {
        if (place <= begin) return 0;
        const Index n = before.size, cell = Index((place - begin) * per_unit);
        Index low = cell >= n ? n - 1 : nearest[cell], high = cell >= n ? n - 1 : nearest[cell + 1];
        if (low > 0 && double(runs[2 * low]) > place) --low;  // the edge of a cell is rounded
        if (high + 1 < n && double(runs[2 * (high + 1)]) <= place) ++high;
        while (low < high) {
            const Index middle = (low + high + 1) / 2;
            if (double(runs[2 * middle]) <= place) {
                low = middle;
            } else {
                high = middle - 1;
            }
        }
        return low;
    }

    /// Positions before a place in or behind a run, and before the next.
    double in_run(Index run, double place) const noexcept {
        const double inside = place - double(runs[2 * run]), length = double(runs[2 * run + 1] - runs[2 * run]);
        const double part = inside < length ? inside : length;
        return before[run] + (part > 0.0 ? part : 0.0);
    }

    double operator()(double place) const noexcept { return in_run(run_of(place), place); }
};

/// The same for places that rise: the run is sought from the last one on.
struct RisingPositions {
    const RunPositions& positions;
    Index run;

    double operator()(double place) noexcept {
        const auto& runs = positions.runs;
        const Index last = positions.before.size - 1;
        while (run < last && double(runs[2 * (run + 1)]) <= place) ++run;
        return positions.in_run(run, place);
    }
};

/// n(k) at every distance k, which need not be whole.
inline void pairs_in_runs(Slice<const int64_t> first, const RunPositions& second, Slice<const double> distance,
                          Slice<double> out) noexcept {
    const bool dense = second.before.size > 4 * first.size;  // most runs lie between two places
    for (Index node = 0; node < distance.size; ++node) {
        const double k = distance[node];
        double sum = 0.0;
        if (dense) {
            for (Index i = 0; i + 1 < first.size; i += 2) {
                sum += second(double(first[i + 1]) + k) - second(double(first[i]) + k);
            }
        } else if (first.size > 0) {
            RisingPositions rising{second, second.run_of(double(first[0]) + k)};
            for (Index i = 0; i + 1 < first.size; i += 2) {
                const double begin = rising(double(first[i]) + k);
                sum += rising(double(first[i + 1]) + k) - begin;
            }
        }
        out[node] = sum;
    }
}

}  // namespace allanite

#endif
