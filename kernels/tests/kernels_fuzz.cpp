// SPDX-License-Identifier: BSD-3-Clause
// Records of any bits, cut anywhere, through the kernels under sanitizers, and what must hold for all of them.
//
// No kernel parses bytes: what comes out of a file reaches them as float64, of which every one of the 2^64 may occur
// (NaN of any kind, infinity, overload words, subnormals), with gaps, lengths and lags as the bindings let them pass.
// The same seed makes the same records: kernels_fuzz [rounds] [seed].
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "allanite/allan.hpp"
#include "allanite/biweight.hpp"
#include "allanite/curve_fit.hpp"
#include "allanite/gamma_law.hpp"
#include "allanite/pool_likelihood.hpp"
#include "allanite/theo.hpp"
#include "records.hpp"

using namespace allanite;

namespace {

/// Numbers that follow from a seed (SplitMix64).
struct Chance {
    uint64_t state;

    uint64_t bits() {
        uint64_t z = (state += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    Index below(Index n) { return Index(bits() % uint64_t(n)); }
};

double of_bits(uint64_t bits) {
    double value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

/// A sample: any bits, one that is odd, or an ordinary one.
double sample(Chance& chance, Index odd) {
    if (chance.below(100) >= odd) return double(chance.below(256)) - 128.0;
    static const double extremes[] = {0.0,     -0.0,   HUGE_VAL, -HUGE_VAL, NAN,    -NAN,    9.9e37,
                                      -9.9e37, 9.8e37, 5e-324,   1e-308,    1e308,  -1e308,  1.7976931348623157e308};
    const Index k = chance.below(2 * 14);
    return k < 14 ? extremes[k] : of_bits(chance.bits());
}

/// Ends the program: the seed and the round repeat it.
void require(bool condition, const char* what) {
    if (condition) return;
    std::printf("FAILED: %s\n", what);
    std::exit(1);
}

/// Runs of starts whose windows of `window` samples hold no missing one.
Integers complete_starts(const Integers& missing, Index n, Index window) {
    Integers runs;
    Index begin = 0;
    for (size_t r = 0; r <= missing.size() / 2; ++r) {
        const Index end = (r < missing.size() / 2 ? Index(missing[2 * r]) : n) - window + 1;
        if (end > begin) {
            runs.push_back(begin);
            runs.push_back(end);
        }
        if (r < missing.size() / 2) begin = Index(missing[2 * r + 1]);
    }
    return runs;
}

Index count_of(const Integers& runs) {
    Index count = 0;
    for (size_t r = 0; r < runs.size(); r += 2) count += Index(runs[r + 1] - runs[r]);
    return count;
}

/// Phase and missing runs of a record, block by block, as they are made of a file.
void in_blocks(Chance& chance, const Reals& y, Reals& phase, Integers& missing) {
    double last = 0.0;
    phase.assign(y.size() + 1, 0.0);
    for (Index at = 0; at < Index(y.size());) {
        const Index rest = Index(y.size()) - at, length = 1 + chance.below(rest);
        const auto block = fixed(y).part(at, length);
        last = integrate(block, 0.0, last, whole(phase).part(at + 1, length));
        Integers found(2 * size_t(missing_runs(block, at, {nullptr, 0})));
        require(missing_runs(block, at, whole(found)) == Index(found.size() / 2), "as many runs as were counted");
        for (size_t r = 0; r < found.size(); r += 2) {
            if (!missing.empty() && missing.back() == found[r]) {
                missing.back() = found[r + 1];  // the run goes on from block to block
            } else {
                missing.insert(missing.end(), {found[r], found[r + 1]});
            }
        }
        at += length;
    }
}

void exact_kernels(Chance& chance, const Reals& phase, const Integers& missing, Index n) {
    const Index lag = 1 + chance.below(n), block = 1 + chance.below(n);
    total_squares(fixed(phase), lag);
    if (2 * lag > n) return;
    const Integers starts = complete_starts(missing, n, 2 * lag), lags{lag}, offsets{0, Index(starts.size() / 2)};
    Reals sums(size_t((n - 2 * lag + block) / block));
    difference_squares<2>(fixed(phase), fixed(lags), fixed(starts), fixed(offsets), 0, block, whole(sums));
    biweight_sums(fixed(phase), lag, fixed(starts), of_bits(chance.bits()), of_bits(chance.bits()));
    const auto tail = fixed(phase).part(lag, Index(phase.size()) - lag);
    theo_squares(fixed(phase), tail, lag, fixed(starts));
    if (3 * lag - 1 <= n) modified_squares(fixed(phase), lag, fixed(complete_starts(missing, n, 3 * lag - 1)));
    if (3 * lag > n) return;
    const Integers longer = complete_starts(missing, n, 3 * lag), others{0, Index(longer.size() / 2)};
    difference_squares<3>(fixed(phase), fixed(lags), fixed(longer), fixed(others), 0, block, whole(sums).part(0, 1));
}

template <class Scalar>
void online_kernel(Chance& chance, const Reals& y, const Integers& missing) {
    const int order = 2 + int(chance.below(2));
    const Index n = Index(y.size()), positions = 1 + chance.below(16), block = 2 * (1 + chance.below(50));
    const Integers lags = fitting_lags(1 + chance.below(n), positions);
    Online<Scalar> pieces(lags, order, positions, block), at_once(lags, order, positions, block);
    pieces.feed(y, 1 + chance.below(n));
    at_once.feed(y, n);
    Integers counts, counts_at_once;
    const auto sums = pieces.read(counts), sums_at_once = at_once.read(counts_at_once);
    require(counts == counts_at_once, "online: any chunking, same counts");
    require(std::memcmp(sums.data(), sums_at_once.data(), sums.size() * sizeof(Scalar)) == 0 || sums != sums,
            "online: any chunking, same digits");
    if (sizeof(Scalar) != sizeof(double)) return;  // what float takes for missing is more
    for (size_t l = 0; l < lags.size() && lags[l] < 2 * positions; ++l) {
        const Index window = order * Index(lags[l]);
        require(counts[l] == count_of(complete_starts(missing, n, window)), "online: as many differences as exact");
    }
}

/// The steps of the moment fit end, and stay where coefficients may be, whatever they are given.
void curve_fit(Chance& chance, Index odd) {
    const Index lags = 1 + chance.below(12), p = 1 + chance.below(7);
    const auto numbers = [&](Index n) {
        Reals drawn;
        for (Index i = 0; i < n; ++i) drawn.push_back(sample(chance, odd));
        return drawn;
    };
    const Reals v = numbers(lags), w = numbers(lags * lags), c = numbers(lags), columns = numbers(lags * p);
    Integers starts;  // of one record, or of several below one another
    for (Index i = 0; i < lags; ++i) starts.push_back(i == 0 || chance.below(4) == 0 ? i : starts.back());
    const Reals rest = numbers(lags), mu = numbers(lags);
    Reals here = numbers(p), step(static_cast<size_t>(p));
    for (double& x : here) x = x > 0.0 ? x : 0.0;
    CurveFit fit(fixed(v), fixed(w), fixed(starts), fixed(c), p);
    fit.step(fixed(columns), fixed(here), fixed(mu), whole(step));
    fit.minimise(fixed(columns), fixed(rest), whole(here), 30, 1e-5);
    for (double x : here) require(!(x < 0.0), "curve fit: no coefficient is negative");
    Reals whiten(w.size()), centre(static_cast<size_t>(lags));
    curve_weight(fixed(w), sample(chance, odd), 0.5, whole(whiten), whole(centre));
    Reals levels(2);
    const Reals means = numbers(2 * lags), weights = numbers(2 * p), parts = numbers(2 * p * lags * lags);
    const Integers tables{int64_t(chance.below(2)), 1};
    curve_levels(fixed(v), fixed(means), fixed(weights), fixed(parts), fixed(tables), sample(chance, odd), 0.5,
                 whole(levels));
    for (double x : levels) require(!std::isnan(x), "levels: infinite where there is none");
}

/// Probabilities stay probabilities, and quantiles end, at any shape.
void gamma_law(Chance& chance) {
    const double a = of_bits(chance.bits()), x = of_bits(chance.bits()), tail = double(chance.below(1001)) / 1000.0;
    const GammaTails at = gamma_tails(a, x);
    require(std::isnan(at.lower) || (at.lower >= 0.0 && at.lower <= 1.0 && at.upper >= 0.0 && at.upper <= 1.0),
            "gamma: tails are probabilities");
    const double quantile = gamma_quantile(a, tail, chance.below(2));
    require(std::isnan(quantile) || quantile >= 0.0, "gamma: quantiles are not negative");
}

/// A likelihood of pools is read and written in its place, whatever the numbers and the number of terms.
void pool_likelihood(Chance& chance, Index odd) {
    const auto numbers = [&](Index n) {
        Reals drawn;
        for (Index i = 0; i < n; ++i) drawn.push_back(sample(chance, odd));
        return drawn;
    };
    const Index size = 1 + chance.below(15), singles = chance.below(4);
    Integers pools;
    Index moments = 0;
    for (Index p = chance.below(3); p > 0; --p) {
        const Index d = 1 + chance.below(6);
        for (Index shape : {d, chance.below(d + 1), 1 + chance.below(9)}) pools.push_back(shape);
        moments += 2 * d + d * d;
    }
    const Index width = PoolLikelihood::elements(fixed(whole(pools))) + singles;
    const Reals c = numbers(1 + chance.below(size)), known = numbers(moments), rows = numbers(size * width);
    const Reals values = numbers(singles), tilts = numbers(singles);
    Reals three(3), gradient(static_cast<size_t>(size)), information(static_cast<size_t>(size * size));
    PoolLikelihood of(fixed(whole(pools)), fixed(known), fixed(values), fixed(tilts));
    of.evaluate(fixed(c), fixed(rows), size, chance.below(2) ? NAN : 0.5, chance.below(2), whole(three),
                whole(gradient), whole(information));
}

void one_round(Chance& chance) {
    static const Index shares[] = {0, 2, 20, 100};  // per cent of odd samples
    const Index n = 1 + chance.below(chance.below(4) ? 60 : 3000), odd = shares[chance.below(4)];
    Reals y, phase;
    Integers missing;
    for (Index i = 0; i < n; ++i) y.push_back(sample(chance, odd));
    in_blocks(chance, y, phase, missing);
    Index absent = 0;
    for (double value : y) absent += is_missing(value);
    require(count_of(missing) == absent, "every missing sample is in one run");
    exact_kernels(chance, phase, missing, n);
    online_kernel<double>(chance, y, missing);
    online_kernel<float>(chance, y, missing);
    curve_fit(chance, odd);
    gamma_law(chance);
    if (!chance.below(8)) pool_likelihood(chance, odd);
}

}  // namespace

int main(int arguments, char** words) {
    const int rounds = arguments > 1 ? std::atoi(words[1]) : 2000;
    const uint64_t seed = arguments > 2 ? std::strtoull(words[2], nullptr, 10) : 1;
    Chance chance{seed};
    for (int round = 0; round < rounds; ++round) one_round(chance);
    std::printf("%d records of any bits, seed %llu: nothing out of bounds\n", rounds, (unsigned long long)seed);
    return 0;
}
