// SPDX-License-Identifier: BSD-3-Clause
// Covariance of two second differences of the phase, over m1 and m2 samples, whose first points are k samples apart:
//     r12(k) = 1/(2 m1 m2) sum_ij w_i w_j S(k + j m2 - i m1),   w = (1, -2, 1),
// with S the generalised covariance of the phase. The covariance of an Allan curve is a sum of r12(k)^2, and nearly all
// time of a fit was spent here: hundreds of thousands of k for each process.
//
// The difference over i is taken first, in closed form where S is smooth on both sides of its kink at zero:
//     D(d) = S(d + m1) - 2 S(d) + S(d - m1),   r12(k) = [D(d_0) - 2 D(d_1) + D(d_2)]/(2 m1 m2),   d_j = k + j m2 - m1.
#ifndef ALLANITE_WINDOW_PAIRS_HPP
#define ALLANITE_WINDOW_PAIRS_HPP

#include <math.h>

#include "phase.hpp"

namespace allanite {

/// S(t) = spike [t = 0] + linear |t| + cubic |t|^3 + exponential (e^-u + u),   u = rate |t|.
struct PhaseCovariance {
    double spike, linear, cubic, exponential, rate;
};

/// Beyond this many lengths of both windows a power law has its asymptotic form (relative error 1e-4 there).
constexpr double far_windows = 50.0;

/// Arguments below which e^-u less its first terms is a series: it would lose its digits.
constexpr double small_argument = 0.5;

/// e^-u - 1 + u - u^2/2 = u^3 (c_0 + c_1 u + ...), as many terms as an argument up to `largest` < 1 needs.
struct ExponentialRest {
    double c[16];
    int last = 0;

    explicit ExponentialRest(double largest) noexcept {
        double term = -1.0 / 6.0, power = 1.0;
        for (int n = 0; n < 16; ++n) {
            c[n] = term;
            last = n;
            term /= -double(n + 4);
            power *= largest;
            if (fabs(term) * power < 1e-18) break;
        }
    }

    double operator()(double u) const noexcept {
        double sum = c[last];
        for (int n = last - 1; n >= 0; --n) sum = sum * u + c[n];
        return u * u * u * sum;
    }
};

/// A pair of window lengths, m1 <= m2.
struct WindowPair {
    double m1, m2;

    double scale() const noexcept { return 1.0 / (2.0 * m1 * m2); }
    double middle(double k, int j) const noexcept { return k + double(j) * m2 - m1; }
    bool overlap(double k) const noexcept { return k > -2.0 * m2 && k < 2.0 * m1; }
};

inline double over_windows(double first, double second, double third) noexcept { return first - 2.0 * second + third; }

/// Adds r12 of spike, linear and cubic S at the distances of one pair.
ALLANITE_WIDE inline void add_polynomial(WindowPair pair, const PhaseCovariance& S, Slice<const double> k,
                                         Slice<double> out) noexcept {
    const double m1 = pair.m1, scale = pair.scale();
    for (Index n = 0; n < k.size; ++n) {
        double D[3];
        for (int j = 0; j < 3; ++j) {
            const double d = fabs(pair.middle(k[n], j)), inside = d < m1 ? m1 - d : 0.0;
            const double below = 2.0 * m1 * m1 * m1 + (6.0 * m1 - 2.0 * d) * d * d, beyond = 6.0 * m1 * m1 * d;
            D[j] = 2.0 * S.linear * inside + S.cubic * (d < m1 ? below : beyond);
        }
        out[n] += pair.overlap(k[n]) ? scale * over_windows(D[0], D[1], D[2]) : 0.0;
    }
}

inline void add_spikes(WindowPair pair, double spike, Slice<const double> k, Slice<double> out) noexcept {
    const double m1 = pair.m1, scale = spike * pair.scale();
    for (Index n = 0; n < k.size; ++n) {
        double D[3];
        for (int j = 0; j < 3; ++j) {
            const double d = fabs(pair.middle(k[n], j));
            D[j] = d == m1 ? 1.0 : (d == 0.0 ? -2.0 : 0.0);
        }
        out[n] += scale * over_windows(D[0], D[1], D[2]);
    }
}

/// Exponential S of windows that are short beside its time: by the series alone, eight distances at once.
ALLANITE_WIDE inline void add_slow_exponential(WindowPair pair, const PhaseCovariance& S, Slice<const double> k,
                                               Slice<double> out) noexcept {
    const double m1 = pair.m1, scale = S.exponential * pair.scale(), rate = S.rate;
    const ExponentialRest rest(2.0 * rate * (m1 + pair.m2));
    for (Index first = 0; first < k.size; first += lanes) {
        const Index count = k.size - first < lanes ? k.size - first : lanes;
        double u[9 * lanes] = {}, sum[9 * lanes];
        for (Index i = 0; i < 9; ++i) {
            for (Index n = 0; n < count; ++n) {
                u[i * lanes + n] = rate * fabs(pair.middle(k[first + n], int(i / 3)) + double(1 - i % 3) * m1);
            }
        }
        for (double& one : sum) one = rest.c[rest.last];
        for (int power = rest.last - 1; power >= 0; --power) {
            for (Index i = 0; i < 9 * lanes; ++i) sum[i] = sum[i] * u[i] + rest.c[power];
        }
        for (Index i = 0; i < 9 * lanes; ++i) sum[i] *= u[i] * u[i] * u[i];
        for (Index n = 0; n < count; ++n) {
            double D[3];
            for (Index j = 0; j < 3; ++j) {
                D[j] = over_windows(sum[3 * j * lanes + n], sum[(3 * j + 1) * lanes + n], sum[(3 * j + 2) * lanes + n]);
            }
            out[first + n] += pair.overlap(k[first + n]) ? scale * over_windows(D[0], D[1], D[2]) : 0.0;
        }
    }
}

/// D of e^-u + u: a product where both sides of the window lie on one side of the kink.
inline double exponential_difference(double d, double m1, double rate, double shape,
                                     const ExponentialRest& rest) noexcept {
    d = fabs(d);
    if (d >= m1) return shape * exp(-rate * (d - m1));
    const double near = rate * (m1 - d), middle = rate * d, far = rate * (m1 + d), width = rate * m1;
    if (2.0 * width < small_argument) return width * width + over_windows(rest(far), rest(middle), rest(near));
    return over_windows(exp(-far), exp(-middle), exp(-near)) + 2.0 * near;
}

inline void add_exponential(WindowPair pair, const PhaseCovariance& S, Slice<const double> k,
                            Slice<double> out) noexcept {
    const double m1 = pair.m1, m2 = pair.m2, rate = S.rate, scale = S.exponential * pair.scale();
    const double shape = expm1(-rate * m1) * expm1(-rate * m1), both = shape * expm1(-rate * m2) * expm1(-rate * m2);
    const bool slow = 2.0 * rate * (m1 + m2) < small_argument;
    if (slow) add_slow_exponential(pair, S, k, out);
    const ExponentialRest rest(small_argument);
    for (Index n = 0; n < k.size; ++n) {
        if (k[n] >= 2.0 * m1) {
            out[n] += scale * both * exp(-rate * (k[n] - 2.0 * m1));
        } else if (k[n] <= -2.0 * m2) {
            out[n] += scale * both * exp(rate * (k[n] + 2.0 * m2));
        } else if (!slow) {
            double D[3];
            for (int j = 0; j < 3; ++j) D[j] = exponential_difference(pair.middle(k[n], j), m1, rate, shape, rest);
            out[n] += scale * over_windows(D[0], D[1], D[2]);
        }
    }
}

/// r12 at the distances of every pair of windows.
///
/// @param lengths  (P * 2) m1 <= m2 of each pair       @param offsets (P + 1) where its distances begin and end
/// @param distance (n) k                               @param out (n)
inline void window_pairs(Slice<const double> lengths, Slice<const int64_t> offsets, Slice<const double> distance,
                         const PhaseCovariance& S, Slice<double> out) noexcept {
    for (Index n = 0; n < out.size; ++n) out[n] = 0.0;
    for (Index p = 0; p + 1 < offsets.size; ++p) {
        const Index begin = Index(offsets[p]), count = Index(offsets[p + 1]) - begin;
        const WindowPair pair{lengths[2 * p], lengths[2 * p + 1]};
        const auto k = distance.part(begin, count);
        const auto part = out.part(begin, count);
        if (S.spike != 0.0) add_spikes(pair, S.spike, k, part);
        if (S.linear != 0.0 || S.cubic != 0.0) add_polynomial(pair, S, k, part);
        if (S.exponential != 0.0) add_exponential(pair, S, k, part);
    }
}

/// The same for S = |t|^(2 + e) of several exponents e between -1 and 1, t^2 ln|t| where e is 0.
///
/// @param exponents (E)    @param out (E * n) one row for each exponent
inline void power_window_pairs(Slice<const double> lengths, Slice<const int64_t> offsets, Slice<const double> distance,
                               Slice<const double> exponents, Slice<double> out) noexcept {
    for (Index p = 0; p + 1 < offsets.size; ++p) {
        const WindowPair pair{lengths[2 * p], lengths[2 * p + 1]};
        const double m1 = pair.m1, m2 = pair.m2;
        for (Index n = Index(offsets[p]); n < Index(offsets[p + 1]); ++n) {
            const double centre = fabs(distance[n] + m2 - m1);
            const bool far = centre > far_windows * (m1 + m2);
            double square[9], logarithm[9];
            for (int i = 0; !far && i < 9; ++i) {
                const double t = fabs(pair.middle(distance[n], i / 3) + double(1 - i % 3) * m1);
                square[i] = t * t;
                logarithm[i] = t > 0.0 ? log(t) : 0.0;
            }
            for (Index x = 0; x < exponents.size; ++x) {
                const double e = exponents[x], fourth = e == 0.0 ? -2.0 : (e + 2.0) * (e + 1.0) * e * (e - 1.0);
                double& r = out[x * distance.size + n];
                if (far) {
                    r = fourth * m1 * m2 / 2.0 * pow(centre, e - 2.0);
                    continue;
                }
                double S[9];
                for (int i = 0; i < 9; ++i) {
                    // t^2, which the differences do not see, is taken off where it would be nearly all
                    const double beyond = e * logarithm[i];
                    S[i] = square[i] * (e == 0.0 ? logarithm[i] : fabs(e) < 0.05 ? expm1(beyond) : exp(beyond));
                }
                r = pair.scale() * over_windows(over_windows(S[0], S[1], S[2]), over_windows(S[3], S[4], S[5]),
                                                over_windows(S[6], S[7], S[8]));
            }
        }
    }
}

}  // namespace allanite

#endif
