// SPDX-License-Identifier: BSD-3-Clause
// Fixed-interval smoother: each row's state given the whole record, block by block from the end. Exact through the
// diffuse phase. Firmware-safe, though its memory grows with the block.
//
// Backwards runs what the rows to come say about a shift of the filter's mean, a logarithm of likelihood that is
// quadratic in the shift m: r'm - m'N m / 2. An update with gain k and a prediction with F take it one step back:
//     r = r + h (v / S - k'r),   N = (I - k h)' N (I - k h) + h' h / S;        r = F'r,   N = F'N F
// (a diffuse update: the likelihood with its direction known is wanted, see exchange_gain()).
// With the filtered mean x and covariance P of a row, and diffuse directions A (columns), the smoothed readout g x is
//     g x + g P r + B d,   variance g (P - P N P) g' + B D B',   B = g (I - P N) A,   D = (A'N A)^-1,   d = D A'r.
// (Bryson and Frazier 1963, on filtered quantities; diffuse part: A d has a flat prior and this likelihood.)
#ifndef ALLANITE_SMOOTHER_HPP
#define ALLANITE_SMOOTHER_HPP

#include "kalman_series.hpp"

namespace allanite {

/// r and N: zeros behind the last row of the record.
template <class Scalar>
struct Future {
    Slice<Scalar> gradient;     ///< (n)
    Slice<Scalar> information;  ///< (n * n)
};

/// One readout of one row.
template <class Scalar>
struct Smoothed {
    Scalar mean, variance;
};

/// Below this share of its terms a readout does not depend on a direction that stays diffuse to the end.
template <class Scalar>
constexpr Scalar no_dependence = sizeof(Scalar) > 4 ? Scalar(1) / Scalar(1 << 26) : Scalar(1) / Scalar(1 << 10);

/// Number of Scalars of a Trace.
constexpr Index trace_numbers(Index rows, Index n, Index p, bool is_diffuse) noexcept {
    return rows * (n + n * n + 1 + p * (2 * n + 3) + (is_diffuse ? n * n + p * n : 0));
}

template <class Scalar>
Trace<Scalar> trace_in(Slice<Scalar> numbers, Index rows, Index n, Index p, bool is_diffuse) noexcept {
    Index used = 0;
    const auto take = [&](Index size) noexcept {
        used += size;
        return numbers.part(used - size, size);
    };
    Trace<Scalar> trace;
    trace.x = take(rows * n);
    trace.p = take(rows * n * n);
    trace.directions = take(is_diffuse ? rows * n * n : 0);
    trace.ranks = take(rows);
    trace.outputs = take(rows * p * n);
    trace.gains = take(rows * p * n);
    trace.diffuse_gains = take(is_diffuse ? rows * p * n : 0);
    trace.kinds = take(rows * p);
    trace.innovations = take(rows * p);
    trace.variances = take(rows * p);
    return trace;
}

/// Scratch: three vectors and the diffuse part, or a matrix and a vector.
constexpr Index smoother_scratch(Index n) noexcept { return n * n + 7 * n; }

// ---- one step back --------------------------------------------------------------------------------------------------

/// r = F'r, N = F'N F. `work` (n * n + n).
template <class Scalar>
void retreat(const Transition<Scalar>& f, const Future<Scalar>& future, Slice<Scalar> work) noexcept {
    const Index n = f.diagonal.size;
    const auto r = future.gradient, big = future.information;
    const auto left = work.part(0, n * n), gradient = work.part(n * n, n);
    for (Index i = 0; i < n; ++i) gradient[i] = f.diagonal[i] * r[i];
    for (Index i = 0; i < n * n; ++i) left[i] = f.diagonal[i / n] * big[i];  // F'N
    for (Index i = 0; i < n; ++i) {
        if (f.dense[i] == Scalar(0)) continue;
        for (Index j = 0; j < n; ++j) {
            const Scalar factor_j = f.matrix[i * n + j];
            gradient[j] += factor_j * r[i];
            for (Index k = 0; factor_j != Scalar(0) && k < n; ++k) left[j * n + k] += factor_j * big[i * n + k];
        }
    }
    for (Index i = 0; i < n; ++i) {
        r[i] = gradient[i];
        for (Index k = i; k < n; ++k) {
            Scalar sum = left[i * n + k] * f.diagonal[k];
            for (Index j = 0; f.n_dense > 0 && j < n; ++j) {
                if (f.dense[j] != Scalar(0)) sum += left[i * n + j] * f.matrix[j * n + k];
            }
            big[i * n + k] = big[k * n + i] = sum;
        }
    }
}

/// Back over one ordinary update. `work` (n).
template <class Scalar>
void take_back(Slice<const Scalar> h, Slice<const Scalar> gain, Scalar innovation, Scalar variance,
               const Future<Scalar>& future, Slice<Scalar> work) noexcept {
    const Index n = h.size;
    const auto r = future.gradient, big = future.information;
    symmetric_product<any_size>(big, gain, work);
    const Scalar inverse = Scalar(1) / variance, both = inverse + dot<any_size>(gain, work);
    const Scalar change = innovation * inverse - dot<any_size>(gain, r);
    for (Index i = 0; i < n; ++i) {
        r[i] += h[i] * change;
        for (Index j = 0; j < n; ++j) {
            big[i * n + j] += (h[i] * h[j]) * both - (h[i] * work[j] + work[i] * h[j]);
        }
    }
}

/// r and N about the state after a diffuse update become those about the state after the ordinary one that the
/// measurement would have made had the direction been known: gain k for b, so P less S c c' and x less c v, c = b - k.
/// `work` (2 n).
template <class Scalar>
void exchange_gain(Slice<const Scalar> gain, Slice<const Scalar> b, Scalar innovation, Scalar variance,
                   const Future<Scalar>& future, Slice<Scalar> work) noexcept {
    const Index n = gain.size;
    const auto r = future.gradient, big = future.information, c = work.part(0, n), product = work.part(n, n);
    for (Index i = 0; i < n; ++i) c[i] = b[i] - gain[i];
    symmetric_product<any_size>(big, c, product);
    const Scalar known = variance * dot<any_size>(c, product);
    const Scalar share = variance / (Scalar(1) - known);
    for (Index i = 0; i < n; ++i) r[i] += product[i] * innovation;
    const Scalar slope = share * dot<any_size>(c, r);
    for (Index i = 0; i < n; ++i) {
        r[i] += product[i] * slope;
        for (Index j = 0; j < n; ++j) big[i * n + j] += share * (product[i] * product[j]);
    }
}

/// Back over all measurements of row k.
template <class Scalar>
void take_back_row(const Trace<Scalar>& trace, Index k, const Future<Scalar>& future, Slice<Scalar> work) noexcept {
    const Index n = future.gradient.size, p = trace.kinds.size / trace.ranks.size;
    for (Index i = k * p + p - 1; i >= k * p; --i) {
        const Scalar innovation = trace.innovations[i], variance = trace.variances[i];
        if (!(variance > Scalar(0))) continue;
        const auto h = fixed(trace.outputs.part(i * n, n)), gain = fixed(trace.gains.part(i * n, n));
        if (trace.kinds[i] > Scalar(1)) {
            exchange_gain(gain, fixed(trace.diffuse_gains.part(i * n, n)), innovation, variance, future, work);
        }
        take_back(h, gain, innovation, variance, future, work);
    }
}

// ---- the diffuse part -----------------------------------------------------------------------------------------------

/// A'N A, A'r and B of one readout, each beside the magnitude of its terms where zero must be told from rounding.
template <class Scalar>
struct DiffusePart {
    Index rank;
    Slice<Scalar> information, information_terms;  ///< (rank * rank), (rank)
    Slice<Scalar> gradient, readout, readout_terms;  ///< (rank)
};

/// @param nu      (n) N P g'
/// @param product (n) work
template <class Scalar>
DiffusePart<Scalar> diffuse_part(Slice<const Scalar> directions, Index rank, Slice<const Scalar> g,
                                 Slice<const Scalar> nu, const Future<Scalar>& future, Slice<Scalar> product,
                                 Slice<Scalar> work) noexcept {
    const Index n = g.size;
    DiffusePart<Scalar> part{rank, work.part(0, rank * rank), work.part(rank * rank, rank),
                             work.part(rank * rank + rank, rank), work.part(rank * rank + 2 * rank, rank),
                             work.part(rank * rank + 3 * rank, rank)};
    for (Index k = 0; k < rank; ++k) {
        const auto a = directions.part(k * n, n);
        symmetric_product<any_size>(future.information, a, product);
        for (Index l = 0; l < rank; ++l) {
            part.information[k * rank + l] = dot<any_size>(product, directions.part(l * n, n));
        }
        Scalar terms = Scalar(0), readout_terms = Scalar(0);
        for (Index i = 0; i < n; ++i) {
            readout_terms += magnitude(a[i] * g[i]) + magnitude(a[i] * nu[i]);
            for (Index j = 0; j < n; ++j) terms += magnitude(a[i] * future.information[i * n + j] * a[j]);
        }
        part.information_terms[k] = terms;
        part.gradient[k] = dot<any_size>(a, future.gradient);
        part.readout[k] = dot<any_size>(a, g) - dot<any_size>(a, nu);
        part.readout_terms[k] = readout_terms;
    }
    return part;
}

/// The direction about which the rows to come say most, relative to the terms; -1 if they say nothing.
template <class Scalar>
Index best_determined(const DiffusePart<Scalar>& part) noexcept {
    Index best = -1;
    Scalar most = cancellation<Scalar>;
    for (Index k = 0; k < part.rank; ++k) {
        const Scalar terms = part.information_terms[k], share = part.information[k * part.rank + k];
        if (!(terms > Scalar(0)) || !(share > most * terms)) continue;
        most = share / terms;
        best = k;
    }
    return best;
}

/// Adds B d and B D B' by elimination, one direction at a time, `determined` of them. Infinite variance where the
/// readout depends on one that is left.
template <class Scalar>
void add_diffuse(const DiffusePart<Scalar>& part, Index determined, Smoothed<Scalar>& smoothed) noexcept {
    const Index rank = part.rank;
    for (Index step = 0; step < determined; ++step) {
        const Index j = best_determined(part);
        if (j < 0) break;
        const Scalar inverse = Scalar(1) / part.information[j * rank + j];
        smoothed.mean += part.readout[j] * part.gradient[j] * inverse;
        smoothed.variance += part.readout[j] * part.readout[j] * inverse;
        for (Index i = 0; i < rank; ++i) {
            const Scalar share = part.information[i * rank + j] * inverse;
            if (i == j || part.information_terms[i] == Scalar(0)) continue;
            part.gradient[i] -= share * part.gradient[j];
            part.readout[i] -= share * part.readout[j];
            part.readout_terms[i] += magnitude(share * part.readout[j]);
            for (Index l = 0; l < rank; ++l) {
                if (l != j) part.information[i * rank + l] -= share * part.information[j * rank + l];
            }
        }
        part.information_terms[j] = part.readout[j] = Scalar(0);  // done
    }
    for (Index i = 0; i < rank; ++i) {
        if (magnitude(part.readout[i]) > no_dependence<Scalar> * part.readout_terms[i]) {
            smoothed = {not_a_number<Scalar>(), infinity<Scalar>()};
        }
    }
}

// ---- a block --------------------------------------------------------------------------------------------------------

template <class Scalar>
Smoothed<Scalar> smooth_readout(Slice<const Scalar> g, const Trace<Scalar>& trace, Index k, Index final_rank,
                                const Future<Scalar>& future, Slice<Scalar> scratch) noexcept {
    const Index n = g.size, rank = Index(trace.ranks[k]);
    const auto u = scratch.part(0, n), nu = scratch.part(n, n), product = scratch.part(2 * n, n);
    symmetric_product<any_size>(trace.p.part(k * n * n, n * n), g, u);
    symmetric_product<any_size>(future.information, u, nu);
    Smoothed<Scalar> smoothed{dot<any_size>(g, trace.x.part(k * n, n)) + dot<any_size>(u, future.gradient),
                              dot<any_size>(u, g) - dot<any_size>(u, nu)};
    if (rank > 0) {
        const auto directions = fixed(trace.directions.part(k * n * n, rank * n));
        const auto part = diffuse_part(directions, rank, g, fixed(nu), future, product,
                                       scratch.part(3 * n, rank * rank + 4 * rank));
        add_diffuse(part, rank - final_rank, smoothed);
    }
    return smoothed;
}

/// Smooths a block that filter() has left a trace of.
///
/// @param final_rank  diffuse rank behind the last row of the record
/// @param future      in: behind the last row of the block; out: at its first row, for the block before
/// @param readout     (g * n)
/// @param means, sds  (rows * g); an sd is infinite where the record does not determine the readout
/// @param scratch     (smoother_scratch)
template <class Scalar>
void smooth(const Transition<Scalar>& transition, const Trace<Scalar>& trace, Index final_rank,
            const Future<Scalar>& future, Slice<const Scalar> readout, Slice<Scalar> means, Slice<Scalar> sds,
            Slice<Scalar> scratch) noexcept {
    const Index n = transition.diagonal.size, rows = trace.ranks.size, readouts = rows > 0 ? means.size / rows : 0;
    for (Index k = rows - 1; k >= 0; --k) {
        retreat(transition, future, scratch);
        for (Index g = 0; g < readouts; ++g) {
            const auto smoothed = smooth_readout(readout.part(g * n, n), trace, k, final_rank, future, scratch);
            means[k * readouts + g] = smoothed.mean;
            sds[k * readouts + g] = square_root(smoothed.variance < Scalar(0) ? Scalar(0) : smoothed.variance);
        }
        take_back_row(trace, k, future, scratch);
    }
}

/// Where the filter stood before a block.
template <class Scalar>
struct Checkpoint {
    Slice<const Scalar> x, p, directions;  ///< (n), (n * n), (n * n)
};

/// Runs the filter over a block once more, from its checkpoint, then smooths it.
///
/// @param filter   filter() of the right size
/// @param numbers  (trace_numbers)
/// @param scratch  (filter_scratch + smoother_scratch + transition_numbers + n + 2 n * n)
/// @return as filter()
template <class Filter, class Scalar>
bool filter_and_smooth(Filter filter, const Model<Scalar>& model, bool square_root, const Rows<Scalar>& rows,
                       const Checkpoint<Scalar>& checkpoint, Index rank, Index final_rank,
                       const Future<Scalar>& future, Slice<const Scalar> readout, Slice<Scalar> means,
                       Slice<Scalar> sds, Slice<Scalar> numbers, Slice<Scalar> scratch) noexcept {
    const Index n = model.states, p = model.components;
    const auto state = scratch.part(0, n + 2 * n * n);
    for (Index i = 0; i < n; ++i) state[i] = checkpoint.x[i];
    for (Index i = 0; i < n * n; ++i) state[n + i] = checkpoint.p[i];
    for (Index i = 0; i < n * n; ++i) state[n + n * n + i] = checkpoint.directions[i];
    FilterState<Scalar> carried{
        state.part(0, n), state.part(n, n * n), {state.part(n + n * n, n * n), rank}, Likelihood<Scalar>{}};
    const auto rest = scratch.part(state.size, scratch.size - state.size);
    const auto trace = trace_in(numbers, rows.count, n, p, rank > 0);
    if (!filter(model, square_root, rows, carried, FilterOutput<Scalar>{}, trace, rest)) return false;
    const auto transition = split_transition(model.transition, n, rest.part(0, transition_numbers(n)));
    smooth(transition, trace, final_rank, future, readout, means, sds,
           rest.part(transition_numbers(n), smoother_scratch(n)));
    return true;
}

}  // namespace allanite

#endif
