// SPDX-License-Identifier: BSD-3-Clause
// The filter, the smoother and the whitening without Python, under sanitizers and with every slice access checked:
// all sizes, both forms, every kind of row. Values are checked against NumPy and batch solutions elsewhere.
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "allanite/gain_filter.hpp"
#include "allanite/lagged.hpp"
#include "allanite/smoother.hpp"
#include "allanite/strands.hpp"
#include "allanite/whiten.hpp"

using namespace allanite;

namespace {

template <class Scalar>
using Reals = std::vector<Scalar>;

int passed = 0, failed = 0;

void check(bool condition, const char* what) {
    ++(condition ? passed : failed);
    if (!condition) std::printf("FAILED: %s\n", what);
}

template <class Scalar>
bool near(Scalar a, Scalar b, double tolerance) {
    return std::fabs(double(a) - double(b)) <= tolerance * (1.0 + std::fabs(double(b)));
}

template <class Scalar>
bool near(const Reals<Scalar>& a, const Reals<Scalar>& b, double tolerance) {
    for (size_t i = 0; i < b.size(); ++i) {
        if (std::isfinite(b[i]) ? !near(a[i], b[i], tolerance) : std::isfinite(a[i])) return false;
    }
    return a.size() == b.size();
}

template <class Scalar>
Slice<Scalar> whole(Reals<Scalar>& v) {
    return {v.data(), Index(v.size())};
}

template <class Scalar>
Slice<const Scalar> whole(const Reals<Scalar>& v) {
    return {v.data(), Index(v.size())};
}

template <class Scalar>
constexpr Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();

/// Numbers between -1 and 1, the same in every run.
struct Numbers {
    unsigned state = 1;
    double next() {
        state = 1664525u * state + 1013904223u;
        return double(state >> 8) / double(1 << 23) - 1.0;
    }
};

/// A model of n states and its measurements: some missing, the noise correlated, the last row of F dense.
template <class Scalar>
struct Case {
    Index n, p, rows;
    Reals<Scalar> transition, process, output, noise, y, drive, readout;

    Case(Index states, Index components, Index count, bool is_diagonal) : n(states), p(components), rows(count) {
        Numbers numbers;
        const auto fill = [&](Index size) {
            Reals<Scalar> v;
            for (Index i = 0; i < size; ++i) v.push_back(Scalar(numbers.next()));
            return v;
        };
        const auto square = [&](Index size) {  // a covariance
            const Reals<Scalar> root = fill(size * size);
            Reals<Scalar> v(root.size());
            for (Index i = 0; i < size; ++i) {
                for (Index j = 0; j < size; ++j) {
                    for (Index k = 0; k < size; ++k) v[i * size + j] += root[i * size + k] * root[j * size + k];
                }
                v[i * size + i] += Scalar(0.5);
            }
            return v;
        };
        transition.assign(n * n, Scalar(0));
        for (Index i = 0; i < n; ++i) transition[i * n + i] = Scalar(1.0 - 0.1 * double(i));
        for (Index j = 0; !is_diagonal && j < n; ++j) transition[(n - 1) * n + j] = Scalar(numbers.next());
        process = square(n);
        output = fill(rows * p * n);
        noise = square(p);
        y = fill(rows * p);
        drive = fill(rows * n);
        readout = fill(2 * n);
        for (Index i = 0; i < rows * p; i += 5) y[i] = nan<Scalar>;
    }

    Model<Scalar> model() const {
        return {n, p, whole(transition), whole(process), whole(output), whole(noise), p * n, 0};
    }

    Rows<Scalar> part(Index first, Index count) const {
        return {count, whole(y).part(first * p, count * p), whole(drive).part(first * n, count * n)};
    }
};

/// A filter with its memory. `diffuse` directions are the first unit vectors.
template <class Scalar>
struct Filter {
    Reals<Scalar> x, p, directions, scratch, means, sds, innovations, variances;
    Index rank, n;
    Likelihood<Scalar> likelihood;

    Filter(const Case<Scalar>& c, bool square_root, Index diffuse)
        : x(c.n), p(c.n * c.n), directions(c.n * c.n), scratch(filter_scratch(c.n, c.p)), means(c.rows * 2),
          sds(c.rows * 2), innovations(c.rows * c.p), variances(c.rows * c.p), rank(diffuse), n(c.n) {
        for (Index i = 0; i < n; ++i) {
            p[i * n + i] = Scalar(i < diffuse ? 0 : 2);
            directions[i * n + i] = Scalar(i < diffuse ? 1 : 0);
        }
        if (square_root) check(factor(whole(p), n, whole(scratch).part(0, n)), "factors of the first covariance");
    }

    template <int N>
    void run(const Case<Scalar>& c, bool square_root, Index first, Index count) {
        FilterState<Scalar> state{whole(x), whole(p), {whole(directions), rank}, likelihood};
        Model<Scalar> model = c.model();
        model.output = model.output.part(first * c.p * n, count * c.p * n);
        const FilterOutput<Scalar> out{2, whole(c.readout), whole(means).part(first * 2, count * 2),
                                       whole(sds).part(first * 2, count * 2),
                                       whole(innovations).part(first * c.p, count * c.p),
                                       whole(variances).part(first * c.p, count * c.p)};
        const bool done = filter<N>(model, square_root, c.part(first, count), state, out, Trace<Scalar>{},
                                    whole(scratch));
        check(done, "filter");
        rank = state.directions.rank;
        likelihood = state.likelihood;
    }

    Reals<Scalar> covariance(bool square_root) const {
        Reals<Scalar> full = p;
        if (square_root) compose(whole(full), n);
        return full;
    }
};

template <class Scalar>
void same_digits(const Filter<Scalar>& a, const Filter<Scalar>& b, const char* what) {
    bool same = a.x == b.x && a.p == b.p && a.rank == b.rank && a.likelihood.squares == b.likelihood.squares &&
                a.likelihood.variances.mantissa == b.likelihood.variances.mantissa;
    check(same, what);
}

template <int N, class Scalar>
void forms_and_cuts(const Case<Scalar>& c, Index diffuse, double tolerance) {
    Filter<Scalar> plain(c, false, diffuse), factors(c, true, diffuse);
    plain.template run<any_size>(c, false, 0, c.rows);
    factors.template run<any_size>(c, true, 0, c.rows);
    check(near(factors.covariance(true), plain.covariance(false), tolerance), "both forms: covariance");
    check(near(factors.x, plain.x, tolerance), "both forms: state");
    check(near(factors.means, plain.means, tolerance) && near(factors.sds, plain.sds, tolerance),
          "both forms: readouts");
    check(near(log_likelihood(factors.likelihood), log_likelihood(plain.likelihood), tolerance),
          "both forms: likelihood");
    for (bool square_root : {false, true}) {
        Filter<Scalar> whole_record(c, square_root, diffuse), cut(c, square_root, diffuse);
        whole_record.template run<N>(c, square_root, 0, c.rows);
        cut.template run<N>(c, square_root, 0, 1);
        cut.template run<N>(c, square_root, 1, 0);
        cut.template run<N>(c, square_root, 1, c.rows - 1);
        same_digits(whole_record, cut, "cuts leave no trace");
        check(near(whole_record.x, plain.x, tolerance), "fixed size: state");
    }
}

/// Smoothing in two blocks equals smoothing in one; at the last row it is the filter.
template <class Scalar>
void smoothing(const Case<Scalar>& c, Index diffuse, bool square_root, double tolerance) {
    Filter<Scalar> filtered(c, square_root, diffuse);
    const Filter<Scalar> start = filtered;
    Reals<Scalar> means[2], sds[2];
    Filter<Scalar> middle = start;
    middle.template run<any_size>(c, square_root, 0, 7);
    filtered.template run<any_size>(c, square_root, 0, c.rows);
    for (int cut = 0; cut < 2; ++cut) {
        Reals<Scalar> r(c.n), information(c.n * c.n);
        means[cut].resize(c.rows * 2);
        sds[cut].resize(c.rows * 2);
        const auto block = [&](const Filter<Scalar>& from, Index first, Index count) {
            Model<Scalar> model = c.model();
            model.output = model.output.part(first * c.p * c.n, count * c.p * c.n);
            Reals<Scalar> numbers(trace_numbers(count, c.n, c.p, from.rank > 0));
            Reals<Scalar> scratch(filter_scratch(c.n, c.p) + smoother_scratch(c.n) + transition_numbers(c.n) + c.n +
                                  2 * c.n * c.n);
            check(filter_and_smooth(filter<any_size, Scalar>, model, square_root, c.part(first, count),
                                    Checkpoint<Scalar>{whole(from.x), whole(from.p), whole(from.directions)},
                                    from.rank, filtered.rank, Future<Scalar>{whole(r), whole(information)},
                                    whole(c.readout), whole(means[cut]).part(first * 2, count * 2),
                                    whole(sds[cut]).part(first * 2, count * 2), whole(numbers), whole(scratch)),
                  "smoother");
        };
        if (cut == 1) block(middle, 7, c.rows - 7);
        block(start, 0, cut == 1 ? 7 : c.rows);
    }
    check(near(means[0], means[1], tolerance) && near(sds[0], sds[1], tolerance), "smoother: blocks");
    for (size_t i = means[0].size() - 2; i < means[0].size(); ++i) {
        check(near(means[0][i], filtered.means[i], tolerance) && near(sds[0][i], filtered.sds[i], tolerance),
              "smoother: at the last row it is the filter");
    }
}

template <int N, class Scalar>
void one_size(Index n, double tolerance) {
    for (Index p = 1; p <= 3; ++p) {
        for (bool is_diagonal : {false, true}) {
            const Case<Scalar> c(n, p, 20, is_diagonal || n == 0);
            for (Index diffuse = 0; diffuse <= (n < 3 ? n : 3); ++diffuse) {
                forms_and_cuts<N>(c, diffuse, tolerance);
                if (n == 0) continue;
                smoothing(c, diffuse, false, tolerance);
                smoothing(c, diffuse, true, tolerance);
            }
        }
    }
}

/// The local level of Koopman (1997), exact diffuse start.
template <int N, class Scalar>
void koopman(double tolerance) {
    for (bool square_root : {false, true}) {
        Case<Scalar> c(1, 1, 10, true);
        c.transition = {1};
        c.process = {Scalar(8.253)};
        c.noise = {Scalar(1.993)};
        c.output.assign(10, Scalar(1));
        c.y.assign(10, Scalar(1));
        c.y[0] = Scalar(10.2394);
        c.drive.assign(10, Scalar(0));
        c.readout = {1, 1};
        Filter<Scalar> f(c, square_root, 1);
        f.template run<N>(c, square_root, 0, 10);
        check(near(double(log_likelihood(f.likelihood)), -23.01632185093656111, tolerance), "Koopman: likelihood");
        check(f.likelihood.innovations == 9 && f.likelihood.diffuse_updates == 1, "Koopman: counts");
        check(near(double(f.means[18]), 1.000000927215463497, tolerance), "Koopman: last state");
        check(near(double(f.sds[18] * f.sds[18]), 1.659364779788760324, tolerance), "Koopman: last variance");
    }
}

/// Float follows double over a long stretch of the three-state filter of the seed.
void float_beside_double() {
    double sds[2] = {};
    const auto last_sd = [](auto scalar, bool square_root) {
        using Scalar = decltype(scalar);
        Case<Scalar> c(3, 1, 20000, true);
        c.transition = {Scalar(0.9997), 0, 0, 0, 1, 0, 0, 0, 1};
        c.process = {Scalar(1e-5), 0, 0, 0, Scalar(1e-9), 0, 0, 0, 0};
        c.noise = {Scalar(1)};
        for (Index k = 0; k < c.rows; ++k) {
            c.output[3 * k] = c.output[3 * k + 1] = Scalar(1);
            c.output[3 * k + 2] = Scalar(k / 960 % 2 == 0 ? 1 : -1);
        }
        c.drive.assign(c.drive.size(), Scalar(0));
        c.readout = {0, 0, 1, 1, 0, 0};
        Filter<Scalar> f(c, square_root, 0);
        f.template run<3>(c, square_root, 0, c.rows);
        return double(f.sds[f.sds.size() - 2]);
    };
    for (bool square_root : {false, true}) {
        sds[0] = last_sd(0.0, square_root);
        sds[1] = last_sd(0.0F, square_root);
        check(near(sds[1] / sds[0], 1.0, 2e-3), "float: sd after 20000 samples");
    }
}

/// Four strands of one case each, as their memory lies in arrays.
template <int N>
struct FourStrands {
    Reals<double> numbers, scratch;
    std::vector<int64_t> counters;
    StrandState state;

    FourStrands() : numbers(strand_numbers(N) * n_lanes), scratch(strand_scratch(N)), counters(2 * n_lanes) {
        state = strand_state(N, whole(numbers), {counters.data(), Index(counters.size())});
        for (Index l = 0; l < n_lanes; ++l) {
            for (Index i = 0; i < N; ++i) {
                state.x[i * n_lanes + l] = guess(i, l);
                state.effects[i * (N + 1) * n_lanes + l] = 1.0;
            }
            state.mantissa[l] = 1.0;
        }
    }

    static double guess(Index i, Index lane) { return double(i + 1) * double(lane) - 0.5; }

    bool run(const Case<double>& c, const StrandRows& rows, bool square_root) {
        const auto all = square_root ? strands<N, true> : strands<N, false>;
        return all(whole(c.transition), whole(c.process), rows, state, whole(scratch));
    }
};

/// Rows of four stretches of a case; the last stretch has samples of its own that are missing.
template <int N>
StrandRows rows_of(const Case<double>& c, Index first, Index count) {
    StrandRows rows{};
    rows.count = count;
    rows.output_step = N;
    for (Index l = 0; l < n_lanes; ++l) {
        rows.y[l] = whole(c.y).part(l * c.rows / n_lanes + first, count);
        rows.output[l] = whole(c.output).part((l * c.rows / n_lanes + first) * N, count * N);
        rows.noise[l] = whole(c.noise);
    }
    return rows;
}

/// The filter that starts from the guess as if it were certain; and from there with one state off by one, for E.
template <int N>
Filter<double> filter_from_guess(const Case<double>& c, Index lane, Index off, bool square_root) {
    Filter<double> f(c, false, 0);
    for (double& element : f.p) element = 0.0;
    for (Index i = 0; i < N; ++i) f.x[i] = FourStrands<N>::guess(i, lane) + (i == off ? 1.0 : 0.0);
    f.template run<any_size>(c, square_root, lane * c.rows / n_lanes, c.rows / n_lanes);
    return f;
}

/// Strands equal the filter from the same guess; an error of the guess acts as their effects and sums say.
template <int N>
void strands_beside_filter(bool is_diagonal, bool square_root) {
    Case<double> c(N, 1, 80, is_diagonal);
    c.drive.assign(c.drive.size(), 0.0);
    FourStrands<N> four;
    Index k = 0;
    for (Index count : {1, 0, 6, 13}) {
        check(four.run(c, rows_of<N>(c, k, count), square_root), "strands");
        k += count;
    }
    const auto at = [&](Slice<double> numbers, Index i, Index l) { return numbers[i * n_lanes + l]; };
    for (Index l = 0; l < n_lanes; ++l) {
        const auto exact = filter_from_guess<N>(c, l, -1, square_root);
        Reals<double> x, p;
        for (Index i = 0; i < N; ++i) x.push_back(at(four.state.x, i, l));
        for (Index i = 0; i < N * N; ++i) p.push_back(at(four.state.p, i, l));
        check(near(x, exact.x, 1e-12) && near(p, exact.p, 1e-12), "strands: state and covariance");
        const LogProduct<double> product{four.state.mantissa[l], four.state.exponent[l]};
        check(near(log_of(product), log_of(exact.likelihood.variances), 1e-12), "strands: variances");
        check(near(at(four.state.moments, 0, l), exact.likelihood.squares, 1e-12), "strands: squares");
        check(four.state.count[l] == exact.likelihood.innovations, "strands: count");
        for (Index j = 0; j < N; ++j) {
            const auto off = filter_from_guess<N>(c, l, j, square_root);
            for (Index i = 0; i < N; ++i) {
                check(near(at(four.state.effects, j * N + i, l), off.x[i] - exact.x[i], 1e-11), "strands: effects");
            }
            const double cross = at(four.state.moments, j + 1, l);
            const double own = at(four.state.moments, (j + 1) * (N + 1) + j + 1, l);
            check(near(off.likelihood.squares, exact.likelihood.squares - 2 * cross + own, 1e-10), "strands: sums");
        }
    }
}

template <int N>
void strands_of_any_kind() {
    for (bool is_diagonal : {false, true}) {
        for (bool square_root : {false, true}) strands_beside_filter<N>(is_diagonal, square_root);
    }
}

void refused_strands() {
    const double bad[] = {0.0, -1.0};
    for (double value : bad) {
        Case<double> c(2, 1, 8, true);
        c.noise = {value};
        FourStrands<2> four;
        check(!four.run(c, rows_of<2>(c, 0, 2), false), "strands: noise that is not positive");
    }
    Case<double> c(2, 1, 8, true);
    c.output[4] = nan<double>;
    FourStrands<2> four;
    check(!four.run(c, rows_of<2>(c, 0, 2), false), "strands: an output that is not a number");
    c.output[4] = 1e200;
    c.process = {1, 0, 0, -1};
    check(!four.run(c, rows_of<2>(c, 0, 2), true), "strands: process noise that is no covariance");
    LaneProducts products{Lanes(1.0), {four.counters.data(), n_lanes}};
    for (int i = 0; i < 10; ++i) check(multiply_lanes(products, Lanes::of(1e-300, 1e300, 2.0, 1.0)), "lanes: product");
    const LogProduct<double> small{products.mantissa[0], products.exponent[0]};
    check(near(log_of(small), 10 * std::log(1e-300), 1e-14), "lanes: product of small numbers");
    check(!multiply_lanes(products, Lanes::of(1.0, infinity<double>(), 1.0, 1.0)), "lanes: no variance");
}

/// A state without noise that died away thousands of rows ago leaves the others alone.
template <int N>
void a_state_that_died_away(bool is_diagonal) {
    Case<double> c(2, 1, 12000, is_diagonal);
    c.drive.assign(c.drive.size(), 0.0);
    c.transition = {0.95, 0, is_diagonal ? 0 : 0.1, 0.9};
    if (!is_diagonal) c.transition = {0.9, 0, 0.1, 0.9};
    c.process = {is_diagonal ? 0.1 : 0.0, 0, 0, is_diagonal ? 0.0 : 0.1};
    Filter<double> plain(c, false, 0), factors(c, true, 0);
    plain.template run<any_size>(c, false, 0, c.rows);
    factors.template run<N>(c, true, 0, c.rows);
    check(near(log_likelihood(factors.likelihood), log_likelihood(plain.likelihood), 1e-12), "died away: likelihood");
    check(near(factors.covariance(true), plain.covariance(false), 1e-12), "died away: covariance");
}

void products_of_many() {
    LogProduct<double> large, small;
    LogProduct<float> single;
    double sum = 0.0;
    for (int i = 0; i < 1000; ++i) {
        multiply(large, 1e300);
        multiply(small, 1e-300);
        multiply(single, 1e-30F);
        sum += std::log(1e300);
    }
    check(near(log_of(large), sum, 1e-14) && near(log_of(small), -sum, 1e-14), "product of large and small numbers");
    check(near(double(log_of(single)), -sum / 10, 1e-5), "product in float");
}

void refused_factors() {
    Reals<double> indefinite{1, 2, 2, 1}, singular{1, 1, 1, 1}, work(2);
    check(!factor(whole(indefinite), 2, whole(work)), "an indefinite matrix has no factors");
    check(factor(whole(singular), 2, whole(work)), "a singular one has");
    compose(whole(singular), 2);
    check(near(singular, Reals<double>{1, 1, 1, 1}, 1e-15), "and they compose to it");
}

void whitening() {
    const Case<double> c(3, 1, 20, false);
    for (Index columns = 1; columns <= 4; ++columns) {
        Reals<double> noise(c.rows, 0.5), series(c.rows * columns, 1.0), states(3 * columns), p(9);
        Reals<double> numbers(transition_numbers(3)), scratch(whiten_scratch(3, columns)), output{1, 0, 2};
        noise[4] = nan<double>;
        series[9 * columns] = nan<double>;
        const Whitening<double> w{split_transition(whole(c.transition), 3, whole(numbers)), whole(c.process),
                                  fixed(whole(output)), whole(p), whole(states), columns};
        const double sum = whiten(w, fixed(whole(noise)), fixed(whole(series)), whole(series), whole(scratch));
        check(std::isfinite(sum), "whitening: sum of logarithms");
        for (Index k = 0; k < c.rows; ++k) {
            check(std::isnan(series[k * columns]) == (k == 4 || k == 9), "whitening: missing rows");
            check(std::isnan(series[k * columns]) || series[k * columns] == series[k * columns + columns - 1],
                  "whitening: equal series stay equal");
        }
        noise[7] = -1.0;
        series.assign(series.size(), 1.0);
        check(std::isnan(whiten(w, fixed(whole(noise)), fixed(whole(series)), whole(series), whole(scratch))),
              "whitening: negative variance");
    }
}

/// One Markov state: the Riccati recursion over 2^j rows is one of numbers.
struct MarkovCase {
    static constexpr Index rows = 3000, levels = 8;
    Reals<double> transition{0.98}, process{0.02}, output{1.0}, noise{0.5}, a, g, h, y;
    Reals<double> drift_row{1.0}, readout{1.0, 2.0};

    MarkovCase() : y(rows) {
        double one_a = 0.98, one_g = 2.0, one_h = 0.02;
        for (Index j = 0; j < levels; ++j) {
            a.push_back(one_a);
            g.push_back(one_g);
            h.push_back(one_h);
            const double w = 1.0 / (1.0 + one_g * one_h), square = one_a * one_a * w;
            one_g += square * g.back();
            one_h += square * h.back();
            one_a = square;
        }
        Numbers numbers;
        for (double& sample : y) sample = numbers.next();
        y[1000] = y[1001] = nan<double>;
    }
};

struct DriftResult {
    Reals<double> drift, sd, standardized, means, sds, x{0.0}, p{0.5}, directions{0.0};
    Likelihood<double> likelihood;
};

template <int N>
DriftResult drift_of(const MarkovCase& c, Index levels) {
    constexpr Index rows = MarkovCase::rows, step = 70, instants = (rows - 5 - 1) / step + 1;
    DriftResult r;
    for (auto* row : {&r.drift, &r.sd, &r.standardized}) row->assign(rows, 0.0);
    for (auto* some : {&r.means, &r.sds}) some->assign(2 * instants, 0.0);
    const Model<double> model{1, 1, whole(c.transition), whole(c.process), whole(c.output), whole(c.noise), 0, 0};
    const RiccatiSteps steps{levels, whole(c.a), whole(c.g), whole(c.h)};
    FilterState<double> state{whole(r.x), whole(r.p), {whole(r.directions), 0}, {}};
    Reals<double> scratch(gain_filter_scratch(1, 2));
    const DriftOutput out{whole(r.drift), whole(r.sd), whole(r.standardized), 5, step, whole(r.means), whole(r.sds)};
    const bool done = gain_filter(gain_rows_of<N, false>(false), model, false, steps, whole(c.y), {nullptr, 0},
                                  whole(c.drift_row), whole(c.readout), state, out, whole(scratch));
    check(done, "gain from polynomials: done");
    r.likelihood = state.likelihood;
    return r;
}

template <int N>
void gain_from_polynomials() {
    const MarkovCase c;
    const auto exact = drift_of<N>(c, 0), fast = drift_of<N>(c, MarkovCase::levels);
    check(near(fast.drift, exact.drift, 1e-10) && near(fast.sd, exact.sd, 1e-10), "gain from polynomials: drift");
    check(near(fast.means, exact.means, 1e-10) && near(fast.sds, exact.sds, 1e-10), "gain from polynomials: readouts");
    check(near(fast.standardized, exact.standardized, 1e-10), "gain from polynomials: innovations");
    check(near(fast.x, exact.x, 1e-10) && near(fast.p, exact.p, 1e-10), "gain from polynomials: state");
    check(near(log_likelihood(fast.likelihood), log_likelihood(exact.likelihood), 1e-11),
          "gain from polynomials: likelihood");
    Reals<double> drawn = exact.standardized, x{0.0}, p{0.5}, none{0.0}, scratch(gain_filter_scratch(1, 0));
    drawn[1000] = drawn[1001] = 0.0;
    const Model<double> model{1, 1, whole(c.transition), whole(c.process), whole(c.output), whole(c.noise), 0, 0};
    FilterState<double> state{whole(x), whole(p), {whole(none), 0}, {}};
    gain_filter(gain_rows_of<N, true>(false), model, false, {MarkovCase::levels, whole(c.a), whole(c.g), whole(c.h)},
                fixed(whole(drawn)), whole(drawn), {nullptr, 0}, {nullptr, 0}, state, {}, whole(scratch));
    drawn.resize(1000);
    check(near(drawn, Reals<double>(c.y.begin(), c.y.begin() + 1000), 1e-10), "innovations give back their samples");
}

void products_of_a_series() {
    const MarkovCase c;
    Reals<double> out(21);
    lagged_products({c.y.data(), 1000}, 990, whole(out));
    double sum = 0.0;
    for (size_t i = 990; i < 1000; ++i) sum += c.y[i] * c.y[i - 20];
    check(near(out[20], sum, 1e-13), "lagged products");
}

}  // namespace

int main() {
    for (Index n = 0; n <= 5; ++n) one_size<any_size, double>(n, 1e-9);
    one_size<1, double>(1, 1e-9);
    one_size<3, double>(3, 1e-9);
    one_size<3, float>(3, 0.05);
    koopman<1, double>(1e-13);
    koopman<any_size, double>(1e-13);
    koopman<1, float>(3e-6);
    float_beside_double();
    strands_of_any_kind<1>();
    strands_of_any_kind<2>();
    strands_of_any_kind<3>();
    strands_of_any_kind<4>();
    refused_strands();
    for (bool is_diagonal : {false, true}) {
        a_state_that_died_away<2>(is_diagonal);
        a_state_that_died_away<any_size>(is_diagonal);
    }
    products_of_many();
    refused_factors();
    whitening();
    gain_from_polynomials<1>();
    gain_from_polynomials<any_size>();
    products_of_a_series();
    std::printf("%d passed, %d failed\n", passed, failed);
    return failed == 0 ? 0 : 1;
}
