// SPDX-License-Identifier: BSD-3-Clause
// The likelihood of a long record in four strands side by side. One row of a filter is a chain of operations each of
// which waits for the one before; four chains take hardly longer than one.
//
// A strand is a stretch of the record. What the filter would predict for its first row is not known while the strands
// before it are still under way, so a strand begins with a guess a of the states, as if it were certain (P = 0), and
// carries beside the state x the effect A of an error d of that guess (de Jong 1991, "The diffuse Kalman filter",
// Annals of Statistics 19, 1073-1083):
//
//     x = x_a + A d,   v = v_a - E d,   E = h A,   A' = F (A - k E),   A = I at the first row.
//
// It keeps the sums of v v / S, of E v / S and of E E' / S: with them, once the prediction N(m, P) for the first row is
// known, d ~ N(m - a, P), and likelihood and last prediction of the strand follow exactly.
#ifndef ALLANITE_STRANDS_HPP
#define ALLANITE_STRANDS_HPP

#include "few_states.hpp"
#include "lanes.hpp"
#include "likelihood.hpp"

namespace allanite {

/// Number of doubles per lane that four strands of n states carry from block to block, see StrandState.
constexpr Index strand_numbers(Index n) noexcept { return 1 + n + 2 * n * n + (n + 1) * (n + 1); }

constexpr Index strand_scratch(Index n) noexcept { return transition_numbers(n) + factor_prediction_numbers(n); }

/// What the strands carry. Every number stands there four times, once for each lane.
struct StrandState {
    Slice<double> x;         ///< (n) state
    Slice<double> p;         ///< (n * n) its covariance, or the factors of it
    Slice<double> effects;   ///< (n * n) A, column by column
    Slice<double> moments;   ///< ((n + 1) * (n + 1)) upper half of the sums: first v, then E
    Slice<double> mantissa;  ///< (1) of the product of S
    Slice<int64_t> exponent, count;  ///< (1) of the product of S; samples that were there
};

inline StrandState strand_state(Index n, Slice<double> numbers, Slice<int64_t> counters) noexcept {
    Index used = 0;
    const auto take = [&](Index size) noexcept {
        used += size * n_lanes;
        return numbers.part(used - size * n_lanes, size * n_lanes);
    };
    StrandState state{};
    state.x = take(n);
    state.p = take(n * n);
    state.effects = take(n * n);
    state.moments = take((n + 1) * (n + 1));
    state.mantissa = take(1);
    state.exponent = counters.part(0, n_lanes);
    state.count = counters.part(n_lanes, n_lanes);
    return state;
}

/// A block of rows of each strand. H and R of row k begin at k * step; a step of zero is a constant.
struct StrandRows {
    Index count;
    Slice<const double> y[n_lanes];       ///< (count) not finite: missing
    Slice<const double> output[n_lanes];  ///< (count * n) or (n)
    Slice<const double> noise[n_lanes];   ///< (count) or (1)
    Index output_step, noise_step;        ///< n or 0, 1 or 0
};

/// The model with each of its numbers in all lanes.
template <int N>
struct StrandModel {
    Lanes memory[transition_numbers(N) + 5 * N * N + N];
    Transition<Lanes> transition;
    Slice<const Lanes> process;
    FactorPrediction<Lanes> factors;
};

template <int N>
void spread_model(const Transition<double>& f, Slice<const double> process, const FactorPrediction<double>& factors,
                  StrandModel<N>& model) noexcept {
    Index used = 0;
    const auto spread = [&](Slice<const double> numbers) noexcept {
        const Slice<Lanes> all{model.memory, Index(sizeof model.memory / sizeof(Lanes))};
        const auto part = all.part(used, numbers.size);
        for (Index i = 0; i < numbers.size; ++i) part[i] = Lanes(numbers[i]);
        used += numbers.size;
        return fixed(part);
    };
    model.transition = {spread(f.matrix), spread(f.diagonal), spread(f.products), spread(f.dense), f.n_dense};
    model.process = spread(process);
    model.factors = {spread(factors.ratios), spread(factors.process), spread(factors.columns),
                     spread(factors.weights), factors.is_valid};
}

// ---- one row of each strand -----------------------------------------------------------------------------------------

template <int N>
struct StrandRow {
    Lanes h[N], noise, y;
};

inline Lanes gather(const Slice<const double> (&of)[n_lanes], Index i) noexcept {
    return Lanes::of(of[0][i], of[1][i], of[2][i], of[3][i]);
}

/// Makes a missing sample one that teaches nothing and adds nothing to the sums: h = 0, y = 0, R = 1. Counts those.
template <int N>
void blank_missing(StrandRow<N>& row, Slice<int64_t> missing) noexcept {
    const Lanes zero(0.0), none = (row.y - row.y) + (row.noise - row.noise);
    const LaneMask is_there = none == zero;
    for (Index i = 0; i < N; ++i) row.h[i] = choose(is_there, row.h[i], zero);
    row.y = choose(is_there, row.y, zero);
    row.noise = choose(is_there, row.noise, Lanes(1.0));
    for (Index l = 0; l < n_lanes; ++l) missing[l] += bits_of(is_there) >> l & 1u ? 0 : 1;
}

/// Is this a row that filter() may be given, and its noise positive where there is a sample?
template <int N>
bool is_regular(const StrandRow<N>& row) noexcept {
    const Lanes zero(0.0), none = (row.y - row.y) + (row.noise - row.noise);
    Lanes finite = zero;
    for (const Lanes& h : row.h) finite += h - h;
    const unsigned needs_noise = bits_of(none == zero), has_noise = bits_of(row.noise > zero);
    return bool(finite == zero) && bits_of(row.noise < zero) == 0 && (needs_noise & ~has_noise) == 0;
}

/// Row k. False if it is not regular.
template <int N>
bool read_row(const StrandRows& rows, Index k, StrandRow<N>& row, Slice<int64_t> missing) noexcept {
    for (Index i = 0; i < N; ++i) row.h[i] = gather(rows.output, k * rows.output_step + i);
    row.noise = gather(rows.noise, k * rows.noise_step);
    row.y = gather(rows.y, k);
    const Lanes zero(0.0), sum = row.y + row.noise;
    if (row.noise > zero && sum - sum == zero) return true;
    if (!is_regular(row)) return false;
    blank_missing(row, missing);
    return true;
}

/// update_and_predict() with the fewest operations, on the upper half of P.
template <int N>
Measured<Lanes> update_and_predict_lanes(const StrandModel<N>& model, const StrandRow<N>& row, Slice<Lanes> x,
                                         Slice<Lanes> p, Slice<Lanes> gain) noexcept {
    const auto& f = model.transition;
    const Slice<const Lanes> h{row.h, N};
    Lanes m[N];
    for (Index i = 0; i < N; ++i) {
        m[i] = p[i] * h[0];
        for (Index j = 1; j < N; ++j) m[i] += p[i < j ? i * N + j : j * N + i] * h[j];
    }
    const Lanes innovation = row.y - dot<N>(h, x), variance = row.noise + dot<N>(h, Slice<const Lanes>{m, N});
    const Lanes inverse = Lanes(1.0) / variance;
    for (Index i = 0; i < N; ++i) m[i] *= f.diagonal[i];
    for (Index i = 0; i < N; ++i) {
        gain[i] = m[i] * inverse;
        x[i] = f.diagonal[i] * x[i] + gain[i] * innovation;
        for (Index j = 0; j < N; ++j) {
            if (j < i) continue;
            p[i * N + j] = (f.products[i * N + j] * p[i * N + j] + model.process[i * N + j]) - gain[i] * m[j];
        }
    }
    return {Update::ordinary, innovation, variance, inverse};
}

/// Update and prediction of the state. Leaves the gain in `gain`: F k where F is diagonal, else k.
template <int N, bool square_root, bool is_diagonal>
Measured<Lanes> advance(const StrandModel<N>& model, const StrandRow<N>& row, Slice<Lanes> x, Slice<Lanes> p,
                        Slice<Lanes> gain, Slice<Lanes> work) noexcept {
    const auto& f = model.transition;
    const Slice<const Lanes> h{row.h, N};
    Measured<Lanes> measured;
    if constexpr (is_diagonal && square_root) {
        measured = update_and_predict_factors<N>(f, model.factors, h, row.noise, row.y, x, p, gain, work);
        for (Index i = 0; i < N; ++i) gain[i] *= f.diagonal[i];
    } else if constexpr (is_diagonal) {
        measured = update_and_predict_lanes(model, row, x, p, gain);
    } else {
        if constexpr (square_root) {
            measured = update_factors<N>(h, row.noise, row.y, x, p, gain, work);
            predict_factors<N>(f, model.factors, p, work);
        } else {
            measured = update<N>(h, row.noise, row.y, x, p, gain);
            predict_covariance<N>(f, model.process, p, work);
        }
        predict_state<N>(f, x, work);
    }
    return measured;
}

/// The columns of A over one row, and their terms of the sums, one line of a triangle after the other: v v, v E_1 ...;
/// E_1 E_1, E_1 E_2 ...
template <int N, bool is_diagonal>
void advance_effects(const Transition<Lanes>& f, const StrandRow<N>& row, const Measured<Lanes>& measured,
                     Slice<const Lanes> gain, Slice<Lanes> effects, Slice<Lanes> sums, Slice<Lanes> work) noexcept {
    const Slice<const Lanes> h{row.h, N};
    Lanes innovations[N + 1], weighted[N + 1];
    innovations[0] = measured.innovation;
    for (Index c = 0; c < N; ++c) innovations[c + 1] = dot<N>(h, effects.part(c * N, N));
    for (Index c = 0; c <= N; ++c) weighted[c] = innovations[c] * measured.inverse;
    Index next = 0;
    for (Index c = 0; c <= N; ++c) {
        for (Index d = 0; d <= N; ++d) {
            if (d >= c) sums[next++] += weighted[c] * innovations[d];
        }
    }
    for (Index c = 0; c < N; ++c) {
        const auto column = effects.part(c * N, N);
        if constexpr (is_diagonal) {
            for (Index i = 0; i < N; ++i) column[i] = f.diagonal[i] * column[i] - gain[i] * innovations[c + 1];
        } else {
            for (Index i = 0; i < N; ++i) column[i] -= gain[i] * innovations[c + 1];
            predict_state<N>(f, column, work);
        }
    }
}

/// Products of variances, lane by lane.
struct LaneProducts {
    Lanes mantissa;
    Slice<int64_t> exponent;
};

/// Multiplies. False if a factor is no variance.
inline bool multiply_lanes(LaneProducts& products, const Lanes& factor) noexcept {
    constexpr double top = power_of_two<double>(range_digits<double>);
    constexpr double bottom = power_of_two<double>(-range_digits<double>);
    const Lanes product = products.mantissa * factor;
    if (product < Lanes(top) && product > Lanes(bottom)) {
        products.mantissa = product;
        return true;
    }
    double mantissas[n_lanes];
    for (Index l = 0; l < n_lanes; ++l) {
        if (!(factor[l] > 0.0) || !is_finite(factor[l])) return false;
        LogProduct<double> one{products.mantissa[l], products.exponent[l]};
        multiply(one, factor[l]);
        mantissas[l] = one.mantissa;
        products.exponent[l] = one.exponent;
    }
    products.mantissa = Lanes::load(mantissas);
    return true;
}

// ---- a block --------------------------------------------------------------------------------------------------------

inline Lanes lanes_at(Slice<double> numbers, Index i) noexcept {
    return Lanes::load(numbers.part(i * n_lanes, n_lanes).data);
}

inline void put_lanes(Slice<double> numbers, Index i, const Lanes& value) noexcept {
    value.store(numbers.part(i * n_lanes, n_lanes).data);
}

/// Adds the sums of a block to those before it: two levels, as the rounding of a plain sum grows with its length.
template <int N>
void keep_sums(Slice<const Lanes> sums, Slice<double> moments) noexcept {
    Index next = 0;
    for (Index c = 0; c <= N; ++c) {
        for (Index d = c; d <= N; ++d) {
            const Index place = c * (N + 1) + d;
            put_lanes(moments, place, lanes_at(moments, place) + sums[next++]);
        }
    }
}

/// The numbers of a filter in variables of their own, which the compiler keeps in registers as far as they reach.
template <int N, bool is_diagonal>
struct StrandMemory {
    static constexpr Index n_sums = (N + 1) * (N + 2) / 2;
    static constexpr Index n_work = is_diagonal ? 2 * N : orthogonalise_scratch(N, N);
    Lanes x[N], p[N * N], gain[N], effects[N * N], sums[n_sums], work[n_work];
};

template <Index size>
Slice<Lanes> all_of(Lanes (&array)[size]) noexcept {
    return {array, size};
}

template <int N, bool is_diagonal>
void fetch(const StrandState& state, StrandMemory<N, is_diagonal>& m) noexcept {
    for (Index i = 0; i < N; ++i) m.x[i] = lanes_at(state.x, i);
    for (Index i = 0; i < N * N; ++i) {
        m.p[i] = lanes_at(state.p, i);
        m.effects[i] = lanes_at(state.effects, i);
    }
    for (Lanes& sum : m.sums) sum = Lanes(0.0);
}

/// Of a covariance, both halves.
template <int N, bool square_root, bool is_diagonal>
void put_back(const StrandMemory<N, is_diagonal>& m, const StrandState& state) noexcept {
    for (Index i = 0; i < N; ++i) put_lanes(state.x, i, m.x[i]);
    for (Index i = 0; i < N * N; ++i) {
        const Index row = i / N, column = i % N;
        put_lanes(state.p, i, square_root || row <= column ? m.p[i] : m.p[column * N + row]);
        put_lanes(state.effects, i, m.effects[i]);
    }
    keep_sums<N>({m.sums, m.n_sums}, state.moments);
}

/// Rows of the strands. False, and the sums spoilt, where a row is not of the plain kind.
template <int N, bool square_root, bool is_diagonal>
ALLANITE_FLAT bool strand_rows(const StrandModel<N>& model, const StrandRows& rows, const StrandState& state) noexcept {
    StrandMemory<N, is_diagonal> m;
    fetch(state, m);
    int64_t missing[n_lanes] = {};
    LaneProducts products{lanes_at(state.mantissa, 0), state.exponent};
    for (Index k = 0; k < rows.count; ++k) {
        StrandRow<N> row;
        if (!read_row(rows, k, row, {missing, n_lanes})) return false;
        const auto measured = advance<N, square_root, is_diagonal>(model, row, all_of(m.x), all_of(m.p),
                                                                   all_of(m.gain), all_of(m.work));
        if (!multiply_lanes(products, measured.variance)) return false;
        advance_effects<N, is_diagonal>(model.transition, row, measured, fixed(all_of(m.gain)), all_of(m.effects),
                                        all_of(m.sums), all_of(m.work));
    }
    put_back<N, square_root>(m, state);
    put_lanes(state.mantissa, 0, products.mantissa);
    for (Index l = 0; l < n_lanes; ++l) state.count[l] += rows.count - missing[l];
    const Lanes squares = m.sums[0];
    return bool(squares - squares == Lanes(0.0));
}

/// A block of rows of four strands of N states, scalar measurements.
///
/// @param transition, process  (n * n) F and Q
/// @param scratch  (strand_scratch)
/// @return false, and the state spoilt, where Q is not positive semidefinite, R of a sample is not positive, or an
///         innovation has no variance: those rows are for filter()
template <int N, bool square_root>
bool strands(Slice<const double> transition, Slice<const double> process, const StrandRows& rows,
             const StrandState& state, Slice<double> scratch) noexcept {
    const auto f = split_transition(transition, N, scratch.part(0, transition_numbers(N)));
    const auto plan = plan_factors(f, process, scratch.part(transition_numbers(N), factor_prediction_numbers(N)));
    if (!plan.is_valid) return false;
    StrandModel<N> model;
    spread_model(f, process, plan, model);
    const bool is_diagonal = square_root ? plan.ratios.size > 0 : f.n_dense == 0;
    return is_diagonal ? strand_rows<N, square_root, true>(model, rows, state)
                       : strand_rows<N, square_root, false>(model, rows, state);
}

}  // namespace allanite

#endif
