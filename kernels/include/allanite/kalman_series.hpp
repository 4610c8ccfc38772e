// SPDX-License-Identifier: BSD-3-Clause
// The filter over a block of rows: missing samples, vector measurements, diffuse start, likelihood, readouts.
// What it carries from row to row is all in FilterState: a record that is cut into blocks gives the same digits.
#ifndef ALLANITE_KALMAN_SERIES_HPP
#define ALLANITE_KALMAN_SERIES_HPP

#include "few_states.hpp"
#include "likelihood.hpp"

namespace allanite {

/// s' = F s + u + w,  y = H s + v. H and R of row k begin at k * step; a step of zero is a constant.
template <class Scalar>
struct Model {
    Index states, components;          ///< n, p: the components of a measurement
    Slice<const Scalar> transition;    ///< (n * n) F
    Slice<const Scalar> process;       ///< (n * n) Q
    Slice<const Scalar> output;        ///< (p * n) H, or one for each row
    Slice<const Scalar> noise;         ///< (p * p) R, or one for each row
    Index output_step, noise_step;     ///< p * n or 0, p * p or 0
};

/// A block of measurements.
template <class Scalar>
struct Rows {
    Index count;
    Slice<const Scalar> y;      ///< (count * p) not finite: missing
    Slice<const Scalar> drive;  ///< (count * n) u, or empty
};

/// What is carried: the prediction for the next row.
template <class Scalar>
struct FilterState {
    Slice<Scalar> x;                ///< (n)
    Slice<Scalar> p;                ///< (n * n) covariance, or its factors in the square-root form
    Directions<Scalar> directions;  ///< what is still diffuse
    Likelihood<Scalar> likelihood;
};

/// Where results go; an empty slice is not wanted.
template <class Scalar>
struct FilterOutput {
    Index readouts;               ///< g
    Slice<const Scalar> readout;  ///< (g * n)
    Slice<Scalar> means, sds;     ///< (rows * g) readout of the state after the update of the row
    Slice<Scalar> innovations;    ///< (rows * p) v; NaN where there is none
    Slice<Scalar> variances;      ///< (rows * p) S; infinite in a diffuse update, NaN where nothing was learnt
};

/// What the smoother needs of the forward run; empty for a filter.
template <class Scalar>
struct Trace {
    Slice<Scalar> x, p;              ///< (rows * n), (rows * n * n) after the update of the row
    Slice<Scalar> directions;        ///< (rows * n * n)
    Slice<Scalar> ranks;             ///< (rows)
    Slice<Scalar> outputs, gains;    ///< (rows * p * n) h and P h' / S of each scalar update
    Slice<Scalar> diffuse_gains;     ///< (rows * p * n) b of each diffuse update
    Slice<Scalar> kinds;             ///< (rows * p) 0: none, 1: ordinary, 2: diffuse
    Slice<Scalar> innovations, variances;  ///< (rows * p) v and S
};

/// Memory of the filter, cut into its parts.
template <class Scalar>
struct Workspace {
    Transition<Scalar> transition;
    FactorPrediction<Scalar> factors;
    Slice<Scalar> gain, row, matrix;            ///< (n), (n), and what predict and update need
    Slice<Scalar> outputs, noise, measurement;  ///< (p * n), (p * p), (p) of one row, decorrelated
};

constexpr Index filter_scratch(Index n, Index p) noexcept {
    return transition_numbers(n) + factor_prediction_numbers(n) + 2 * n + orthogonalise_scratch(n, n + 1) + p * n +
           p * p + p;
}

template <class Scalar>
Workspace<Scalar> filter_workspace(const Model<Scalar>& model, bool square_root, Slice<Scalar> scratch) noexcept {
    const Index n = model.states, p = model.components;
    Index used = 0;
    const auto take = [&](Index size) noexcept {
        used += size;
        return scratch.part(used - size, size);
    };
    Workspace<Scalar> w;
    w.transition = split_transition(model.transition, n, take(transition_numbers(n)));
    w.factors.is_valid = true;
    if (square_root) w.factors = plan_factors(w.transition, model.process, take(factor_prediction_numbers(n)));
    w.gain = take(n);
    w.row = take(n);
    w.matrix = take(orthogonalise_scratch(n, n + 1));
    w.outputs = take(p * n);
    w.noise = take(p * p);
    w.measurement = take(p);
    return w;
}

// ---- one scalar measurement -----------------------------------------------------------------------------------------

/// w.row = P h'.
template <bool square_root, class Scalar>
void covariance_with(Slice<const Scalar> h, const FilterState<Scalar>& state, const Workspace<Scalar>& w) noexcept {
    if constexpr (square_root) {
        product_of_factors(fixed(state.p), h, w.row);
    } else {
        symmetric_product<any_size>(state.p, h, w.row);
    }
}

/// Update that takes a diffuse direction away. Leaves b in w.gain and P h' in w.row.
template <bool square_root, class Scalar>
Measured<Scalar> update_diffuse(Slice<const Scalar> h, Pivot<Scalar> pivot, Scalar noise, Scalar y,
                                FilterState<Scalar>& state, const Workspace<Scalar>& w) noexcept {
    const Scalar innovation = y - dot<any_size>(h, state.x);
    if (!is_sound(innovation, noise, magnitude(pivot.seen))) return nothing_learnt<Scalar>();
    covariance_with<square_root>(h, state, w);
    const Scalar variance = noise + dot<any_size>(h, w.row);
    take_direction(h, pivot, state.directions, w.gain);
    if constexpr (square_root) {
        update_factors_diffuse(h, fixed(w.gain), noise, state.p, w.matrix);
    } else {
        update_covariance_diffuse(fixed(w.gain), fixed(w.row), variance, state.p);
    }
    for (Index i = 0; i < h.size; ++i) state.x[i] += w.gain[i] * innovation;
    for (int i = 0; i < 2; ++i) multiply(state.likelihood.diffuse_variances, magnitude(pivot.seen));
    const Scalar inverse = variance > Scalar(0) ? Scalar(1) / variance : Scalar(0);
    return {Update::diffuse, innovation, variance, inverse};
}

/// One scalar measurement of any kind that is not missing. Leaves the gain in the workspace.
template <int N, bool square_root, class Scalar>
Measured<Scalar> measure(Slice<const Scalar> h, Scalar noise, Scalar y, FilterState<Scalar>& state,
                         const Workspace<Scalar>& w) noexcept {
    if (state.directions.rank > 0) {
        const auto pivot = find_pivot(h, state.directions);
        if (pivot.seen != Scalar(0)) return update_diffuse<square_root>(h, pivot, noise, y, state, w);
    }
    if constexpr (square_root) {
        return update_factors<N>(h, noise, y, state.x, state.p, w.gain, w.matrix);
    } else {
        return update<N>(h, noise, y, state.x, state.p, w.gain);
    }
}

template <class Scalar>
void count_update(Likelihood<Scalar>& sums, const Measured<Scalar>& measured) noexcept {
    if (measured.kind == Update::ordinary) {
        add_innovation(sums, measured);
    } else {
        ++(measured.kind == Update::diffuse ? sums.diffuse_updates : sums.skipped);
    }
}

// ---- one row --------------------------------------------------------------------------------------------------------

/// L of R = L D L' turns q correlated measurements into uncorrelated ones, in place: y = L^-1 y, H = L^-1 H, R = D.
template <class Scalar>
void decorrelate(Slice<Scalar> noise, Slice<Scalar> outputs, Slice<Scalar> y, Index q, Index n) noexcept {
    for (Index j = 0; j < q; ++j) {
        const Scalar pivot = noise[j * q + j];
        for (Index i = j + 1; i < q; ++i) {
            const Scalar coupling = noise[i * q + j];
            if (coupling == Scalar(0) || pivot == Scalar(0)) continue;
            const Scalar share = coupling / pivot;
            for (Index k = j + 1; k < q; ++k) noise[i * q + k] -= share * noise[j * q + k];
            y[i] -= share * y[j];
            for (Index k = 0; k < n; ++k) outputs[i * n + k] -= share * outputs[j * n + k];
        }
    }
}

/// Copies what is present of a row into the workspace, decorrelated. Returns how many components that is.
template <class Scalar>
Index gather_row(const Model<Scalar>& model, Slice<const Scalar> outputs, Slice<const Scalar> noise,
                 Slice<const Scalar> y, const Workspace<Scalar>& w) noexcept {
    const Index n = model.states, p = model.components;
    const auto is_present = [&](Index i) noexcept { return is_finite(y[i]) && is_finite(noise[i * p + i]); };
    Index q = 0, elements = 0;
    for (Index i = 0; i < p; ++i) {
        if (!is_present(i)) continue;
        w.measurement[q] = y[i];
        for (Index k = 0; k < n; ++k) w.outputs[q * n + k] = outputs[i * n + k];
        for (Index j = 0; j < p; ++j) {
            if (is_present(j)) w.noise[elements++] = noise[i * p + j];
        }
        ++q;
    }
    decorrelate(w.noise, w.outputs, w.measurement, q, n);
    return q;
}

/// Innovation and variance as they are reported.
template <class Scalar>
void report(const FilterOutput<Scalar>& out, Index k, const Measured<Scalar>& measured) noexcept {
    const bool is_ordinary = measured.kind == Update::ordinary, is_diffuse = measured.kind == Update::diffuse;
    if (out.innovations.size > 0) {
        out.innovations[k] = is_ordinary ? measured.innovation : not_a_number<Scalar>();
    }
    if (out.variances.size > 0) out.variances[k] = is_diffuse ? infinity<Scalar>() : measured.variance;
}

template <class Scalar>
void keep_update(const Trace<Scalar>& trace, Index k, Slice<const Scalar> h, const Measured<Scalar>& measured,
                 const Workspace<Scalar>& w) noexcept {
    const Index n = h.size;
    const bool is_none = measured.kind == Update::none, is_diffuse = measured.kind == Update::diffuse;
    trace.kinds[k] = Scalar(is_none ? 0 : is_diffuse ? 2 : 1);
    trace.innovations[k] = is_none ? Scalar(0) : measured.innovation;
    trace.variances[k] = is_none ? Scalar(0) : measured.variance;
    for (Index i = 0; i < n; ++i) {
        trace.outputs[k * n + i] = h[i];
        trace.gains[k * n + i] = is_none ? Scalar(0) : is_diffuse ? w.row[i] * measured.inverse : w.gain[i];
        if (is_diffuse) trace.diffuse_gains[k * n + i] = w.gain[i];
    }
}

/// All measurements of row k.
template <int N, bool square_root, class Scalar>
void measure_row(const Model<Scalar>& model, const Rows<Scalar>& rows, Index k, FilterState<Scalar>& state,
                 const FilterOutput<Scalar>& out, const Trace<Scalar>& trace, const Workspace<Scalar>& w) noexcept {
    const Index n = extent<N>(model.states), p = model.components;
    const auto outputs = model.output.part(k * model.output_step, p * n);
    const auto noise = model.noise.part(k * model.noise_step, p * p), y = rows.y.part(k * p, p);
    const Index q = p == 1 ? 1 : gather_row(model, outputs, noise, y, w);
    for (Index i = 0, next = 0; i < p; ++i) {
        auto measured = nothing_learnt<Scalar>();
        auto h = outputs.part(i * n, n);
        if (is_finite(y[i]) && is_finite(noise[i * p + i])) {
            if (p > 1) h = fixed(w.outputs.part(next * n, n));
            measured = measure<N, square_root>(h, p == 1 ? noise[0] : w.noise[next * q + next],
                                               p == 1 ? y[0] : w.measurement[next], state, w);
            count_update(state.likelihood, measured);
            ++next;
        }
        report(out, k * p + i, measured);
        if (trace.kinds.size > 0) keep_update(trace, k * p + i, h, measured, w);
    }
}

/// Readouts of row k, after its update.
template <bool square_root, class Scalar>
void read_out(Index n, Index k, const FilterState<Scalar>& state, const FilterOutput<Scalar>& out,
              const Workspace<Scalar>& w) noexcept {
    for (Index g = 0; g < out.readouts; ++g) {
        const auto row = out.readout.part(g * n, n);
        const bool is_known = state.directions.rank == 0 || !sees_diffuse(row, state.directions);
        if (out.means.size > 0) {
            out.means[k * out.readouts + g] = is_known ? dot<any_size>(row, state.x) : not_a_number<Scalar>();
        }
        if (out.sds.size == 0) continue;
        covariance_with<square_root>(row, state, w);
        const Scalar variance = is_known ? dot<any_size>(row, w.row) : infinity<Scalar>();
        out.sds[k * out.readouts + g] = allanite::square_root(variance > Scalar(0) ? variance : Scalar(0));
    }
}

template <class Scalar>
void keep_row(const Trace<Scalar>& trace, bool is_factored, Index k, const FilterState<Scalar>& state) noexcept {
    const Index n = state.x.size;
    for (Index i = 0; i < n; ++i) trace.x[k * n + i] = state.x[i];
    const auto p = trace.p.part(k * n * n, n * n);
    for (Index i = 0; i < n * n; ++i) p[i] = state.p[i];
    if (is_factored) compose(p, n);
    trace.ranks[k] = Scalar(state.directions.rank);
    for (Index i = 0; i < state.directions.rank * n; ++i) {
        trace.directions[k * n * n + i] = state.directions.rows[i];
    }
}

/// The state, its covariance and its diffuse directions at the next row.
template <int N, bool square_root, class Scalar>
void predict_row(const Model<Scalar>& model, const Rows<Scalar>& rows, Index k, FilterState<Scalar>& state,
                 const Workspace<Scalar>& w) noexcept {
    const Index n = extent<N>(model.states);
    predict_state<N>(w.transition, state.x, w.row);
    for (Index i = 0; rows.drive.size > 0 && i < n; ++i) state.x[i] += rows.drive[k * n + i];
    if constexpr (square_root) {
        predict_factors<N>(w.transition, w.factors, state.p, w.matrix);
    } else {
        predict_covariance<N>(w.transition, model.process, state.p, w.matrix);
    }
    if (state.directions.rank > 0) predict_directions(w.transition, state.directions, w.row);
}

// ---- a block --------------------------------------------------------------------------------------------------------

/// Rows from `first` on in the plainest case: few states, scalar measurements, nothing diffuse, diagonal F, no
/// readouts. State and covariance are copied into variables of their own, which the compiler keeps in registers where
/// every function they are handed to is part of the loop.
template <int N, bool square_root, class Scalar>
ALLANITE_FLAT void filter_plain_rows(const Model<Scalar>& model, const Rows<Scalar>& rows, Index first,
                                     FilterState<Scalar>& state, const FilterOutput<Scalar>& out,
                                     const Workspace<Scalar>& w) noexcept {
    Scalar memory[4 * N + N * N];
    const Slice<Scalar> all{memory, 4 * N + N * N};
    const auto x = all.part(0, N), p = all.part(N, N * N), gain = all.part(N + N * N, N);
    const auto work = all.part(2 * N + N * N, 2 * N);
    for (Index i = 0; i < N; ++i) x[i] = state.x[i];
    for (Index i = 0; i < N * N; ++i) p[i] = state.p[i];
    Likelihood<Scalar> likelihood = state.likelihood;
    for (Index k = first; k < rows.count; ++k) {
        const auto h = model.output.part(k * model.output_step, N);
        const Scalar noise = model.noise[k * model.noise_step], y = rows.y[k];
        Measured<Scalar> measured;
        if constexpr (square_root) {
            measured = update_and_predict_factors<N>(w.transition, w.factors, h, noise, y, x, p, gain, work);
        } else {
            measured = update_and_predict<N>(w.transition, model.process, h, noise, y, x, p, gain);
        }
        if (measured.kind == Update::ordinary) {
            add_innovation(likelihood, measured);
        } else if (is_finite(y) && is_finite(noise)) {
            ++likelihood.skipped;
        }
        for (Index i = 0; rows.drive.size > 0 && i < N; ++i) x[i] += rows.drive[k * N + i];
        report(out, k, measured);
    }
    for (Index i = 0; i < N; ++i) state.x[i] = x[i];
    for (Index i = 0; i < N * N; ++i) state.p[i] = p[i];
    state.likelihood = likelihood;
}

template <int N, bool square_root, class Scalar>
void filter_rows(const Model<Scalar>& model, const Rows<Scalar>& rows, FilterState<Scalar>& state,
                 const FilterOutput<Scalar>& out, const Trace<Scalar>& trace, const Workspace<Scalar>& w) noexcept {
    const bool reads = out.readouts > 0 && (out.means.size > 0 || out.sds.size > 0);
    const bool is_plain = model.components == 1 && !reads && trace.ranks.size == 0 &&
                          (square_root ? w.factors.ratios.size > 0 : w.transition.n_dense == 0);
    for (Index k = 0; k < rows.count; ++k) {
        if constexpr (N != any_size) {
            if (is_plain && state.directions.rank == 0) {
                return filter_plain_rows<N, square_root>(model, rows, k, state, out, w);
            }
        }
        measure_row<N, square_root>(model, rows, k, state, out, trace, w);
        if (reads) read_out<square_root>(model.states, k, state, out, w);
        if (trace.ranks.size > 0) keep_row(trace, square_root, k, state);
        predict_row<N, square_root>(model, rows, k, state, w);
    }
}

/// Filters a block. `state` goes in as the prediction for its first row and comes out as that for the row after it.
///
/// @param scratch  (filter_scratch)
/// @return false, and nothing done, if the square-root form is asked for and Q is not positive semidefinite
template <int N, class Scalar>
bool filter(const Model<Scalar>& model, bool square_root, const Rows<Scalar>& rows, FilterState<Scalar>& state,
            const FilterOutput<Scalar>& out, const Trace<Scalar>& trace, Slice<Scalar> scratch) noexcept {
    const auto w = filter_workspace(model, square_root, scratch);
    if (!w.factors.is_valid) return false;
    const auto run = square_root ? filter_rows<N, true, Scalar> : filter_rows<N, false, Scalar>;
    run(model, rows, state, out, trace, w);
    return true;
}

}  // namespace allanite

#endif
