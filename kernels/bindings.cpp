// SPDX-License-Identifier: BSD-3-Clause
// The seam: check shapes, release the interpreter lock, call the kernel. Nothing else.
// Arrays are taken as they are (never converted, never copied): float64 or int64, C-contiguous, on the CPU.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>

#include <array>
#include <memory>
#include <tuple>
#include <utility>

#include "allanite/allan.hpp"
#include "allanite/biweight.hpp"
#include "allanite/curve_fit.hpp"
#include "allanite/gamma_law.hpp"
#include "allanite/noise.hpp"
#include "allanite/online_allan.hpp"
#include "allanite/pairs_in_runs.hpp"
#include "allanite/pool_likelihood.hpp"
#include "allanite/smoother.hpp"
#include "allanite/strands.hpp"
#include "allanite/theo.hpp"
#include "allanite/whiten.hpp"
#include "allanite/window_pairs.hpp"
#include "carried.hpp"
#include "gain_filter_call.hpp"
#include "strands_call.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using allanite::Index;
using allanite::Slice;

namespace {

using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Cube = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Tables = nb::ndarray<const double, nb::ndim<4>, nb::c_contig, nb::device::cpu>;
using MatrixOut = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using VectorOut = nb::ndarray<double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Integers = nb::ndarray<const int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Runs = nb::ndarray<const int64_t, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using Shapes = nb::ndarray<const int64_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using IntegersOut = nb::ndarray<int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using NewVector = nb::ndarray<nb::numpy, double, nb::ndim<1>, nb::c_contig>;
using NewIntegers = nb::ndarray<nb::numpy, int64_t, nb::ndim<1>, nb::c_contig>;
using NewMatrix = nb::ndarray<nb::numpy, double, nb::ndim<2>, nb::c_contig>;
using NewRuns = nb::ndarray<nb::numpy, int64_t, nb::shape<-1, 2>, nb::c_contig>;

template <class Array>
auto slice(const Array& array) {
    return Slice<std::remove_pointer_t<decltype(array.data())>>{array.data(), Index(array.size())};
}

/// A NumPy array of this shape, and the slice that fills it.
template <class Array>
auto new_array(std::initializer_list<size_t> shape) {
    size_t size = 1;
    for (size_t extent : shape) size *= extent;
    using T = typename Array::Scalar;
    T* data = new T[size > 0 ? size : 1];
    nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
    return std::pair{Array(data, shape, owner), Slice<T>{data, Index(size)}};
}

void require(bool condition, const char* message) {
    if (!condition) throw nb::value_error(message);
}

/// Sorted, disjoint, half-open, and inside [0, starts).
void require_runs(Slice<const int64_t> runs, Index starts) {
    int64_t end = 0;
    for (Index r = 0; r < runs.size / 2; ++r) {
        require(end <= runs[2 * r] && runs[2 * r] < runs[2 * r + 1] && runs[2 * r + 1] <= starts,
                "runs: each must be half-open and not empty, sorted, and end before the window leaves the phase");
        end = runs[2 * r + 1];
    }
}

double integrate(const Vector& block, double offset, double start, const VectorOut& out) {
    require(block.size() > 0, "block: no samples");
    require(out.size() == block.size(), "out: must be as long as block");
    nb::gil_scoped_release unlocked;
    return allanite::integrate(slice(block), offset, start, slice(out));
}

NewRuns missing_runs(const Vector& block, int64_t start) {
    require(block.size() > 0, "block: no samples");
    Index count = 0;
    {
        nb::gil_scoped_release unlocked;
        count = allanite::missing_runs(slice(block), start, {nullptr, 0});
    }
    auto [runs, out] = new_array<NewRuns>({size_t(count), 2});
    if (count > 0) allanite::missing_runs(slice(block), start, out);
    return runs;
}

NewMatrix difference_squares(const Vector& phase, int order, const Integers& lags, const Runs& runs,
                             const Integers& run_offsets, Index first_block, Index last_block, Index block) {
    require(order == 2 || order == 3, "order: must be 2 (Allan) or 3 (Hadamard)");
    require(lags.size() > 0, "lags: none");
    require(run_offsets.size() == lags.size() + 1, "run_offsets: must be one longer than lags");
    require(run_offsets(0) == 0 && run_offsets(lags.size()) == int64_t(runs.shape(0)),
            "run_offsets: must begin at 0 and end at the number of runs");
    require(
        block >= 1 && 0 <= first_block && first_block <= last_block && last_block <= Index(phase.size()) / block + 1,
        "blocks: need block >= 1 and 0 <= first_block <= last_block, within the phase");
    for (size_t l = 0; l < lags.size(); ++l) {
        require(1 <= lags(l) && lags(l) <= int64_t(phase.size()),
                "lags: each must be between 1 and the record's length");
        require(run_offsets(l) <= run_offsets(l + 1) && run_offsets(l + 1) <= int64_t(runs.shape(0)),
                "run_offsets: must not fall, nor pass the number of runs");
        require_runs(slice(runs).part(2 * run_offsets(l), 2 * (run_offsets(l + 1) - run_offsets(l))),
                     Index(phase.size()) - order * lags(l));
    }
    auto [sums, out] = new_array<NewMatrix>({size_t(last_block - first_block), lags.size()});
    nb::gil_scoped_release unlocked;
    const auto sum_up = order == 2 ? allanite::difference_squares<2> : allanite::difference_squares<3>;
    sum_up(slice(phase), slice(lags), slice(runs), slice(run_offsets), first_block, block, out);
    return sums;
}

double modified_squares(const Vector& phase, Index lag, const Runs& runs) {
    require(1 <= lag && lag <= Index(phase.size()), "lag: must be between 1 and the record's length");
    require_runs(slice(runs), Index(phase.size()) - 3 * lag + 1);
    nb::gil_scoped_release unlocked;
    return allanite::modified_squares(slice(phase), lag, slice(runs));
}

double total_squares(const Vector& phase, Index lag) {
    require(phase.size() >= 3, "phase: needs at least 3 points");
    require(1 <= lag && lag < Index(phase.size()), "lag: must be between 1 and the record's length");
    nb::gil_scoped_release unlocked;
    return allanite::total_squares(slice(phase), lag);
}

double theo_squares(const Vector& head, const Vector& tail, Index depth, const Runs& runs) {
    const Index size = Index(head.size() < tail.size() ? head.size() : tail.size());
    require(1 <= depth && depth < size, "depth: must be between 1 and the length of head and tail");
    require_runs(slice(runs), size - depth);
    nb::gil_scoped_release unlocked;
    return allanite::theo_squares(slice(head), slice(tail), depth, slice(runs));
}

std::pair<double, double> biweight_sums(const Vector& phase, Index lag, const Runs& runs, double scale, double cut) {
    require(1 <= lag && lag <= Index(phase.size()), "lag: must be between 1 and the record's length");
    require(scale > 0.0 && cut > 0.0, "scale, cut: must be positive");
    require_runs(slice(runs), Index(phase.size()) - 2 * lag);
    nb::gil_scoped_release unlocked;
    const allanite::BiweightSums sums = allanite::biweight_sums(slice(phase), lag, slice(runs), scale, cut);
    return {sums.psi, sums.slope};
}

allanite::CurveFit curve_fit(const Vector& variance, const Matrix& columns, const Vector& here, const Matrix& whiten,
                             const Integers& starts, const Vector& centre) {
    const size_t lags = variance.size();
    require(columns.shape(0) == lags && columns.shape(1) == here.size(), "columns: a row per lag, one per coefficient");
    require(whiten.shape(0) == lags && starts.size() == lags && centre.size() == lags,
            "whiten, starts, centre: of as many lags as variance");
    for (size_t i = 0; i < lags; ++i) {
        require(0 <= starts(i) && starts(i) <= int64_t(i) && int64_t(i) - starts(i) < int64_t(whiten.shape(1)),
                "starts: a row of whiten must reach to the diagonal");
    }
    return {slice(variance), slice(whiten), slice(starts), slice(centre), Index(here.size())};
}

std::tuple<NewMatrix, NewVector, double> curve_weight(const Matrix& relative, double discrepancy, double least) {
    require(relative.shape(0) == relative.shape(1), "relative: must be square");
    auto [whiten, triangle] = new_array<NewMatrix>({relative.shape(0), relative.shape(0)});
    auto [centre, means] = new_array<NewVector>({relative.shape(0)});
    const double log_det = allanite::curve_weight(slice(relative), discrepancy, least, triangle, means);
    return {whiten, centre, log_det};
}

NewVector curve_levels(const Vector& variance, const Matrix& means, const Matrix& weights, const Tables& parts,
                       const Integers& tables, double discrepancy, double least) {
    const size_t lags = variance.size(), models = means.shape(0);
    require(means.shape(1) == lags, "means: a row per model, one per lag");
    require(weights.shape(0) == models && weights.shape(1) == parts.shape(1), "weights: a row per model, one per part");
    require(parts.shape(2) == lags && parts.shape(3) == lags, "parts: must be square, of as many lags as variance");
    require(tables.size() == models, "tables: one per model");
    for (size_t i = 0; i < models; ++i)
        require(0 <= tables(i) && tables(i) < int64_t(parts.shape(0)), "tables: there is none of this number");
    auto [levels, out] = new_array<NewVector>({models});
    allanite::curve_levels(slice(variance), slice(means), slice(weights), slice(parts), slice(tables), discrepancy,
                           least, out);
    return levels;
}

NewVector curve_step(const Vector& variance, const Matrix& columns, const Vector& here, const Vector& means,
                     const Matrix& whiten, const Integers& starts, const Vector& centre) {
    auto fit = curve_fit(variance, columns, here, whiten, starts, centre);
    require(means.size() == variance.size(), "means: must be as long as variance");
    auto [step, out] = new_array<NewVector>({here.size()});
    fit.step(slice(columns), slice(here), slice(means), out);
    return step;
}

NewVector curve_minimum(const Vector& variance, const Matrix& columns, const Vector& rest, const Vector& here,
                        const Matrix& whiten, const Integers& starts, const Vector& centre, int steps, double settled) {
    auto fit = curve_fit(variance, columns, here, whiten, starts, centre);
    require(rest.size() == variance.size(), "rest: must be as long as variance");
    auto [minimum, out] = new_array<NewVector>({here.size()});
    for (Index j = 0; j < out.size; ++j) out[j] = here.data()[j];
    fit.minimise(slice(columns), slice(rest), out, steps, settled);
    return minimum;
}

NewMatrix gamma_tails(const Vector& shape, const Vector& x) {
    require(shape.size() == x.size(), "shape: must be as long as x");
    auto [tails, out] = new_array<NewMatrix>({2, x.size()});
    nb::gil_scoped_release unlocked;
    for (size_t i = 0; i < x.size(); ++i) {
        const allanite::GammaTails at = allanite::gamma_tails(shape(i), x(i));
        out[Index(i)] = at.lower;
        out[Index(x.size() + i)] = at.upper;
    }
    return tails;
}

NewVector gamma_quantiles(const Vector& shape, const Vector& tail, bool upper) {
    require(shape.size() == tail.size(), "shape: must be as long as tail");
    auto [quantiles, out] = new_array<NewVector>({tail.size()});
    nb::gil_scoped_release unlocked;
    for (size_t i = 0; i < tail.size(); ++i) out[Index(i)] = allanite::gamma_quantile(shape(i), tail(i), upper);
    return quantiles;
}

void require_pairs(const Matrix& lengths, const Integers& offsets, const Vector& distance) {
    require(lengths.shape(1) == 2 && offsets.size() == lengths.shape(0) + 1, "offsets: one more than pairs of lengths");
    for (size_t p = 0; p < lengths.shape(0); ++p) {
        require(0.0 < lengths(p, 0) && lengths(p, 0) <= lengths(p, 1), "lengths: positive, the shorter one first");
        require(0 <= offsets(p) && offsets(p) <= offsets(p + 1), "offsets: must not fall");
    }
    require(offsets(0) == 0 && offsets(lengths.shape(0)) == int64_t(distance.size()), "offsets: from 0 to the last");
}

NewVector window_pairs(const Matrix& lengths, const Integers& offsets, const Vector& distance, double spike,
                       double linear, double cubic, double exponential, double rate) {
    require_pairs(lengths, offsets, distance);
    auto [covariance, out] = new_array<NewVector>({distance.size()});
    nb::gil_scoped_release unlocked;
    allanite::window_pairs(slice(lengths), slice(offsets), slice(distance), {spike, linear, cubic, exponential, rate},
                           out);
    return covariance;
}

NewMatrix power_window_pairs(const Matrix& lengths, const Integers& offsets, const Vector& distance,
                             const Vector& exponents) {
    require_pairs(lengths, offsets, distance);
    auto [covariance, out] = new_array<NewMatrix>({exponents.size(), distance.size()});
    nb::gil_scoped_release unlocked;
    allanite::power_window_pairs(slice(lengths), slice(offsets), slice(distance), slice(exponents), out);
    return covariance;
}

NewVector pairs_in_runs(const Runs& first, const Runs& second, const Vector& distance) {
    require_runs(slice(first), PTRDIFF_MAX);
    require_runs(slice(second), PTRDIFF_MAX);
    auto [pairs, out] = new_array<NewVector>({distance.size()});
    nb::gil_scoped_release unlocked;
    const size_t runs = second.shape(0);
    std::vector<double> before(runs);
    std::vector<int64_t> nearest(runs + 1);
    if (runs == 0) {
        for (Index i = 0; i < out.size; ++i) out[i] = 0.0;
        return pairs;
    }
    const allanite::RunPositions positions{slice(second), {before.data(), Index(runs)}, {nearest.data(), Index(runs + 1)}};
    allanite::pairs_in_runs(slice(first), positions, slice(distance), out);
    return pairs;
}

std::pair<NewVector, NewMatrix> pool_likelihood(const Vector& c, const Matrix& rows, const Shapes& pools,
                                                const Vector& moments, const Vector& values, const Vector& tilts,
                                                double slope, bool averaged) {
    const size_t size = rows.shape(0);
    Index needed = 0;
    for (size_t p = 0; p < pools.shape(0); ++p) {
        const Index d = Index(pools(p, 0)), given = Index(pools(p, 1));
        require(0 < d && d < 1 << 20 && 0 <= given && given <= d, "pools: sizes, and at most as many that are given");
        needed += 2 * d + d * d;
    }
    require(Index(moments.size()) == needed, "moments: mean, tilt and second moments of each pool");
    require(values.size() == tilts.size(), "values, tilts: must be alike");
    require(c.size() <= size && size < size_t(allanite::most_pool_terms), "rows: one for each coefficient, at most 15");
    require(Index(rows.shape(1)) == allanite::PoolLikelihood::elements(slice(pools)) + Index(values.size()),
            "rows: the covariances of all pools, and a variance for each value");
    auto [head, numbers] = new_array<NewVector>({3 + size});
    auto [matrix, information] = new_array<NewMatrix>({size, size});
    nb::gil_scoped_release unlocked;
    allanite::PoolLikelihood of(slice(pools), slice(moments), slice(values), slice(tilts));
    if (!of.evaluate(slice(c), slice(rows), Index(size), slope, averaged, numbers.part(0, 3),
                     numbers.part(3, Index(size)), information)) {
        for (Index i = 0; i < numbers.size; ++i) numbers[i] = i > 0 ? 0.0 : HUGE_VAL;
        for (Index i = 0; i < information.size; ++i) information[i] = 0.0;
    }
    return {head, matrix};
}

void markov_noise(const Matrix& normals, const Vector& phi, const Vector& step_sd, const Vector& weight_now,
                  const Vector& weight_next, const VectorOut& state, const VectorOut& out) {
    require(out.size() > 0 && state.size() > 0, "out, state: must not be empty");
    require(normals.shape(0) == out.size() && normals.shape(1) == state.size(),
            "normals: must have shape (len(out), len(state))");
    require(phi.size() == state.size() && step_sd.size() == state.size() && weight_now.size() == state.size() &&
                weight_next.size() == state.size(),
            "phi, step_sd, weight_now, weight_next: must be as long as state");
    nb::gil_scoped_release unlocked;
    allanite::markov_noise(slice(normals), slice(phi), slice(step_sd), slice(weight_now), slice(weight_next),
                           slice(state), slice(out));
}

allanite::OnlinePlan online_plan(const Integers& lags, int order, Index positions, Index block) {
    require(order == 2 || order == 3, "order: must be 2 (Allan) or 3 (Hadamard)");
    require(positions >= 1 && positions <= 1 << 20, "positions: must be between 1 and 2**20");
    require(block >= 2 && block % 2 == 0 && block <= 1 << 20, "block: must be even, between 2 and 2**20");
    require(lags.size() > 0, "lags: none");
    for (size_t l = 0; l < lags.size(); ++l) {
        require(lags(l) < int64_t(1) << 62 && allanite::online_lag_fits(lags(l), positions),
                "lags: each must be below 2 positions, or q 2**k with q from positions to 2 positions - 1");
        require(l == 0 || lags(l - 1) < lags(l), "lags: must rise");
    }
    return {slice(lags), order, positions, block};
}

std::pair<Index, Index> online_size(const allanite::OnlinePlan& plan) {
    const Index levels = allanite::online_levels(plan.lags[plan.lags.size - 1], plan.positions);
    return {allanite::online_numbers(plan.lags.size, levels, plan.order, plan.positions, plan.block),
            allanite::online_counters(plan.lags.size, levels)};
}

std::pair<Index, Index> online_allan_size(const Integers& lags, int order, Index positions, Index block) {
    return online_size(online_plan(lags, order, positions, block));
}

/// The state, once its arrays are known to have the size that the plan asks for.
allanite::OnlineState<double> online_state(const allanite::OnlinePlan& plan, const VectorOut& numbers,
                                           const IntegersOut& counters) {
    const auto [n_numbers, n_counters] = online_size(plan);
    require(Index(numbers.size()) == n_numbers && Index(counters.size()) == n_counters,
            "numbers, counters: must have the sizes that online_allan_size() gives");
    const auto state = allanite::online_state(plan, slice(numbers), slice(counters));
    for (Index level = 0; level < state.filled.size; ++level) {  // each level fills at half the pace of the one above
        const int64_t filled = state.filled[level], above = level > 0 ? state.filled[level - 1] / 2 : filled;
        require(0 <= filled && filled < plan.block && (filled == above || filled == above + plan.block / 2),
                "counters: not a state of this plan");
    }
    return state;
}

void online_allan_feed(const VectorOut& numbers, const IntegersOut& counters, const Integers& lags, int order,
                       Index positions, Index block, const Vector& samples, double offset) {
    require(samples.size() > 0, "samples: none");
    const auto plan = online_plan(lags, order, positions, block);
    const auto state = online_state(plan, numbers, counters);
    nb::gil_scoped_release unlocked;
    allanite::online_feed(plan, state, slice(samples), offset);
}

std::pair<NewVector, NewIntegers> online_allan_read(const VectorOut& numbers, const IntegersOut& counters,
                                                    const Integers& lags, int order, Index positions, Index block) {
    const auto plan = online_plan(lags, order, positions, block);
    const auto state = online_state(plan, numbers, counters);
    auto [sums, sums_out] = new_array<NewVector>({lags.size()});
    auto [counts, counts_out] = new_array<NewIntegers>({lags.size()});
    allanite::online_read(plan, state, sums_out, counts_out);
    return {sums, counts};
}

/// Memory for a kernel. A size of zero is one more element than nothing: an address that may be passed on.
struct Scratch {
    explicit Scratch(Index size) : memory(new double[size_t(size) + 1]), slice{memory.get(), size} {}
    std::unique_ptr<double[]> memory;
    Slice<double> slice;
};

template <class Array>
bool has_shape(const Array& array, size_t rows, size_t columns) {
    return array.shape(0) == rows && array.shape(1) == columns;
}

double whiten(const Matrix& transition, const Matrix& process, const Vector& output, const Vector& noise,
              const MatrixOut& covariance, const MatrixOut& state, const Matrix& columns, const MatrixOut& out) {
    const size_t n = output.size(), rows = noise.size(), series = columns.shape(1);
    require(has_shape(transition, n, n) && has_shape(process, n, n) && has_shape(covariance, n, n),
            "transition, process, covariance: must have shape (n, n), n = len(output)");
    require(has_shape(columns, rows, series) && has_shape(out, rows, series),
            "columns, out: must have shape (len(noise), c)");
    require(has_shape(state, n, series), "state: must have shape (n, c), c as in columns");
    Scratch numbers(allanite::transition_numbers(Index(n)));
    Scratch scratch(allanite::whiten_scratch(Index(n), Index(series)));
    nb::gil_scoped_release unlocked;
    const allanite::Whitening<double> whitening{
        allanite::split_transition(slice(transition), Index(n), numbers.slice), slice(process), slice(output),
        slice(covariance), slice(state), Index(series)};
    return allanite::whiten(whitening, slice(noise), slice(columns), slice(out), scratch.slice);
}

/// The model and a block of measurements, once their shapes are known to agree.
struct Problem {
    allanite::Model<double> model;
    allanite::Rows<double> rows;
};

Problem problem(const Matrix& transition, const Matrix& process, const Cube& output, const Cube& noise,
                const Matrix& y, const Matrix& drive) {
    const size_t n = transition.shape(0), rows = y.shape(0), p = y.shape(1);
    require(has_shape(transition, n, n) && has_shape(process, n, n), "transition, process: must have shape (n, n)");
    require(p > 0 && p <= 1 << 10, "y: must have shape (rows, p), p between 1 and 1024");
    require((output.shape(0) == 1 || output.shape(0) == rows) && output.shape(1) == p && output.shape(2) == n,
            "output: must have shape (1, p, n) or (rows, p, n)");
    require((noise.shape(0) == 1 || noise.shape(0) == rows) && noise.shape(1) == p && noise.shape(2) == p,
            "noise: must have shape (1, p, p) or (rows, p, p)");
    require(drive.shape(0) == 0 || has_shape(drive, rows, n), "drive: must have shape (0, n) or (rows, n)");
    return {{Index(n), Index(p), slice(transition), slice(process), slice(output), slice(noise),
             output.shape(0) == 1 ? 0 : Index(p * n), noise.shape(0) == 1 ? 0 : Index(p * p)},
            {Index(rows), slice(y), slice(drive)}};
}

bool is_empty_or(const MatrixOut& array, size_t rows, size_t columns) {
    return array.shape(0) == 0 || has_shape(array, rows, columns);
}

/// The filter with the number of states fixed where it is small.
auto filter_of_size(Index n) {
    switch (n) {
        case 1: return allanite::filter<1, double>;
        case 2: return allanite::filter<2, double>;
        case 3: return allanite::filter<3, double>;
        case 4: return allanite::filter<4, double>;
        default: return allanite::filter<allanite::any_size, double>;
    }
}

using allanite::n_counts;
using allanite::n_sums;

/// Shapes of what is carried from block to block.
void require_carried(size_t n, const VectorOut& state, const MatrixOut& covariance, const MatrixOut& directions,
                     const VectorOut& sums, const IntegersOut& counts) {
    require(state.size() == n && has_shape(covariance, n, n) && has_shape(directions, n, n),
            "state, covariance, directions: must have shapes (n,), (n, n), (n, n)");
    require(sums.size() == n_sums && counts.size() == n_counts, "sums, counts: must have shapes (4,) and (6,)");
    require(0 <= counts(2) && counts(2) <= int64_t(n), "counts: the diffuse rank must be between 0 and n");
}

void kalman_filter(const Matrix& transition, const Matrix& process, const Cube& output, const Cube& noise,
                   const Matrix& y, const Matrix& drive, const Matrix& readout, const VectorOut& state,
                   const MatrixOut& covariance, const MatrixOut& directions, const VectorOut& sums,
                   const IntegersOut& counts, const MatrixOut& means, const MatrixOut& sds,
                   const MatrixOut& innovations, const MatrixOut& variances, bool square_root) {
    const auto [model, rows] = problem(transition, process, output, noise, y, drive);
    const size_t n = size_t(model.states), p = size_t(model.components), count = y.shape(0), g = readout.shape(0);
    require(readout.shape(1) == n, "readout: must have shape (g, n)");
    require_carried(n, state, covariance, directions, sums, counts);
    require(is_empty_or(means, count, g) && is_empty_or(sds, count, g), "means, sds: must have shape (0 or rows, g)");
    require(is_empty_or(innovations, count, p) && is_empty_or(variances, count, p),
            "innovations, variances: must have shape (0 or rows, p)");
    Scratch scratch(allanite::filter_scratch(model.states, model.components));
    allanite::FilterState<double> carried{slice(state), slice(covariance), {slice(directions), Index(counts(2))},
                                          allanite::likelihood_in(sums.data(), counts.data())};
    bool done = false;
    {
        nb::gil_scoped_release unlocked;
        const allanite::FilterOutput<double> out{Index(g),   slice(readout),     slice(means),
                                                 slice(sds), slice(innovations), slice(variances)};
        done = filter_of_size(model.states)(model, square_root, rows, carried, out, {}, scratch.slice);
    }
    require(done, "process: not positive semidefinite");
    allanite::keep(carried.likelihood, carried.directions.rank, sums.data(), counts.data());
}

/// A kernel for the machine instructions that this processor has, or the one for all. Both give the same digits.
#ifdef ALLANITE_WITH_AVX2
#define ALLANITE_KERNEL(name, portable) \
    (!(portable) && __builtin_cpu_supports("avx2") ? name##_for_avx2 : name##_for_all)
#else
#define ALLANITE_KERNEL(name, portable) ((void)(portable), name##_for_all)
#endif

void lagged_products(const Vector& x, Index first, const VectorOut& out, bool portable) {
    require(0 <= first && first <= Index(x.size()), "first: must be between 0 and len(x)");
    nb::gil_scoped_release unlocked;
    ALLANITE_KERNEL(lagged_products, portable)(x.data(), ptrdiff_t(x.size()), first, out.data(), ptrdiff_t(out.size()));
}

/// The constant model and the steps of its covariance, checked.
GainFilterCall gain_filter_call(const Matrix& transition, const Matrix& process, const Vector& output, double noise,
                                const Cube& a, const Cube& g, const Cube& h) {
    const size_t n = output.size();
    require(has_shape(transition, n, n) && has_shape(process, n, n),
            "transition, process: must have shape (n, n), n = len(output)");
    for (const Cube* steps : {&a, &g, &h}) {
        require(steps->shape(0) == a.shape(0) && steps->shape(1) == n && steps->shape(2) == n && a.shape(0) <= 32,
                "a, g, h: must have shape (steps, n, n), with 32 steps at most");
    }
    GainFilterCall call{};
    call.states = ptrdiff_t(n);
    call.steps = ptrdiff_t(a.shape(0));
    call.noise = noise;
    call.transition = transition.data();
    call.process = process.data();
    call.output = output.data();
    call.a = a.data();
    call.g = g.data();
    call.h = h.data();
    return call;
}

void kalman_drift(const Matrix& transition, const Matrix& process, const Vector& output, double noise, const Cube& a,
                  const Cube& g, const Cube& h, const Vector& y, const Vector& drift, const Matrix& readout,
                  Index first, Index step, const VectorOut& state, const MatrixOut& covariance,
                  const MatrixOut& directions, const VectorOut& sums, const IntegersOut& counts,
                  const VectorOut& drift_mean, const VectorOut& drift_sd, const VectorOut& standardized,
                  const MatrixOut& means, const MatrixOut& sds, bool square_root, bool portable) {
    auto call = gain_filter_call(transition, process, output, noise, a, g, h);
    const size_t n = output.size(), rows = y.size(), readouts = readout.shape(0);
    require(drift.size() == n && readout.shape(1) == n, "drift, readout: must have shapes (n,) and (g, n)");
    require(drift_mean.size() == rows && drift_sd.size() == rows && standardized.size() == rows,
            "drift_mean, drift_sd, standardized: must be as long as y");
    require(first >= 0 && step > 0, "first, step: first must not be negative, step must be positive");
    const size_t instants = Index(rows) > first ? size_t((Index(rows) - first - 1) / step + 1) : 0;
    require(has_shape(means, instants, readouts) && has_shape(sds, instants, readouts),
            "means, sds: must have one row for each of first, first + step ... below len(y), and g columns");
    require_carried(n, state, covariance, directions, sums, counts);
    Scratch scratch(gain_filter_scratch_of(call.states, Index(readouts)));
    call.rows = ptrdiff_t(rows);
    call.readouts = ptrdiff_t(readouts);
    call.first = first;
    call.step = step;
    call.instants = ptrdiff_t(instants);
    call.square_root = square_root;
    call.y = y.data();
    call.drift = drift.data();
    call.readout = readout.data();
    call.state = state.data();
    call.covariance = covariance.data();
    call.directions = directions.data();
    call.sums = sums.data();
    call.counts = counts.data();
    call.drift_mean = drift_mean.data();
    call.drift_sd = drift_sd.data();
    call.standardized = standardized.data();
    call.means = means.data();
    call.sds = sds.data();
    call.scratch = scratch.slice.data;
    bool done = false;
    {
        nb::gil_scoped_release unlocked;
        done = ALLANITE_KERNEL(gain_filter, portable)(call);
    }
    require(done, "process: not positive semidefinite");
}

void kalman_draw(const Matrix& transition, const Matrix& process, const Vector& output, double noise, const Cube& a,
                 const Cube& g, const Cube& h, const VectorOut& state, const MatrixOut& covariance,
                 const VectorOut& samples, bool portable) {
    auto call = gain_filter_call(transition, process, output, noise, a, g, h);
    const size_t n = output.size();
    require(state.size() == n && has_shape(covariance, n, n), "state, covariance: must have shapes (n,) and (n, n)");
    Scratch scratch(gain_filter_scratch_of(call.states, 0));
    double sums[n_sums] = {1.0, 0.0, 0.0, 1.0};
    int64_t counts[n_counts] = {};
    call.rows = ptrdiff_t(samples.size());
    call.draws = true;
    call.y = call.made = samples.data();
    call.state = state.data();
    call.covariance = covariance.data();
    call.sums = sums;
    call.counts = counts;
    call.scratch = scratch.slice.data;
    nb::gil_scoped_release unlocked;
    ALLANITE_KERNEL(gain_filter, portable)(call);
}

std::pair<double, double> kalman_likelihood(const Vector& sums, const Integers& counts) {
    require(sums.size() == n_sums && counts.size() == n_counts, "sums, counts: must have shapes (4,) and (6,)");
    const auto likelihood = allanite::likelihood_in(sums.data(), counts.data());
    return {allanite::log_likelihood(likelihood), allanite::log_of(likelihood.diffuse_variances)};
}

bool kalman_strands(const Matrix& transition, const Matrix& process, const std::array<Matrix, 4>& output,
                    const std::array<Vector, 4>& noise, const std::array<Vector, 4>& y, const MatrixOut& numbers,
                    const IntegersOut& counters, bool square_root, bool portable) {
    const size_t n = transition.shape(0), rows = y[0].size(), outputs = output[0].shape(0), noises = noise[0].size();
    require(1 <= n && Index(n) <= strands_most_states, "transition: the states must be 1 to 4");
    require(has_shape(transition, n, n) && has_shape(process, n, n), "transition, process: must have shape (n, n)");
    require(has_shape(numbers, size_t(allanite::strand_numbers(Index(n))), 4) && counters.size() == 8,
            "numbers, counters: must have shapes (1 + n + 2 n**2 + (n + 1)**2, 4) and (8,)");
    StrandsCall call{};
    for (size_t l = 0; l < 4; ++l) {
        require(y[l].size() == rows, "y: must be of one length");
        require((outputs == 1 || outputs == rows) && has_shape(output[l], outputs, n),
                "output: must have shape (1, n) or (rows, n)");
        require((noises == 1 || noises == rows) && noise[l].size() == noises, "noise: must have shape (1,) or (rows,)");
        call.y[l] = y[l].data();
        call.output[l] = output[l].data();
        call.noise[l] = noise[l].data();
    }
    Scratch scratch(allanite::strand_scratch(Index(n)));
    call.states = ptrdiff_t(n);
    call.rows = ptrdiff_t(rows);
    call.output_step = outputs == 1 ? 0 : ptrdiff_t(n);
    call.noise_step = noises == 1 ? 0 : 1;
    call.square_root = square_root;
    call.transition = transition.data();
    call.process = process.data();
    call.numbers = numbers.data();
    call.counters = counters.data();
    call.scratch = scratch.slice.data;
    nb::gil_scoped_release unlocked;
    return ALLANITE_KERNEL(strands, portable)(call);
}

bool kalman_factor(const MatrixOut& covariance) {
    const size_t n = covariance.shape(0);
    require(has_shape(covariance, n, n), "covariance: must have shape (n, n)");
    Scratch scratch{Index(n)};
    return allanite::factor(slice(covariance), Index(n), scratch.slice);
}

void kalman_compose(const MatrixOut& factors) {
    const size_t n = factors.shape(0);
    require(has_shape(factors, n, n), "factors: must have shape (n, n)");
    allanite::compose(slice(factors), Index(n));
}

void kalman_smooth(const Matrix& transition, const Matrix& process, const Cube& output, const Cube& noise,
                   const Matrix& y, const Matrix& drive, const Matrix& readout, const Vector& state,
                   const Matrix& covariance, const Matrix& directions, Index rank, Index final_rank,
                   const VectorOut& gradient, const MatrixOut& information, const MatrixOut& means,
                   const MatrixOut& sds, bool square_root) {
    const auto [model, rows] = problem(transition, process, output, noise, y, drive);
    const Index n = model.states, p = model.components;
    const size_t size = size_t(n), count = y.shape(0), g = readout.shape(0);
    require(readout.shape(1) == size, "readout: must have shape (g, n)");
    require(state.size() == size && has_shape(covariance, size, size) && has_shape(directions, size, size),
            "state, covariance, directions: must have shapes (n,), (n, n), (n, n)");
    require(gradient.size() == size && has_shape(information, size, size),
            "gradient, information: must have shapes (n,) and (n, n)");
    require(0 <= rank && rank <= n && 0 <= final_rank && final_rank <= n,
            "rank, final_rank: must be between 0 and n");
    require(has_shape(means, count, g) && has_shape(sds, count, g), "means, sds: must have shape (rows, g)");
    Scratch scratch(allanite::filter_scratch(n, p) + allanite::smoother_scratch(n) +
                    allanite::transition_numbers(n) + n + 2 * n * n);
    Scratch numbers(allanite::trace_numbers(rows.count, n, p, rank > 0));
    bool done = false;
    {
        nb::gil_scoped_release unlocked;
        done = allanite::filter_and_smooth(filter_of_size(n), model, square_root, rows,
                                           {slice(state), slice(covariance), slice(directions)}, rank, final_rank,
                                           {slice(gradient), slice(information)}, slice(readout), slice(means),
                                           slice(sds), numbers.slice, scratch.slice);
    }
    require(done, "process: not positive semidefinite");
}

}  // namespace

NB_MODULE(_kernels, m) {
    m.doc() = "Compiled kernels. Arrays are float64 or int64, C-contiguous, and never converted here.";

    m.def("integrate", &integrate, "block"_a.noconvert(), "offset"_a, "start"_a, "out"_a.noconvert(),
          "Phase of one block of rate samples: out[i] = start + sum of (block[k] - offset), k <= i.\n\n"
          "A missing sample (NaN, infinite, or 9.9e37 and beyond) adds nothing. Returns the last value: the start\n"
          "of the next block. Cutting the record into other blocks gives the same digits.");
    m.def("missing_runs", &missing_runs, "block"_a.noconvert(), "start"_a,
          "Half-open runs of missing samples, shape (k, 2); `start` is the index of block[0] in the record.");
    m.def("difference_squares", &difference_squares, "phase"_a.noconvert(), "order"_a, "lags"_a.noconvert(),
          "runs"_a.noconvert(), "run_offsets"_a.noconvert(), "first_block"_a, "last_block"_a, "block"_a,
          "Sums of squared differences, shape (last_block - first_block, n_lags).\n\n"
          "order 2: second differences (Allan), window 2m samples; order 3: third differences (Hadamard), 3m.\n"
          "runs[run_offsets[l]:run_offsets[l + 1]] are the half-open, sorted runs of starts whose window is complete\n"
          "at lag l; block b holds the starts [b * block, (b + 1) * block). A sum depends on its block and lag alone.");
    m.def("modified_squares", &modified_squares, "phase"_a.noconvert(), "lag"_a, "runs"_a.noconvert(),
          "Sum over the starts of `runs` of (mean of `lag` adjacent second differences)**2.\n\n"
          "The window of a start holds 3 lag - 1 samples.");
    m.def("total_squares", &total_squares, "phase"_a.noconvert(), "lag"_a,
          "Sum of squared second differences of the reflected phase over the centres 1..n-1. No gaps.");
    m.def("theo_squares", &theo_squares, "head"_a.noconvert(), "tail"_a.noconvert(), "depth"_a,
          "runs"_a.noconvert(),
          "Theo1: sum over the windows of `runs` and d = 1..depth of\n"
          "((tail[i+depth] - tail[i+depth-d]) - (head[i+d] - head[i]))**2 / d. For the phase itself depth = m/2 and\n"
          "tail = phase[m - depth:]; for every s-th point of it head = phase[::s], tail = phase[m - s * depth::s].");
    m.def("biweight_sums", &biweight_sums, "phase"_a.noconvert(), "lag"_a, "runs"_a.noconvert(), "scale"_a, "cut"_a,
          "Sums of psi(u) and u psi'(u), psi(u) = u (1 - u/cut)**4 below the cut and 0 above, over the second\n"
          "differences d of `runs`, u = d**2 / scale.");
    m.def("curve_weight", &curve_weight, "relative"_a.noconvert(), "discrepancy"_a, "least"_a,
          "Weights of the moment fit for one record: inverse factor of the covariance of the cube roots, lower\n"
          "triangular (n_lags, n_lags), their means (n_lags,), and the logarithm of its determinant, NaN where it has no\n"
          "factor. `relative`: covariance of the variances over the products of their means; `discrepancy`: relative\n"
          "error of the model at each lag; `least`: lower bound on the degrees of freedom of a lag.");
    m.def("curve_levels", &curve_levels, "variance"_a.noconvert(), "means"_a.noconvert(), "weights"_a.noconvert(),
          "parts"_a.noconvert(), "tables"_a.noconvert(), "discrepancy"_a, "least"_a,
          "Minus twice the log-likelihood of a curve under many models, up to a constant, (n_models,); infinite where a\n"
          "covariance has no factor. `means` (n_models, n_lags); the covariance of a model is the sum of its `weights`\n"
          "(n_models, n_parts) times the `parts` (n_tables, n_parts, n_lags, n_lags) of its table; `tables` (n_models,);\n"
          "the rest as for `curve_weight`.");
    m.def("curve_step", &curve_step, "variance"_a.noconvert(), "columns"_a.noconvert(), "here"_a.noconvert(),
          "means"_a.noconvert(), "whiten"_a.noconvert(), "starts"_a.noconvert(), "centre"_a.noconvert(),
          "Newton step of the moment fit from the coefficients `here` (p,), whose means are `means` (n_lags,), to the\n"
          "non-negative minimum of the quadratic part of r'r + 2/3 sum(log(means)), with\n"
          "r = whiten @ (cbrt(variance / means) - centre); columns (n_lags, p): change of the means. Gauss-Newton\n"
          "where that is not convex, zeros where nothing shows a way. whiten (n_lags, width): row i holds the columns from\n"
          "starts[i] to i of a lower triangular matrix; starts (n_lags,) are zeros for one record.");
    m.def("curve_minimum", &curve_minimum, "variance"_a.noconvert(), "columns"_a.noconvert(), "rest"_a.noconvert(),
          "here"_a.noconvert(), "whiten"_a.noconvert(), "starts"_a.noconvert(), "centre"_a.noconvert(), "steps"_a,
          "settled"_a,
          "Coefficients, none negative, at which means = rest + columns @ x minimise what curve_step() is of: at most\n"
          "`steps` steps from `here`, each halved until it does not climb, until one gains less than `settled`.");
    m.def("gamma_tails", &gamma_tails, "shape"_a.noconvert(), "x"_a.noconvert(),
          "Regularised incomplete gamma functions P(shape, x) and Q(shape, x) = 1 - P, the rows of (2, n).");
    m.def("gamma_quantiles", &gamma_quantiles, "shape"_a.noconvert(), "tail"_a.noconvert(), "upper"_a,
          "x at which P(shape, x), or Q with `upper`, equals `tail`; shape (n,).");
    m.def("window_pairs", &window_pairs, "lengths"_a.noconvert(), "offsets"_a.noconvert(), "distance"_a.noconvert(),
          "spike"_a, "linear"_a, "cubic"_a, "exponential"_a, "rate"_a,
          "Covariance of second differences over m1 and m2 samples of a phase of generalised covariance\n"
          "S(t) = spike [t = 0] + linear |t| + cubic |t|**3 + exponential (exp(-u) + u), u = rate |t|:\n"
          "sum over i, j of w[i] w[j] S(k + j m2 - i m1) / (2 m1 m2), w = (1, -2, 1), at every distance k.\n\n"
          "lengths (n_pairs, 2): m1 <= m2. distance[offsets[p]:offsets[p + 1]] are those of pair p; offsets\n"
          "(n_pairs + 1). Constants and t**2 in S cancel.");
    m.def("power_window_pairs", &power_window_pairs, "lengths"_a.noconvert(), "offsets"_a.noconvert(),
          "distance"_a.noconvert(), "exponents"_a.noconvert(),
          "The same for S(t) = |t|**(2 + e) of several exponents e between -1 and 1, shape (n_exponents, n_distances);\n"
          "t**2 log|t| where e is 0. Windows more than fifty lengths apart: by the fourth derivative.");
    m.def("pairs_in_runs", &pairs_in_runs, "first"_a.noconvert(), "second"_a.noconvert(), "distance"_a.noconvert(),
          "How many positions i of the runs `first` have i + k in the runs `second`, at every distance k, linear between\n"
          "whole k. Runs: begin and end of each, none empty, rising, none touching the next, shape (n, 2).");
    m.def("pool_likelihood", &pool_likelihood, "c"_a.noconvert(), "rows"_a.noconvert(), "pools"_a.noconvert(),
          "moments"_a.noconvert(), "values"_a.noconvert(), "tilts"_a.noconvert(), "slope"_a, "averaged"_a,
          "Minus twice the log-likelihood of pools of vectors and of single values, less constants; the slope of a ramp\n"
          "and the information on it; the gradient with each row (one vector); and the expected information (matrix).\n"
          "Infinity and zeros where a covariance is not positive definite.\n\n"
          "c (n): variance coefficients. rows (size >= n, width): what each coefficient, and whatever else, changes the\n"
          "covariances (d * d) of the pools and the variances of the values by, side by side. pools (P, 3): components\n"
          "d, how many of the last are given, number of vectors. moments: of each pool mean (d), what a ramp makes of it\n"
          "(d), second moments (d * d). slope: NaN for the best; the likelihood is then the mean over all if `averaged`.");
    m.def("online_allan_size", &online_allan_size, "lags"_a.noconvert(), "order"_a = 2, "positions"_a = 64,
          "block"_a = 1024,
          "Lengths of the two arrays of a state: `numbers` (float64) and `counters` (int64). Begin with zeros.\n\n"
          "lags: rising; each below 2 * positions, or q * 2**k with q in [positions, 2 * positions). A lag is never\n"
          "rounded: one that does not fit is refused. order as in difference_squares().");
    m.def("online_allan_feed", &online_allan_feed, "numbers"_a.noconvert(), "counters"_a.noconvert(),
          "lags"_a.noconvert(), "order"_a, "positions"_a, "block"_a, "samples"_a.noconvert(), "offset"_a,
          "Take in the next rate samples, missing ones included: one pass, fixed memory, any chunking, same digits.\n\n"
          "`offset` is removed from each sample; it must stay the same for the whole record.");
    m.def("online_allan_read", &online_allan_read, "numbers"_a.noconvert(), "counters"_a.noconvert(),
          "lags"_a.noconvert(), "order"_a, "positions"_a, "block"_a,
          "Sums of squared differences so far and how many there are, per lag. Changes nothing.\n\n"
          "A lag of level k = max(0, floor(log2(lag / positions))) has one start per 2**k samples. Sums and counts of\n"
          "separate pieces of a record, or of several records, simply add.");
    m.def("lagged_products", &lagged_products, "x"_a.noconvert(), "first"_a, "out"_a.noconvert(), "portable"_a = false,
          "out[j] = sum of x[i] * x[i - j] over i >= max(first, j), for j = 0 ... len(out) - 1.\n\n"
          "portable: as in kalman_strands().");
    m.def("markov_noise", &markov_noise, "normals"_a.noconvert(), "phi"_a.noconvert(), "step_sd"_a.noconvert(),
          "weight_now"_a.noconvert(), "weight_next"_a.noconvert(), "state"_a.noconvert(), "out"_a.noconvert(),
          "Add a weighted sum of first-order Markov states to `out`, in place.\n\n"
          "s_j(k+1) = phi[j] * s_j(k) + step_sd[j] * normals[k, j];\n"
          "out[k] += sum over j of weight_now[j] * s_j(k) + weight_next[j] * s_j(k+1).\n"
          "phi = 1 is a random walk. `state` holds s(0) before and s(n) after the call.");
    m.def("whiten", &whiten, "transition"_a.noconvert(), "process"_a.noconvert(), "output"_a.noconvert(),
          "noise"_a.noconvert(), "covariance"_a.noconvert(), "state"_a.noconvert(), "columns"_a.noconvert(),
          "out"_a.noconvert(),
          "Filter c columns with the gain of one covariance recursion: out = innovation / sqrt(S), row by row.\n\n"
          "State-space model s' = F s + w, y = h s + v: transition F (n, n), process Cov w (n, n), output h (n,),\n"
          "noise Var v of each row. covariance (n, n) and state (n, c), in and out: prediction for the first row\n"
          "before the call, for the row after the last behind it. A row whose noise or a sample of which is NaN or\n"
          "infinite is missing: NaN in `out`, predict only. `out` may be `columns`. Returns the sum of ln S over the\n"
          "rows that are present; NaN if a noise is negative or an S is not positive.");
    m.def("kalman_filter", &kalman_filter, "transition"_a.noconvert(), "process"_a.noconvert(),
          "output"_a.noconvert(), "noise"_a.noconvert(), "y"_a.noconvert(), "drive"_a.noconvert(),
          "readout"_a.noconvert(), "state"_a.noconvert(), "covariance"_a.noconvert(), "directions"_a.noconvert(),
          "sums"_a.noconvert(), "counts"_a.noconvert(), "means"_a.noconvert(), "sds"_a.noconvert(),
          "innovations"_a.noconvert(), "variances"_a.noconvert(), "square_root"_a,
          "Filter a block of rows: y = H s + v, Cov v = noise; s' = F s + drive + w, Cov w = process.\n\n"
          "output (1 or rows, p, n) and noise (1 or rows, p, p): constant or one for each row. y (rows, p): NaN and\n"
          "infinite are missing. drive (rows, n), or (0, n) for none. readout (g, n).\n"
          "Carried, in and out, so that the cuts into blocks leave no trace: state (n,) and covariance (n, n), the\n"
          "prediction for the next row (square_root: the factors of the covariance, see kalman_factor());\n"
          "directions (n, n), the first counts[2] rows span what is still diffuse;\n"
          "sums (4,) = [1, 0, 0, 1] before the first row: mantissa of the product of S, sum of v**2 / S and what it\n"
          "could not hold, mantissa of the product of F_inf;\n"
          "counts (6,) = [0, 0, diffuse rank, 0, 0, 0] before the first row: proper innovations (scalars), exponent\n"
          "of the product of S, diffuse rank left, diffuse updates, exponent of the product of F_inf, measurements\n"
          "skipped because R < 0 or S is not positive.\n"
          "Out, each with no rows if it is not wanted: means and sds (rows, g) of readout @ s after the update of the\n"
          "row (NaN and infinite where it is still diffuse); innovations and variances (rows, p), each component\n"
          "given those before it, decorrelated if noise is not diagonal (NaN, NaN if missing or skipped; NaN,\n"
          "infinite in a diffuse update). ValueError if square_root and process is not positive semidefinite.");
    m.def("kalman_drift", &kalman_drift, "transition"_a.noconvert(), "process"_a.noconvert(), "output"_a.noconvert(),
          "noise"_a, "a"_a.noconvert(), "g"_a.noconvert(), "h"_a.noconvert(), "y"_a.noconvert(),
          "drift"_a.noconvert(), "readout"_a.noconvert(), "first"_a, "step"_a, "state"_a.noconvert(),
          "covariance"_a.noconvert(), "directions"_a.noconvert(), "sums"_a.noconvert(), "counts"_a.noconvert(),
          "drift_mean"_a.noconvert(), "drift_sd"_a.noconvert(), "standardized"_a.noconvert(), "means"_a.noconvert(),
          "sds"_a.noconvert(), "square_root"_a, "portable"_a = false,
          "Filter a block of samples of a constant model: y = h s + v, Var v = noise; s' = F s + w, Cov w = process.\n\n"
          "a, g, h (steps, n, n): the covariance over 2**j rows, P' = h[j] + a[j].T @ P @ inv(1 + g[j] @ P) @ a[j].\n"
          "With six steps or more the gain is taken from polynomials between gaps, exact to 1e-10 of itself; without\n"
          "steps, and in the square-root form, each row has its own covariance.\n"
          "Carried, in and out: state, covariance, directions, sums and counts as in kalman_filter().\n"
          "Out, after the update of a row: mean and standard deviation of drift @ s at each row, of readout (g, n) @ s\n"
          "at the rows first, first + step, ...; standardized: innovation / sqrt(S), NaN where there is none.\n"
          "ValueError if square_root and process is not positive semidefinite. portable: as in kalman_strands().");
    m.def("kalman_draw", &kalman_draw, "transition"_a.noconvert(), "process"_a.noconvert(), "output"_a.noconvert(),
          "noise"_a, "a"_a.noconvert(), "g"_a.noconvert(), "h"_a.noconvert(), "state"_a.noconvert(),
          "covariance"_a.noconvert(), "samples"_a.noconvert(), "portable"_a = false,
          "Normal numbers become samples of a constant model, in place: each is the innovation of its sample, over\n"
          "its standard deviation, so one number a sample is enough whatever the number of states.\n\n"
          "Model and steps as in kalman_drift(). Carried, in and out: state (n,) and covariance (n, n), the prediction\n"
          "for the next row.");
    m.def("kalman_likelihood", &kalman_likelihood, "sums"_a.noconvert(), "counts"_a.noconvert(),
          "Log-likelihood of the proper innovations, -ln(2 pi)/2 each included, and the sum of ln F_inf of the\n"
          "diffuse updates (which means something once the diffuse rank is 0), from the sums and counts of\n"
          "kalman_filter().");
    m.def("kalman_strands", &kalman_strands, "transition"_a.noconvert(), "process"_a.noconvert(),
          "output"_a.noconvert(), "noise"_a.noconvert(), "y"_a.noconvert(), "numbers"_a.noconvert(),
          "counters"_a.noconvert(), "square_root"_a, "portable"_a = false,
          "Filter a block of rows of four stretches of a record side by side, each from a guess of its first state.\n\n"
          "One to four states, scalar measurements, nothing diffuse. output, noise and y: four arrays each, of shapes\n"
          "(1 or rows, n), (1 or rows,) and (rows,); NaN and infinite samples are missing.\n"
          "Carried, in and out, numbers (1 + n + 2 n**2 + (n + 1)**2, 4), a column for each strand: state (n),\n"
          "covariance (n * n; square_root: its factors), effect of an error of the guess on the state (n * n, column\n"
          "by column), upper half of the sums of products of innovation and effects on it, over S ((n + 1)**2),\n"
          "mantissa of the product of S (1). Before the first row: guess, zeros, unit matrix, zeros, 1.\n"
          "counters (8,), zeros before the first row: four exponents of the product of S, four counts of innovations.\n"
          "False, and what is carried is spoilt, where a noise is not positive, an output is not finite, an innovation\n"
          "has no variance or process is not positive semidefinite. portable: without the instructions that not every\n"
          "processor has; the digits are the same.");
    m.def("kalman_factor", &kalman_factor, "covariance"_a.noconvert(),
          "P becomes U and D of P = U D U', in place: D on the diagonal, the unit upper triangular U above it.\n\n"
          "False if P is not positive semidefinite; it is spoilt then.");
    m.def("kalman_compose", &kalman_compose, "factors"_a.noconvert(), "U and D become P = U D U', in place.");
    m.def("kalman_smooth", &kalman_smooth, "transition"_a.noconvert(), "process"_a.noconvert(),
          "output"_a.noconvert(), "noise"_a.noconvert(), "y"_a.noconvert(), "drive"_a.noconvert(),
          "readout"_a.noconvert(), "state"_a.noconvert(), "covariance"_a.noconvert(), "directions"_a.noconvert(),
          "rank"_a, "final_rank"_a, "gradient"_a.noconvert(), "information"_a.noconvert(), "means"_a.noconvert(),
          "sds"_a.noconvert(), "square_root"_a,
          "Smooth a block of rows; go through the blocks from the last to the first.\n\n"
          "The model, the rows and the readout as in kalman_filter(); state, covariance, directions and rank\n"
          "(= counts[2]) as they were before the block, final_rank as it is behind the last row of the record.\n"
          "gradient (n,) and information (n, n): zeros before the last block, then in and out. means and sds\n"
          "(rows, g) of readout @ s given the whole record (NaN and infinite where it does not tell).");
}
