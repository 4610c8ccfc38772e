// SPDX-License-Identifier: BSD-3-Clause
// The Allan family in one pass and fixed memory, on decimated phase.
// Firmware-safe: nothing allocates, throws or prints; the state lives in two flat arrays of the caller.
//
// The phase is decimated by two per level: level k holds each 2^k-th phase point. A lag m is served by the finest
// level at which it spans fewer than 2P steps, P = `positions`:
//     level 0: every m in [1, 2P);        level k: m = q 2^k, q in [P, 2P).
// So each window of a lag is sampled at P or more positions, which costs next to no degrees of freedom (below 0.1 %
// at P = 64), while the work per sample stays bounded: level k sees one step per 2^k samples.
//
// Each level is a short phase record: the past (as long as the longest window), then a block that fills up. A full
// block is summed at every lag of the level, becomes the past, and is re-based so that the phase stays small: no digits
// are lost to an offset or to a long record, in float either. The blocks are the same whatever the chunks that are
// fed, and so are the digits. Sums and counts of separate pieces of a record, or of several records, simply add.
#ifndef ALLANITE_ONLINE_ALLAN_HPP
#define ALLANITE_ONLINE_ALLAN_HPP

#include <stdint.h>

#include "phase.hpp"

namespace allanite {

/// What is accumulated.
struct OnlinePlan {
    Slice<const int64_t> lags;  ///< (L) rising; each fits, see online_lag_fits()
    int order;                  ///< 2: second differences (Allan); 3: third differences (Hadamard)
    Index positions;            ///< P
    Index block;                ///< steps of a level that are summed at a time; even
};

/// Level that serves a lag: the smallest k with lag / 2^k < 2P.
constexpr int online_level(int64_t lag, Index positions) noexcept {
    int level = 0;
    while ((lag >> level) >= 2 * positions) ++level;
    return level;
}

/// Is the lag a whole number of the steps of its level?
constexpr bool online_lag_fits(int64_t lag, Index positions) noexcept {
    return lag >= 1 && ((lag >> online_level(lag, positions)) << online_level(lag, positions)) == lag;
}

/// Number of levels up to that of the longest lag.
constexpr Index online_levels(int64_t longest_lag, Index positions) noexcept {
    return online_level(longest_lag, positions) + 1;
}

/// Phase points that a level keeps of the past: the steps of the longest window.
constexpr Index online_past(int order, Index positions) noexcept { return order * (2 * positions - 1); }

/// Number of Scalars in the state: phase and run length per point of each level, sum and remainder per lag.
constexpr Index online_numbers(Index lags, Index levels, int order, Index positions, Index block) noexcept {
    return 2 * levels * (online_past(order, positions) + block) + 2 * lags;
}

/// Number of integers in the state: filled steps per level, count per lag.
constexpr Index online_counters(Index lags, Index levels) noexcept { return levels + lags; }

/// One level: `past` points, then the block.
template <class Scalar>
struct OnlineLevel {
    Slice<Scalar> phase;
    Slice<Scalar> run;  ///< steps without a missing sample up to this point, at most past + block
};

/// The two arrays of the state, by name. All zeros is the empty state.
template <class Scalar>
struct OnlineState {
    Slice<Scalar> points;     ///< (levels * 2 * (past + block)) the levels
    Slice<Scalar> sums;       ///< (L) sums of squared differences over full blocks
    Slice<Scalar> remainder;  ///< (L) what the sums could not hold (compensated summation)
    Slice<int64_t> filled;    ///< (levels) steps in the block
    Slice<int64_t> counts;    ///< (L) differences in the sums
};

template <class Scalar>
OnlineState<Scalar> online_state(const OnlinePlan& plan, Slice<Scalar> numbers, Slice<int64_t> counters) noexcept {
    const Index lags = plan.lags.size, points = numbers.size - 2 * lags, levels = counters.size - lags;
    return {numbers.part(0, points), numbers.part(points, lags), numbers.part(points + lags, lags),
            counters.part(0, levels), counters.part(levels, lags)};
}

template <class Scalar>
OnlineLevel<Scalar> online_level_points(const OnlinePlan& plan, const OnlineState<Scalar>& state,
                                        Index level) noexcept {
    const Index width = online_past(plan.order, plan.positions) + plan.block;
    return {state.points.part(2 * level * width, width), state.points.part((2 * level + 1) * width, width)};
}

/// Squared differences: their sum and how many there are.
template <class Scalar>
struct Squares {
    Scalar sum;
    Index count;
};

/// Squared differences over `window` steps that end at the points [first_end, first_end + count), where complete.
template <int order, class Scalar>
Squares<Scalar> complete_squares(const OnlineLevel<const Scalar>& level, Index step, Index first_end,
                                 Index count) noexcept {
    const Index window = order * step, last_end = first_end + count - 1;
    if (count > 0 && level.run[last_end] >= Scalar(window + count - 1)) {  // nothing is missing
        return {sum_squares<order>(level.phase, step, first_end - window, count), count};
    }
    Scalar lane[lanes] = {};  // as in sum_squares()
    Index complete = 0;
    for (Index i = 0; i < count; ++i) {
        if (level.run[first_end + i] < Scalar(window)) continue;
        const Scalar d = difference<order>(level.phase, first_end - window + i, step);
        lane[i % lanes] += d * d;
        ++complete;
    }
    return {sum_of_lanes(lane), complete};
}

/// Squared differences of one lag that end in the block of its level.
template <class Scalar>
Squares<Scalar> block_squares(const OnlinePlan& plan, const OnlineState<Scalar>& state, Index level,
                              int64_t lag) noexcept {
    const auto points = online_level_points(plan, state, level);
    const OnlineLevel<const Scalar> fixed{{points.phase.data, points.phase.size}, {points.run.data, points.run.size}};
    const Index past = online_past(plan.order, plan.positions), filled = Index(state.filled[level]);
    const Index step = Index(lag >> level);
    return plan.order == 2 ? complete_squares<2>(fixed, step, past, filled)
                           : complete_squares<3>(fixed, step, past, filled);
}

/// Adds the full block of a level to the sums of its lags, then makes it the past.
template <class Scalar>
void close_block(const OnlinePlan& plan, OnlineState<Scalar>& state, Index level) noexcept {
    const int64_t longest = (int64_t(2 * plan.positions) << level) - 1, longest_below = level > 0 ? longest / 2 : 0;
    for (Index l = 0; l < plan.lags.size && plan.lags[l] <= longest; ++l) {
        if (plan.lags[l] <= longest_below) continue;
        const auto squares = block_squares(plan, state, level, plan.lags[l]);
        const Scalar term = squares.sum + state.remainder[l];
        const volatile Scalar sum = state.sums[l] + term;  // -ffast-math would take the remainder for 0
        state.remainder[l] = term - (sum - state.sums[l]);
        state.sums[l] = sum;
        state.counts[l] += squares.count;
    }
    const auto points = online_level_points(plan, state, level);
    const Scalar base = points.phase[points.phase.size - 1];
    for (Index i = 0; i < points.phase.size - plan.block; ++i) {
        points.phase[i] = points.phase[i + plan.block] - base;
        points.run[i] = points.run[i + plan.block];
    }
    state.filled[level] = 0;
}

/// Length of the run of complete steps at the next point: 0 after a missing one, else one more, up to `most`.
template <class Scalar>
Scalar next_run(Scalar run, bool missing, Index most) noexcept {
    if (missing) return Scalar(0);
    return run < Scalar(most) ? run + Scalar(1) : run;
}

/// Appends samples to the block of level 0, which has room for them.
template <class Scalar>
void append_samples(const OnlinePlan& plan, OnlineState<Scalar>& state, Slice<const Scalar> samples,
                    Scalar offset) noexcept {
    const auto points = online_level_points(plan, state, 0);
    const Index next = online_past(plan.order, plan.positions) + Index(state.filled[0]);
    Scalar phase = points.phase[next - 1], run = points.run[next - 1];
    for (Index i = 0; i < samples.size; ++i) {
        const bool missing = is_missing(samples[i]);
        if (!missing) phase += samples[i] - offset;
        run = next_run(run, missing, points.run.size);
        points.phase[next + i] = phase;
        points.run[next + i] = run;
    }
    state.filled[0] += samples.size;
}

/// Hands every second of the `fresh` last points of a level down to the next level. Returns how many.
template <class Scalar>
Index hand_down(const OnlinePlan& plan, OnlineState<Scalar>& state, Index level, Index fresh) noexcept {
    const auto from = online_level_points(plan, state, level), to = online_level_points(plan, state, level + 1);
    const Index past = online_past(plan.order, plan.positions), filled = Index(state.filled[level]);
    const Index start = past + Index(state.filled[level + 1]);
    Index next = start;
    Scalar phase = to.phase[start - 1], run = to.run[start - 1];
    for (Index i = filled - fresh + (filled - fresh + 1) % 2; i < filled; i += 2, ++next) {  // odd i: even steps
        phase += from.phase[past + i] - from.phase[past + i - 2];
        run = next_run(run, from.run[past + i] < Scalar(2), to.run.size);
        to.phase[next] = phase;
        to.run[next] = run;
    }
    state.filled[level + 1] += next - start;
    return next - start;
}

/// Takes in the next samples of the record: any number of them, with the same digits in the end.
///
/// @param samples  (n) rate samples, missing ones included
/// @param offset   removed from each sample; the same for the whole record
template <class Scalar>
void online_feed(const OnlinePlan& plan, OnlineState<Scalar> state, Slice<const Scalar> samples,
                 Scalar offset) noexcept {
    for (Index fed = 0; fed < samples.size;) {
        const Index room = plan.block - Index(state.filled[0]), left = samples.size - fed;
        Index fresh = room < left ? room : left;
        append_samples(plan, state, samples.part(fed, fresh), offset);
        fed += fresh;
        for (Index level = 0; level < state.filled.size && fresh > 0; ++level) {
            if (level + 1 < state.filled.size) {
                const Index handed = hand_down(plan, state, level, fresh);
                if (state.filled[level] == plan.block) close_block(plan, state, level);
                fresh = handed;
            } else if (state.filled[level] == plan.block) {
                close_block(plan, state, level);
            }
        }
    }
}

/// The sums of squared differences so far and their counts. Changes nothing: one may read at any time and go on.
///
/// @param sums, counts (L) out
template <class Scalar>
void online_read(const OnlinePlan& plan, const OnlineState<Scalar>& state, Slice<Scalar> sums,
                 Slice<int64_t> counts) noexcept {
    for (Index l = 0; l < plan.lags.size; ++l) {
        const auto squares = block_squares(plan, state, online_level(plan.lags[l], plan.positions), plan.lags[l]);
        sums[l] = state.sums[l] + (squares.sum + state.remainder[l]);
        counts[l] = state.counts[l] + squares.count;
    }
}

}  // namespace allanite

#endif
