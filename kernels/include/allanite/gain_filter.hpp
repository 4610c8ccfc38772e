// SPDX-License-Identifier: BSD-3-Clause
// A filter of a constant model over a long record, with its gain from polynomials where no sample is missing
// (gain_segment.hpp) and row by row elsewhere; and noise of the same law, drawn through its innovations.
#ifndef ALLANITE_GAIN_FILTER_HPP
#define ALLANITE_GAIN_FILTER_HPP

#include "gain_segment.hpp"

namespace allanite {

/// The least and the first segment have 8 * 2^5 rows: shorter ones cost more than the rows one by one.
constexpr Index least_level = 5;
/// A segment that is off by less than this part of what is tolerated is followed by one of twice its length.
constexpr double surplus = 1.0 / 1024;
/// What differences of order 3 may change a column by, as a part of it, and be left out.
constexpr double cubic_tolerance = 1e-13;

/// What comes of the rows. Readouts are taken at the rows `first`, `first` + `step`, ...
struct DriftOutput {
    Slice<double> drift, drift_sd;  ///< (rows) after the update of the row
    Slice<double> standardized;     ///< (rows) innovation / sqrt S; NaN where there is none
    Index first, step;
    Slice<double> means, sds;  ///< (instants * g)
};

constexpr Index gain_filter_scratch(Index n, Index g) noexcept {
    return filter_scratch(n, 1) + segment_scratch(n, g) + 3 * n + g;
}

/// A run over the rows of a block. Where noise is drawn, `y` and `made` are one: normal numbers that become samples.
struct GainRun {
    const GainModel& m;
    const RiccatiSteps& steps;
    const Workspace<double>& w;
    GainSegment segment;
    Slice<double> readout;  ///< (g)
    FilterState<double>& state;
    Slice<const double> y;
    Slice<double> made;
    DriftOutput out;
    Index instant;  ///< number of the next readout
};

// ---- row by row -----------------------------------------------------------------------------------------------------

/// A normal number becomes the sample whose innovation it is.
template <bool square_root>
void draw_sample(GainRun& run, Slice<const double> h, Index k) noexcept {
    covariance_with<square_root>(h, run.state, run.w);
    const double variance = run.m.model.noise[0] + dot<any_size>(h, run.w.row);
    run.made[k] = dot<any_size>(h, run.state.x) + allanite::square_root(variance) * run.made[k];
}

template <bool square_root>
void read_out_row(GainRun& run, Index k) noexcept {
    const Index n = run.m.model.states;
    auto& out = run.out;
    out.standardized[k] /= allanite::square_root(out.drift_sd[k]);
    const FilterOutput<double> each{1, run.m.drift, out.drift, out.drift_sd, {nullptr, 0}, {nullptr, 0}};
    read_out<square_root>(n, k, run.state, each, run.w);
    if (k != out.first) return;
    const FilterOutput<double> some{run.m.readouts, run.m.readout, out.means, out.sds, {nullptr, 0}, {nullptr, 0}};
    read_out<square_root>(n, run.instant++, run.state, some, run.w);
    out.first += out.step;
}

/// Rows [k, stop), each with its covariance. The variances of the innovations go through `drift_sd`.
template <int N, bool square_root, bool draws>
void exact_rows(GainRun& run, Index k, Index stop) noexcept {
    const auto& model = run.m.model;
    const Rows<double> rows{stop, run.y, {nullptr, 0}};
    FilterOutput<double> out{};
    if constexpr (!draws) {
        out.innovations = run.out.standardized;
        out.variances = run.out.drift_sd;
    }
    for (; k < stop; ++k) {
        if constexpr (draws) draw_sample<square_root>(run, model.output.part(0, model.states), k);
        measure_row<N, square_root>(model, rows, k, run.state, out, {}, run.w);
        if constexpr (!draws) read_out_row<square_root>(run, k);
        predict_row<N, square_root>(model, rows, k, run.state, run.w);
    }
}

// ---- by segments ----------------------------------------------------------------------------------------------------

/// What a segment needs beside its run, with room for W states: zeros behind those of the model. Loops of a length that
/// the compiler knows fill its vectors.
template <int W>
struct RowMemory {
    static constexpr Index width = W + 6;  ///< the gain and the other columns of a row, an even number
    double columns[4][width];              ///< of a row, and their differences of order 1 to 3 from row to row
    double x[W], after[W];                 ///< the state before and after the update of the row
    double transition[W], ahead[W], drift[W];  ///< the diagonal of F, h F and drift F
};

template <int W>
void copy_row(Slice<const double> row, double (&out)[W]) noexcept {
    for (Index i = 0; i < W; ++i) out[i] = i < row.size ? row[i] : 0.0;
}

template <int W>
void fetch_rows(const GainRun& run, RowMemory<W>& r) noexcept {
    copy_row(fixed(run.state.x), r.x);
    copy_row(run.m.transition.diagonal, r.transition);
    copy_row(run.m.ahead, r.ahead);
    copy_row(run.m.drift_ahead, r.drift);
}

/// Four sums side by side, which do not wait for one another.
template <int W>
double padded_dot(const double (&a)[W], const double (&b)[W]) noexcept {
    double sums[4] = {};
    for (Index i = 0; i < W; i += 4) {
        for (Index l = 0; l < 4; ++l) sums[l] += a[i + l] * b[i + l];
    }
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

/// Columns of `count` rows from `first` on, and their differences: of the cubic through four rows, a quarter of `count`
/// apart, of the polynomial. Returns whether differences of order 3 matter.
template <int W>
bool expand_columns(const GainSegment& segment, Index n, Index interval, Index first, Index count,
                    RowMemory<W>& r) noexcept {
    const double distance = double(count / 4), e = 1.0 / distance;
    for (Index i = 0; i < 4; ++i) {
        const double u = (double(first) + double(i) * distance) / double(interval);
        for (Index c = n; c < W; ++c) r.columns[i][c] = 0.0;
        columns_at(segment, u, 0, {r.columns[i], n});
        columns_at(segment, u, n, {r.columns[i] + W, n_row_columns});
        r.columns[i][W + n_row_columns] = 0.0;
    }
    auto& [f0, f1, f2, f3] = r.columns;
    const double rows = double(count);
    bool is_cubic = false;
    for (Index c = 0; c < RowMemory<W>::width; ++c) {
        const double once = f1[c] - f0[c], twice = (f2[c] - f1[c]) - once;
        const double thrice = ((f3[c] - f2[c]) - (f2[c] - f1[c])) - twice;
        const double cube = thrice * (1.0 / 6) * e * e * e, square = (twice - thrice) * 0.5 * e * e;
        const double line = (once - twice * 0.5 + thrice * (1.0 / 3)) * e;
        f1[c] = line + square + cube;
        f2[c] = 2.0 * square + 6.0 * cube;
        f3[c] = 6.0 * cube;
        is_cubic = is_cubic || magnitude(cube) * rows * rows * rows > cubic_tolerance * magnitude(f0[c]);
    }
    return is_cubic;
}

/// Columns and differences of the next row.
template <int W>
void next_columns(bool is_cubic, RowMemory<W>& r) noexcept {
    auto& [value, first, second, third] = r.columns;
    for (Index c = 0; c < RowMemory<W>::width; ++c) {
        value[c] += first[c];
        first[c] += second[c];
    }
    if (!is_cubic) return;
    for (Index c = 0; c < RowMemory<W>::width; ++c) second[c] += third[c];
}

/// The states whose row of F is not diagonal, from those after the update: all of them, or those that others depend on.
template <int W>
void step_dense(const GainModel& m, bool all, RowMemory<W>& r) noexcept {
    const auto& f = m.transition;
    const Index n = m.model.states;
    const Slice<const double> after{r.after, n};
    for (Index i = 0; i < n; ++i) {
        if (f.dense[i] == 0.0 || !(all || m.feeds[i] != 0.0)) continue;
        r.x[i] = dot<any_size>(f.matrix.part(i * n, n), after);
    }
}

/// Update and prediction of the state; of those that are not diagonal, only as far as others need them.
template <int W, bool keeps_after>
void step_state(const GainModel& m, double innovation, RowMemory<W>& r) noexcept {
    for (Index i = 0; i < W; ++i) {
        const double after = r.x[i] + r.columns[0][i] * innovation;
        if constexpr (keeps_after) r.after[i] = after;
        r.x[i] = r.transition[i] * after;
    }
    if (m.n_feeding > 0) step_dense(m, false, r);
}

/// Readouts of a row, u intervals from the begin of the segment.
inline void read_out_segment(GainRun& run, Slice<const double> after, double u) noexcept {
    const Index n = run.m.model.states, g = run.m.readouts;
    columns_at(run.segment, u, row_columns(n), run.readout);
    for (Index i = 0; i < g; ++i) {
        const Index place = run.instant * g + i;
        run.out.means[place] = dot<any_size>(run.m.readout.part(i * n, n), after);
        run.out.sds[place] = run.readout[i] > 0.0 ? run.readout[i] : 0.0;
    }
    ++run.instant;
    run.out.first += run.out.step;
}

/// Adds v^2 / S of so many innovations.
inline void add_squares(Likelihood<double>& sums, double squares, Index innovations) noexcept {
    const double term = squares + sums.remainder, sum = sums.squares + term;
    sums.remainder = term - (sum - sums.squares);
    sums.squares = sum;
    sums.innovations += innovations;
}

/// Rows [begin, begin + 8 * interval) by the polynomials of their segment.
template <int W, bool draws>
ALLANITE_FLAT void segment_rows(GainRun& run, Index begin, Index interval) noexcept {
    const auto& m = run.m;
    const Index n = m.model.states, count = interval * segment_intervals;
    const Index piece = interval > 2048 ? 256 : interval / 8;
    RowMemory<W> r;
    fetch_rows(run, r);
    const double* const rest = r.columns[0] + W;
    Likelihood<double> likelihood = run.state.likelihood;
    double predicted = dot<any_size>(m.model.output.part(0, n), run.state.x);
    double drift = draws ? 0.0 : dot<any_size>(m.drift, run.state.x);
    for (Index start = 0; start < count; start += piece) {
        const bool is_cubic = expand_columns(run.segment, n, interval, start, piece, r);
        double squares = 0.0;
        for (Index row = start; row < start + piece; ++row) {
            const Index k = begin + row;
            const double deviation = rest[deviation_column];
            const double innovation = draws ? deviation * run.y[k] : run.y[k] - predicted;
            if constexpr (draws) {
                run.made[k] = predicted + innovation;
            } else {
                const double z = innovation * rest[inverse_column];
                run.out.standardized[k] = z;
                run.out.drift[k] = drift + rest[drift_column] * innovation;
                run.out.drift_sd[k] = rest[drift_sd_column];
                squares += z * z;
                multiply(likelihood.variances, deviation * deviation);
            }
            predicted = padded_dot(r.ahead, r.x) + rest[ahead_column] * innovation;
            if (!draws || m.n_feeding > 0 || row + 1 == count) {
                step_state<W, true>(m, innovation, r);
            } else {
                step_state<W, false>(m, innovation, r);
            }
            if constexpr (!draws) {
                drift = padded_dot(r.drift, r.after);
                if (k == run.out.first) read_out_segment(run, {r.after, n}, double(row) / double(interval));
                if (k + 1 == run.out.first) step_dense(m, true, r);
            }
            next_columns(is_cubic, r);
        }
        if constexpr (!draws) add_squares(likelihood, squares, piece);
    }
    step_dense(m, true, r);
    for (Index i = 0; i < n; ++i) run.state.x[i] = r.x[i];
    run.state.likelihood = likelihood;
}

/// Models with more states are filtered row by row.
constexpr Index most_segment_states = 48;

template <bool draws>
auto segment_rows_of_size(Index n) noexcept {
#ifdef ALLANITE_FALLBACK // beside another build for wide vectors: fewer widths, for processors before 2013
    return n <= 8 ? segment_rows<8, draws> : segment_rows<most_segment_states, draws>;
#else
    // Drawing a number takes longer than the states: half as many widths, and a smaller library.
    constexpr Index step = draws ? 8 : 4;
    return n <= step        ? segment_rows<step, draws>
           : n <= 8         ? segment_rows<8, draws>
           : n <= 8 + step  ? segment_rows<8 + step, draws>
           : n <= 16        ? segment_rows<16, draws>
           : n <= 16 + step ? segment_rows<16 + step, draws>
           : n <= 24        ? segment_rows<24, draws>
           : n <= 32        ? segment_rows<32, draws>
                            : segment_rows<most_segment_states, draws>;
#endif
}

// ---- a block --------------------------------------------------------------------------------------------------------

/// First row from k on without a sample.
inline Index next_missing(Slice<const double> y, Index k) noexcept {
    while (k < y.size && is_finite(y[k])) ++k;
    return k;
}

/// Segments from row k on, as many as there are before row `stop`, each as long as its polynomials allow; where they
/// allow none, rows one by one. Returns where it came to.
template <int N, bool draws>
Index follow_gain(GainRun& run, Index k, Index stop) noexcept {
    const Index n = run.m.model.states;
    const auto rows = segment_rows_of_size<draws>(n);
    Index level = least_level, wait = segment_intervals << least_level;
    while (stop - k >= segment_intervals << least_level) {
        while (level > least_level && (segment_intervals << level) > stop - k) --level;
        const double error = plan_segment(run.m, run.steps, level, fixed(run.state.p), run.segment);
        if (error <= 1.0) {
            rows(run, k, Index(1) << level);
            for (Index i = 0; i < n * n; ++i) run.state.p[i] = run.segment.covariance[i];
            k += segment_intervals << level;
            if (error < surplus && level + 1 < run.steps.count) ++level;
        } else if (level > least_level) {
            --level;
        } else {
            const Index last = stop - k < wait ? stop : k + wait;
            exact_rows<N, false, draws>(run, k, last);
            k = last;
            wait *= 2;
        }
    }
    return k;
}

template <int N, bool square_root, bool draws>
void gain_rows(GainRun& run) noexcept {
    const Index count = run.y.size;
    const bool by_segments = run.steps.count > least_level && run.m.model.states <= most_segment_states;
    for (Index k = 0; k < count;) {
        const Index missing = draws ? count : next_missing(run.y, k);
        if constexpr (!square_root) {
            if (by_segments && run.state.directions.rank == 0) k = follow_gain<N, draws>(run, k, missing);
        }
        const bool begins = run.state.directions.rank > 0;
        const Index stop = begins ? k + 1 : missing < count ? missing + 1 : count;
        exact_rows<N, square_root, draws>(run, k, stop);
        k = stop;
    }
}

/// Which states that are not diagonal others depend on; returns their number.
inline Index find_feeding(const Transition<double>& f, Index n, Slice<double> feeds) noexcept {
    Index count = 0;
    for (Index j = 0; j < n; ++j) {
        feeds[j] = 0.0;
        for (Index i = 0; i < n && f.dense[j] != 0.0; ++i) {
            if (f.matrix[i * n + j] != 0.0) feeds[j] = 1.0;
        }
        count += feeds[j] != 0.0 ? 1 : 0;
    }
    return count;
}

/// The rows of a block, by number of states, form and direction.
using GainRows = void (*)(GainRun&) noexcept;

template <int N, bool draws>
GainRows gain_rows_of(bool square_root) noexcept {
    return square_root ? gain_rows<N, true, draws> : gain_rows<N, false, draws>;
}

/// Filters a block; or draws its samples, if `rows` are of that kind. `state` as in filter(). No steps: row by row
/// throughout.
///
/// @param rows     gain_rows_of the same form
/// @param y        (rows) not finite: missing
/// @param made     empty; if drawn, the same memory as y: normal numbers that become samples
/// @param drift    (n) the readout of each row; empty if drawn, as is `out`
/// @param readout  (g * n) the readouts of some rows
/// @param scratch  (gain_filter_scratch)
/// @return false, and nothing done, if the square-root form is asked for and Q is not positive semidefinite
inline bool gain_filter(GainRows rows, const Model<double>& model, bool square_root, const RiccatiSteps& steps,
                        Slice<const double> y, Slice<double> made, Slice<const double> drift,
                        Slice<const double> readout, FilterState<double>& state, const DriftOutput& out,
                        Slice<double> scratch) noexcept {
    const Index n = model.states, g = n > 0 ? readout.size / n : 0;
    Index used = 0;
    const auto take = [&](Index size) noexcept {
        used += size;
        return scratch.part(used - size, size);
    };
    const auto w = filter_workspace(model, square_root, take(filter_scratch(n, 1)));
    if (!w.factors.is_valid) return false;
    const auto ahead = take(n), drift_ahead = take(n), feeds = take(n);
    for (Index j = 0; j < n; ++j) {
        const auto from = [&](Slice<const double> row) noexcept {
            double sum = 0.0;
            for (Index i = 0; i < row.size; ++i) sum += row[i] * model.transition[i * n + j];
            return sum;
        };
        ahead[j] = from(model.output);
        drift_ahead[j] = from(drift);
    }
    const Index n_feeding = find_feeding(w.transition, n, feeds);
    const GainModel m{model,     w.transition, fixed(ahead), fixed(drift_ahead), fixed(feeds),
                      n_feeding, drift,        readout,      g};
    GainRun run{m,     steps,   w,   gain_segment(n, g, take(segment_scratch(n, g))), take(g),
                state, y,       made, out, 0};
    rows(run);
    return true;
}

}  // namespace allanite

#endif
