// SPDX-License-Identifier: BSD-3-Clause
// The kernels without Python, under address and undefined-behaviour sanitizers and with every slice access checked.
// It walks each kernel to the edges of its windows; the values themselves are checked against NumPy elsewhere.
// Compiled with -ffast-math too, without the kernels that refuse it (ieee_only.hpp).
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "allanite/allan.hpp"
#include "allanite/biweight.hpp"
#include "allanite/noise.hpp"
#include "allanite/pairs_in_runs.hpp"
#include "allanite/theo.hpp"
#include "allanite/window_pairs.hpp"
#include "records.hpp"
#ifndef __FAST_MATH__
#include "allanite/curve_fit.hpp"
#include "allanite/gamma_law.hpp"
#endif

using namespace allanite;

namespace {

int passed = 0, failed = 0;

void check(bool condition, const char* what) {
    ++(condition ? passed : failed);
    if (!condition) std::printf("FAILED: %s\n", what);
}

bool near(double a, double b, double relative) { return std::fabs(a - b) <= relative * std::fabs(b); }

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Small integers, the same in every run.
Reals noise(Index n) {
    Reals y;
    unsigned state = 1;
    for (Index i = 0; i < n; ++i) {
        state = 1664525u * state + 1013904223u;
        y.push_back(double(state >> 24) - 128.0);
    }
    return y;
}

Reals phase_of(const Reals& y) {
    Reals x(y.size() + 1);
    if (!y.empty()) integrate(fixed(y), 0.0, 0.0, whole(x).part(1, Index(y.size())));
    return x;
}

/// Sum of squared differences at one lag of a record without gaps, block by block.
template <int order>
double squares(const Reals& y, Index lag, Index block) {
    const Reals x = phase_of(y);
    const Index starts = Index(y.size()) - order * lag + 1;
    const Integers lags{lag}, runs{0, starts}, offsets{0, 1};
    Reals sums(size_t((starts + block - 1) / block));
    difference_squares<order>(fixed(x), fixed(lags), fixed(runs), fixed(offsets), 0, block, whole(sums));
    double total = 0.0;
    for (double sum : sums) total += sum;
    return total;
}

void ten_points() {
    const Reals y{892, 809, 823, 798, 671, 644, 883, 903, 677}, x = phase_of(y);
    check(near(std::sqrt(squares<2>(y, 1, 4) / (2 * 8)), 91.22944974, 1e-9), "ten points: OADEV, m = 1");
    check(near(std::sqrt(squares<2>(y, 2, 4) / (8 * 6)), 85.95286984, 1e-9), "ten points: OADEV, m = 2");
    check(near(std::sqrt(squares<3>(y, 2, 4) / (24 * 4)), 85.61487166, 1e-9), "ten points: OHDEV, m = 2");
    check(near(std::sqrt(total_squares(fixed(x), 2) / (8 * 8)), 93.90379053, 1e-9), "ten points: TOTDEV, m = 2");
    const Integers runs{0, 5};
    check(near(std::sqrt(modified_squares(fixed(x), 2, fixed(runs)) / (8 * 5)), 74.78849343, 1e-9),
          "ten points: MDEV, m = 2");
}

void every_short_record_and_lag() {
    for (Index n = 1; n <= 40; ++n) {
        const Reals y = noise(n), x = phase_of(y);
        for (Index lag = 1; lag <= n; ++lag) {
            check(is_finite(total_squares(fixed(x), lag)), "total: any lag");
            if (2 * lag <= n) check(squares<2>(y, lag, n) == squares<2>(y, lag, 3), "blocks of integers add exactly");
            if (3 * lag <= n) check(squares<3>(y, lag, n) == squares<3>(y, lag, 3), "order 3: the same");
            if (3 * lag - 1 > n) continue;
            const Integers runs{0, n - 3 * lag + 2};
            check(is_finite(modified_squares(fixed(x), lag, fixed(runs))), "modified: up to the last window");
        }
    }
}

void inner_differences_and_biweight_to_the_last_window() {
    for (Index n = 4; n <= 40; ++n) {
        const Reals y = noise(n), x = phase_of(y);
        for (Index depth = 1; 2 * depth <= n; ++depth) {
            const Index m = 2 * depth, windows = n - m + 1;
            const Integers runs{0, windows};
            const auto tail = fixed(x).part(depth, Index(x.size()) - depth);
            double sum = 0.0;
            for (Index i = 0; i < windows; ++i) {
                for (Index d = 1; d <= depth; ++d) {
                    const double z = x[size_t(i + m)] - x[size_t(i + m - d)] - x[size_t(i + d)] + x[size_t(i)];
                    sum += z * z / double(d);
                }
            }
            check(near(theo_squares(fixed(x), tail, depth, fixed(runs)), sum, 1e-12), "Theo1: any window");
            const Integers starts{0, n - 2 * depth + 1};
            const BiweightSums all = biweight_sums(fixed(x), depth, fixed(starts), 1.0, 1e30);
            check(near(all.psi, squares<2>(y, depth, n), 1e-12), "biweight: far below the cut all squares count");
            check(biweight_sums(fixed(x), depth, fixed(starts), 1e-9, 1.0).slope == 0.0, "biweight: none above it");
        }
    }
}

void modified_begins_anew_without_a_seam() {
    const Reals y = noise(10000), x = phase_of(y);
    const Integers one{0, 9998}, two{0, 5000, 5000, 9998};
    check(near(modified_squares(fixed(x), 1, fixed(one)), squares<2>(y, 1, 10000) - std::pow(y[9999] - y[9998], 2),
               1e-13),
          "modified, m = 1: the second difference");
    check(near(modified_squares(fixed(x), 1, fixed(two)), modified_squares(fixed(x), 1, fixed(one)), 1e-13),
          "modified: runs add");
}

void missing_samples() {
    const Reals y{nan, 1, 2, nan, nan, 3, 9.9e37, -HUGE_VAL};
    Integers runs(6);
    check(missing_runs(fixed(y), 10, {nullptr, 0}) == 3, "missing runs are counted");
    check(missing_runs(fixed(y), 10, whole(runs)) == 3 && runs == Integers{10, 11, 13, 15, 16, 18}, "and listed");
    Integers short_of_room(2);
    check(missing_runs(fixed(y), 10, whole(short_of_room)) == 3, "missing runs: no write beyond the room given");
    check(phase_of(y) == Reals{0, 0, 1, 3, 3, 3, 6, 6, 6}, "a missing sample adds nothing to the phase");
    const Integers starts{2, 5, 7, 9};
    for (Index i = 0; i < 12; ++i) {
        const Index expected = i < 5 ? 0 : i < 9 ? 1 : 2;
        check(first_run_after(fixed(starts), i) == expected, "first run after a start");
    }
}

void online_equals_exact() {
    for (int order = 2; order <= 3; ++order) {
        for (Index n : {1, 2, 3, 7, 64, 129, 1000, 1001}) {
            const Reals y = noise(n);
            Online<double> online(fitting_lags(15, 8), order, 8, 32);  // level 0 alone: every start
            online.feed(y, 5);
            Integers counts;
            const Reals sums = online.read(counts);
            for (size_t l = 0; l < sums.size(); ++l) {
                const Index lag = online.lags[l], starts = n - order * lag + 1;
                check(counts[l] == (starts > 0 ? starts : 0), "online: number of differences");
                if (starts <= 0) continue;
                const double exact = order == 2 ? squares<2>(y, lag, n) : squares<3>(y, lag, n);
                check(near(sums[l], exact, 1e-13), "online: sum of squares");
            }
        }
    }
}

void online_chunks_and_gaps() {
    Reals y = noise(5000);
    for (Index i : {0, 1, 700, 701, 2048, 4999}) y[size_t(i)] = nan;
    for (Index positions : {1, 2, 16}) {
        for (Index block : {2, 64, 1000}) {
            Online<double> by_one(fitting_lags(1000, positions), 2, positions, block),
                at_once(fitting_lags(1000, positions), 2, positions, block);
            by_one.feed(y, 1);
            at_once.feed(y, 5000);
            Integers counts_by_one, counts_at_once;
            check(by_one.read(counts_by_one) == at_once.read(counts_at_once), "online: any chunking, same digits");
            check(counts_by_one == counts_at_once, "online: any chunking, same counts");
            check(by_one.read(counts_by_one) == at_once.read(counts_at_once), "online: reading changes nothing");
        }
    }
}

/// Level 0 alone sums every window: those that hold no missing sample, and no others.
void online_leaves_out_what_is_missing() {
    for (double missing : {nan, -nan, HUGE_VAL, -HUGE_VAL, 9.9e37, -1e300}) {
        Reals y = noise(300);
        for (Index i : {0, 31, 32, 170, 299}) y[size_t(i)] = missing;
        Online<double> online(fitting_lags(15, 8), 2, 8, 32);
        online.feed(y, 7);
        Integers counts;
        const Reals sums = online.read(counts), x = phase_of(y);
        for (size_t l = 0; l < sums.size(); ++l) {
            const Index lag = online.lags[l];
            Index complete = 0;
            double sum = 0.0;
            for (Index i = 0; i + 2 * lag <= 300; ++i) {
                bool is_complete = true;
                for (Index j : {0, 31, 32, 170, 299}) is_complete = is_complete && (j < i || j >= i + 2 * lag);
                if (!is_complete) continue;
                sum += std::pow(x[size_t(i + 2 * lag)] - 2 * x[size_t(i + lag)] + x[size_t(i)], 2);
                ++complete;
            }
            check(counts[l] == complete, "online, gaps: number of differences");
            check(is_finite(sums[l]) && near(sums[l], sum, 1e-12), "online, gaps: sum of squares");
        }
    }
}

void online_in_float() {
    const Reals y = noise(300000);
    Online<double> reference(fitting_lags(60000, 4), 2, 4, 16);
    Online<float> single(fitting_lags(60000, 4), 2, 4, 16);
    reference.feed(y, 1000);
    single.feed(y, 1000);
    Integers counts, counts_single;
    const Reals expected = reference.read(counts);
    const std::vector<float> found = single.read(counts_single);
    check(counts == counts_single, "float: counts");
    for (size_t l = 0; l < found.size(); ++l) check(near(double(found[l]), expected[l], 5e-7), "float: sum of squares");
}

void markov_states() {
    const Reals normals{1, -1, 2, 0.5, -3, 0}, phi{1, 0.5}, step{1, 2}, now{1, 0.25}, next{0, 0.75};
    Reals state{0, 8}, out(3);
    markov_noise(fixed(normals), fixed(phi), fixed(step), fixed(now), fixed(next), whole(state), whole(out));
    check(state == Reals{0, 1}, "markov: last state");
    check(out == Reals{0 + 2 + 1.5, 1 + 0.5 + 1.5, 3 + 0.5 + 0.75}, "markov: output");
}

#ifndef __FAST_MATH__
/// Two lags, white noise and a walk: what explains both exactly is found, and a coefficient that would be negative is 0.
void curve_of_two_lags() {
    const Reals columns{1.0, 1.0 / 3.0, 0.5, 2.0 / 3.0}, whiten{1e3, 0.0, 0.0, 1e3}, centre{1.0, 1.0}, rest{0.0, 0.0};
    const Reals both{1.0 + 0.1 / 3.0, 0.5 + 0.2 / 3.0}, steep{1.0, 0.4};
    const Integers starts{0, 0};
    Reals here{0.5, 0.5}, zero{0.5, 0.5};
    CurveFit(fixed(both), fixed(whiten), fixed(starts), fixed(centre), 2).minimise(fixed(columns), fixed(rest), whole(here), 60, 1e-14);
    check(here[0] > 0.9 && here[0] < 1.1 && here[1] > 0.05 && here[1] < 0.15, "curve fit: both terms");
    CurveFit(fixed(steep), fixed(whiten), fixed(starts), fixed(centre), 2).minimise(fixed(columns), fixed(rest), whole(zero), 60, 1e-14);
    check(zero[0] > 0.8 && zero[1] == 0.0, "curve fit: no negative walk");
}

/// A correlation of 0.6 between two lags of 9 degrees of freedom: by hand.
void weight_of_two_lags() {
    const double v = 2.0 / 9.0, share = 2.0 / 81.0;
    const Reals relative{v, 0.6 * v, 0.6 * v, v}, broken{v, 2.0 * v, 2.0 * v, v};
    Reals whiten(4), centre(2);
    const double log_det = curve_weight(fixed(relative), 0.0, 0.5, whole(whiten), whole(centre));
    check(near(log_det, std::log(0.64 * share * share), 1e-8), "weight: determinant");
    check(near(whiten[0], 1.0 / std::sqrt(share), 1e-8) && whiten[1] == 0.0, "weight: first row");
    check(near(whiten[2], -0.75 / std::sqrt(share), 1e-8) && near(whiten[3], 1.25 / std::sqrt(share), 1e-8),
          "weight: second row");
    check(near(centre[1], 1.0 - share, 1e-15), "weight: means of the cube roots");
    check(std::isnan(curve_weight(fixed(broken), 0.0, 0.5, whole(whiten), whole(centre))), "weight: no factor");
    // two models of means 1, with these covariances
    const Reals variance{1.0, 1.0}, means{1.0, 1.0, 1.0, 1.0}, weights{1.0, 0.0, 0.0, 1.0};
    Reals parts(relative), levels(2);
    parts.insert(parts.end(), broken.begin(), broken.end());
    const Integers tables{0, 0};
    curve_levels(fixed(variance), fixed(means), fixed(weights), fixed(parts), fixed(tables), 0.0, 0.5, whole(levels));
    check(near(levels[0], log_det + share * (1.0 + 0.5 * 0.5), 1e-8), "levels: of the first model");
    check(std::isinf(levels[1]), "levels: no factor");
}

/// P(1, x) = 1 - exp(-x), and back, on both sides of where the expansion for large shapes begins.
void gamma_law() {
    for (double x : {1e-9, 0.3, 2.0, 40.0, 700.0}) {
        const GammaTails at = gamma_tails(1.0, x);
        check(near(at.lower, -std::expm1(-x), 1e-13) && near(at.upper, std::exp(-x), 1e-13), "gamma: exponential law");
    }
    for (double a : {1e-3, 0.5, 24.9, 25.1, 3e3, 1e9})
        for (double tail : {1e-200, 1e-6, 0.025, 0.5, 0.975})
            for (bool upper : {false, true}) {
                const double x = gamma_quantile(a, tail, upper);
                const GammaTails at = gamma_tails(a, x);
                check(x == 0.0 ? a < 1.0 : near(upper ? at.upper : at.lower, tail, 1e-9), "gamma: back");
            }
    check(gamma_quantile(2.0, 0.0, true) == INFINITY && gamma_quantile(2.0, 0.0, false) == 0.0, "gamma: ends");
    check(std::isnan(gamma_quantile(0.0, 0.5, true)) && std::isnan(gamma_quantile(1.0, 1.5, true)), "gamma: no law");
    check(std::isnan(gamma_tails(-1.0, 1.0).lower) && gamma_tails(0.0, 1.0).upper == 0.0, "gamma: no shape");
}
#endif

/// Windows of one sample and of many, at every distance at which they meet, touch, and lie apart.
void pairs_of_windows() {
    const Reals lengths{1, 1, 1, 3, 2, 5}, exponents{-0.5, 0, 0.02, 0.5};
    Reals distance;
    Integers offsets{0};
    for (int p = 0; p < 3; ++p) {
        for (double k = -600; k <= 600; k += 0.5) distance.push_back(k);
        offsets.push_back(Index(distance.size()));
    }
    Reals white(distance.size()), laws(exponents.size() * distance.size());
    window_pairs(fixed(lengths), fixed(offsets), fixed(distance), {0, -0.5, 0, 0, 0}, whole(white));
    check(white[1200] == 1.0 && white[1202] == -0.5 && white[1204] == 0.0, "pairs: white noise, windows of one sample");
    for (double rate : {1e-6, 0.02, 0.3, 40.0}) {
        Reals all(distance.size());
        window_pairs(fixed(lengths), fixed(offsets), fixed(distance), {1, -0.5, 0.1, -1 / (rate * rate), rate}, whole(all));
        for (double r : all) check(is_finite(r), "pairs: finite");
    }
    power_window_pairs(fixed(lengths), fixed(offsets), fixed(distance), fixed(exponents), whole(laws));
    for (double r : laws) check(is_finite(r), "pairs: finite power law");
}

/// Pairs of positions counted one by one, for few runs and for many more of the second kind, on both ways of the search.
void pairs_of_positions() {
    for (const int many : {1, 3, 40}) {
        Integers first{2, 5, 9, 10}, second;
        for (int j = 0; j < many; ++j) second.insert(second.end(), {Index(7 * j + j % 3), Index(7 * j + 4)});
        Reals distance, before(second.size() / 2), pairs;
        Integers nearest(second.size() / 2 + 1);
        for (int k = -30; k <= 7 * many + 10; ++k) distance.push_back(k);
        pairs.resize(distance.size());
        const RunPositions positions{fixed(second), whole(before), whole(nearest)};
        pairs_in_runs(fixed(first), positions, fixed(distance), whole(pairs));
        for (size_t node = 0; node < distance.size(); ++node) {
            double counted = 0.0;
            for (size_t r = 0; r < first.size(); r += 2) {
                for (Index i = first[r]; i < first[r + 1]; ++i) {
                    for (size_t q = 0; q < second.size(); q += 2) {
                        const double place = double(i) + distance[node];
                        counted += double(second[q]) <= place && place < double(second[q + 1]);
                    }
                }
            }
            check(pairs[node] == counted, "pairs: positions of runs");
        }
    }
}

}  // namespace

int main() {
    ten_points();
    every_short_record_and_lag();
    inner_differences_and_biweight_to_the_last_window();
    modified_begins_anew_without_a_seam();
    missing_samples();
    online_equals_exact();
    online_chunks_and_gaps();
    online_leaves_out_what_is_missing();
    online_in_float();
    markov_states();
    pairs_of_windows();
    pairs_of_positions();
#ifndef __FAST_MATH__
    curve_of_two_lags();
    weight_of_two_lags();
    gamma_law();
#endif
    std::printf("%d passed, %d failed\n", passed, failed);
    return failed == 0 ? 0 : 1;
}
