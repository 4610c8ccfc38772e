// SPDX-License-Identifier: BSD-3-Clause
// The gain of a filter over a segment of rows without a missing sample, as polynomials in time. While nothing is
// missing, the covariance does not depend on the samples: its recursion over 2^j rows is one of n * n matrices
// (structure-preserving doubling, E. K.-W. Chu et al., Int. J. Control 77 (2004) 767),
//
//     P_(k + 2^j) = H_j + A_j' P_k (I + G_j P_k)^-1 A_j,
//
// so nine nodes give the gain of a segment of 8 * 2^j rows, whether it has settled or is still on its way, as that of a
// constant is for the whole record. One row between the first two nodes says how far the polynomial is off.
#ifndef ALLANITE_GAIN_SEGMENT_HPP
#define ALLANITE_GAIN_SEGMENT_HPP

#include "kalman_series.hpp"

namespace allanite {

constexpr Index segment_intervals = 8, segment_nodes = segment_intervals + 1;

/// How far the polynomial may be off: the gain, as a part of its largest value or of sqrt(P_ii / S), the largest that
/// it could have; the standard deviation of an innovation; standard deviations that are read out.
constexpr double gain_tolerance = 1e-10, gain_floor = 2e-13, innovation_tolerance = 1e-12, readout_tolerance = 1e-10;

/// A constant model, and what of its states is read out.
struct GainModel {
    Model<double> model;
    Transition<double> transition;
    Slice<const double> ahead, drift_ahead;  ///< (n) h F, drift F
    Slice<const double> feeds;               ///< (n) 1: a state of a row of F that is not diagonal, and others need it
    Index n_feeding;
    Slice<const double> drift;    ///< (n) read out at each row; empty: nothing is
    Slice<const double> readout;  ///< (g * n) read out at some rows
    Index readouts;               ///< g
};

/// A_j, G_j and H_j for j = 0 ... count - 1.
struct RiccatiSteps {
    Index count;
    Slice<const double> a, g, h;  ///< (count * n * n)
};

/// Columns of a node: the gain (n), h F k, drift k, sqrt S, 1 / sqrt S, standard deviation of the drift; and at last
/// those of the readouts (g).
enum : Index { ahead_column, drift_column, deviation_column, inverse_column, drift_sd_column, n_row_columns };

constexpr Index row_columns(Index n) noexcept { return n + n_row_columns; }

/// A segment of rows: the nodes of its polynomials, and the prediction for the row after its last.
struct GainSegment {
    Index columns;             ///< row_columns(n) + g
    Slice<double> nodes;       ///< (segment_nodes * columns)
    Slice<double> check;       ///< (columns)
    Slice<double> covariance;  ///< (n * n)
    Slice<double> work;        ///< (3 * n * n + 2 * n)
};

constexpr Index segment_scratch(Index n, Index g) noexcept {
    return (segment_nodes + 1) * (row_columns(n) + g) + 4 * n * n + 2 * n;
}

inline GainSegment gain_segment(Index n, Index g, Slice<double> scratch) noexcept {
    Index used = 0;
    const auto take = [&](Index size) noexcept {
        used += size;
        return scratch.part(used - size, size);
    };
    const Index columns = row_columns(n) + g;
    GainSegment segment{};
    segment.columns = columns;
    segment.nodes = take(segment_nodes * columns);
    segment.check = take(columns);
    segment.covariance = take(n * n);
    segment.work = take(3 * n * n + 2 * n);
    return segment;
}

// ---- the covariance over many rows ----------------------------------------------------------------------------------

/// row += factor * other.
inline void add_row(Slice<double> row, double factor, Slice<const double> other) noexcept {
    for (Index j = 0; j < row.size; ++j) row[j] += factor * other[j];
}

/// L' of L L' = P from the upper half of P, in place; zeros below it. A pivot of rounding counts as zero.
inline bool upper_root(Slice<double> p, Index n) noexcept {
    constexpr double rounding = 1e-15;
    for (Index i = 0; i < n; ++i) {
        const auto row = p.part(i * n, n);
        const double whole = row[i];
        for (Index k = 0; k < i; ++k) {
            add_row(row.part(i, n - i), -p[k * n + i], fixed(p.part(k * n + i, n - i)));
            row[k] = 0.0;
        }
        if (!(row[i] >= -1e-10 * whole)) return false;
        const bool vanishes = row[i] <= rounding * whole;
        const double inverse = vanishes ? 0.0 : 1.0 / square_root(row[i]);
        for (Index j = i; j < n; ++j) row[j] *= inverse;
    }
    return true;
}

/// out = U v for an upper triangular U, where v and out have n columns.
inline void upper_product(Slice<const double> u, Slice<const double> v, Index n, Slice<double> out) noexcept {
    for (Index i = 0; i < n; ++i) {
        const auto row = out.part(i * n, n);
        for (Index j = 0; j < n; ++j) row[j] = 0.0;
        for (Index k = i; k < n; ++k) add_row(row, u[i * n + k], v.part(k * n, n));
    }
}

/// P over 2^j rows. False where rounding has broken it.
///
/// @param work  (3 * n * n)
inline bool advance_covariance(const RiccatiSteps& steps, Index j, Index n, Slice<double> p,
                               Slice<double> work) noexcept {
    const Index size = n * n;
    const auto root = work.part(0, size), weight = work.part(size, size), product = work.part(2 * size, size);
    for (Index i = 0; i < size; ++i) root[i] = p[i];
    if (!upper_root(root, n)) return false;
    upper_product(fixed(root), steps.g.part(j * size, size), n, product);
    for (Index r = 0; r < n; ++r) {  // W = I + L' G L
        const auto row = weight.part(r * n, n), left = product.part(r * n, n);
        for (Index c = 0; c < n; ++c) row[c] = c < r ? 0.0 : dot<any_size>(left, root.part(c * n, n));
        row[r] += 1.0;
    }
    if (!upper_root(weight, n)) return false;
    upper_product(fixed(root), steps.a.part(j * size, size), n, product);
    for (Index r = 0; r < n; ++r) {  // W^-1/2 L' A
        const auto row = product.part(r * n, n);
        for (Index k = 0; k < r; ++k) add_row(row, -weight[k * n + r], fixed(product.part(k * n, n)));
        const double inverse = 1.0 / weight[r * n + r];
        for (Index c = 0; c < n; ++c) row[c] *= inverse;
    }
    for (Index i = 0; i < size; ++i) p[i] = steps.h[j * size + i];
    for (Index k = 0; k < n; ++k) {
        const auto row = fixed(product.part(k * n, n));
        for (Index r = 0; r < n; ++r) add_row(p.part(r * n + r, n - r), row[r], row.part(r, n - r));
    }
    for (Index r = 0; r < n; ++r) {
        for (Index c = 0; c < r; ++c) p[r * n + c] = p[c * n + r];
    }
    return true;
}

// ---- nodes ----------------------------------------------------------------------------------------------------------

/// Standard deviation of a readout after the update of a row: m = P h', inverse = 1 / S.
inline double readout_sd(Slice<const double> row, Slice<const double> p, Slice<const double> m, double inverse,
                         Slice<double> work) noexcept {
    symmetric_product<any_size>(p, row, work);
    const double seen = dot<any_size>(row, m), variance = dot<any_size>(row, work) - seen * seen * inverse;
    return square_root(variance > 0.0 ? variance : 0.0);
}

/// What a row with the prediction P has in each column. False if its innovation has no variance.
///
/// @param work  (2 * n)
inline bool fill_node(const GainModel& m, Slice<const double> p, Slice<double> node, Slice<double> work) noexcept {
    const Index n = m.model.states;
    const auto seen = work.part(0, n), other = work.part(n, n), gain = node.part(0, n);
    const auto h = m.model.output.part(0, n);
    const auto rest = node.part(n, n_row_columns);
    symmetric_product<any_size>(p, h, seen);
    const double variance = dot<any_size>(h, seen) + m.model.noise[0], inverse = 1.0 / variance;
    if (!(variance > least_variance<double>()) || !is_finite(variance)) return false;
    for (Index i = 0; i < n; ++i) gain[i] = seen[i] * inverse;
    const bool drifts = m.drift.size > 0;
    rest[ahead_column] = dot<any_size>(m.ahead, gain);
    rest[drift_column] = drifts ? dot<any_size>(m.drift, gain) : 0.0;
    rest[deviation_column] = square_root(variance);
    rest[inverse_column] = 1.0 / rest[deviation_column];
    rest[drift_sd_column] = drifts ? readout_sd(m.drift, p, fixed(seen), inverse, other) : 0.0;
    for (Index g = 0; g < m.readouts; ++g) {
        node[row_columns(n) + g] = readout_sd(m.readout.part(g * n, n), p, fixed(seen), inverse, other);
    }
    return true;
}

// ---- polynomials ----------------------------------------------------------------------------------------------------

/// Weights of the nodes 0, 1 ... 8 of the polynomial through them, at u.
inline void node_weights(double u, double (&weights)[segment_nodes]) noexcept {
    double before = 1.0, after = 1.0, factorial[segment_nodes] = {1.0};
    for (Index i = 1; i < segment_nodes; ++i) factorial[i] = factorial[i - 1] * double(i);
    for (Index i = 0; i < segment_nodes; ++i) {
        const bool is_negative = (segment_intervals - i) % 2 != 0;
        weights[i] = (is_negative ? -before : before) / (factorial[i] * factorial[segment_intervals - i]);
        before *= u - double(i);
    }
    for (Index i = segment_intervals; i >= 0; --i) {
        weights[i] *= after;
        after *= u - double(i);
    }
}

/// The first `out.size` of the columns from `first` on, at u intervals from the first node.
inline void columns_at(const GainSegment& segment, double u, Index first, Slice<double> out) noexcept {
    double weights[segment_nodes];
    node_weights(u, weights);
    for (Index c = 0; c < out.size; ++c) out[c] = 0.0;
    for (Index i = 0; i < segment_nodes; ++i) {
        add_row(out, weights[i], fixed(segment.nodes.part(i * segment.columns + first, out.size)));
    }
}

/// How far one column of the polynomial may be off.
inline double tolerance_of(const GainModel& m, const GainSegment& segment, Slice<const double> p, Index column,
                           double largest) noexcept {
    const Index n = m.model.states;
    const auto rest = segment.nodes.part(n, n_row_columns);
    const double inverse = rest[inverse_column];
    if (column < n) {
        const double most = gain_floor * square_root(p[column * n + column]) * inverse;
        return largest * gain_tolerance > most ? largest * gain_tolerance : most;
    }
    switch (column - n) {
        case ahead_column: return largest * gain_tolerance + gain_floor;
        case drift_column: return rest[drift_sd_column] * inverse * readout_tolerance;
        case deviation_column:
        case inverse_column: return largest * innovation_tolerance;
        default: return largest * readout_tolerance;
    }
}

/// Largest error of the polynomials in the middle of their first interval, over what is tolerated.
inline double segment_error(const GainModel& m, const GainSegment& segment, Slice<const double> p) noexcept {
    double weights[segment_nodes], worst = 0.0;
    node_weights(0.5, weights);
    for (Index c = 0; c < segment.columns; ++c) {
        double value = 0.0, largest = 0.0;
        for (Index i = 0; i < segment_nodes; ++i) {
            const double node = segment.nodes[i * segment.columns + c];
            value += weights[i] * node;
            largest = magnitude(node) > largest ? magnitude(node) : largest;
        }
        const double error = magnitude(value - segment.check[c]);
        const double ratio = error > 0.0 ? error / tolerance_of(m, segment, p, c, largest) : 0.0;
        if (!(ratio <= worst)) worst = ratio;
    }
    return worst;
}

/// The segment of 8 * 2^j rows, j > 0, from the prediction P on. Returns its error over what is tolerated; infinite
/// where rounding has broken P.
inline double plan_segment(const GainModel& m, const RiccatiSteps& steps, Index j, Slice<const double> p,
                           const GainSegment& segment) noexcept {
    const Index n = m.model.states, columns = segment.columns, size = n * n;
    const auto& next = segment.covariance;
    const auto matrices = segment.work.part(0, 3 * size), vectors = segment.work.part(3 * size, 2 * n);
    for (Index i = 0; i < size; ++i) next[i] = p[i];
    if (!advance_covariance(steps, j - 1, n, next, matrices)) return infinity<double>();
    if (!fill_node(m, fixed(next), segment.check, vectors)) return infinity<double>();
    for (Index i = 0; i < size; ++i) next[i] = p[i];
    for (Index node = 0; node < segment_nodes; ++node) {
        if (node > 0 && !advance_covariance(steps, j, n, next, matrices)) return infinity<double>();
        if (!fill_node(m, fixed(next), segment.nodes.part(node * columns, columns), vectors)) return infinity<double>();
    }
    return segment_error(m, segment, p);
}

}  // namespace allanite

#endif
