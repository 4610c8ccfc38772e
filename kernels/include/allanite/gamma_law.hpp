// SPDX-License-Identifier: BSD-3-Clause
// Tails and quantiles of the gamma law: P(a, x) and Q(a, x) = 1 - P, the regularised incomplete gamma functions.
//
// Half of a chi-square variable of 2a degrees of freedom has it; at a = 1/2 so has half the square of a normal one.
// Series and continued fraction as in DLMF 8.11.4 and 8.9.2; for large a, near the mean, the uniform expansion of Temme
// ("On the computation of the incomplete gamma functions for large values of the parameters", 1987). The smaller of the
// two tails has 12 digits for a from 0.01 to 1e12.
#ifndef ALLANITE_GAMMA_LAW_HPP
#define ALLANITE_GAMMA_LAW_HPP

#include <math.h>

#include "ieee_only.hpp"
#include "slice.hpp"

namespace allanite {

struct GammaTails {
    double lower;   ///< P(a, x)
    double upper;   ///< Q(a, x)
    double weight;  ///< x times the density: x^a exp(-x) / Gamma(a)
};

constexpr double two_pi = 6.283185307179586477;
constexpr double large_shape = 25.0;  // from here on the expansions in 1/a have all digits

/// u - ln(1 + u), u = x/a - 1, without cancellation about u = 0.
inline double less_log(double a, double x) noexcept {
    const double u = (x - a) / a;
    if (!(fabs(u) < 0.5)) return u - log(x / a);
    const double s = u / (2.0 + u), s2 = s * s;
    double power = s * s2, sum = 0.0;
    for (double k = 3.0; fabs(power) > 1e-18 * fabs(s); k += 2.0, power *= s2) sum += power / k;
    return u * s - 2.0 * sum;
}

/// x^a exp(-x) / Gamma(a); of a large a by the series of Stirling.
inline double gamma_weight(double a, double x) noexcept {
    if (a < large_shape) {
        const double root = x < 2000.0 ? pow(x, 0.5 * a) * exp(-0.5 * x) : 0.0;  // whose square underflows late
        return root * (root / tgamma(a));
    }
    const double r = 1.0 / (a * a);
    const double stirling = (1.0 / 12 - r * (1.0 / 360 - r * (1.0 / 1260 - r * (1.0 / 1680 - r / 1188)))) / a;
    return sqrt(a / two_pi) * exp(-a * less_log(a, x) - stirling);
}

/// Coefficients of Temme's expansion: f[k] of d(lambda)/d(eta) - eta = sum f[k] eta^k, eta^2/2 = lambda - 1 - ln lambda.
struct TemmeSeries {
    static constexpr int size = 27;
    double f[size];

    constexpr TemmeSeries() : f() {
        double alpha[size + 1] = {0.0, 1.0};  // lambda - 1 = sum alpha[k] eta^k
        for (int k = 2; k <= size; ++k) {
            double rest = alpha[k - 1];
            for (int j = 2; j < k; ++j) rest -= j * alpha[j] * alpha[k - j + 1];
            alpha[k] = rest / (k + 1);
        }
        for (int k = 0; k < size; ++k) f[k] = (k + 1) * alpha[k + 1] - (k == 1 ? 1.0 : 0.0);
    }
};

/// Q(a, x) - erfc(eta sqrt(a/2))/2, over exp(-a eta^2/2)/sqrt(2 pi a); |eta| < 1.
inline double temme_rest(double a, double eta) noexcept {
    static constexpr TemmeSeries series;
    constexpr int last = TemmeSeries::size - 2;
    double b[last + 1];
    b[last] = series.f[last + 1];
    b[last - 1] = series.f[last];
    for (int m = last - 1; m > 0; --m) b[m - 1] = series.f[m] + (m + 1) * b[m + 1] / a;
    double sum = 0.0;
    for (int m = last; m >= 0; --m) sum = sum * eta + b[m];
    return sum / (1.0 + b[1] / a);
}

/// Both tails of the gamma law of shape a > 0 at x; all of it lies at 0 for a = 0, and beyond every x for an infinite a.
inline GammaTails gamma_tails(double a, double x) noexcept {
    if (!(a >= 0.0) || isnan(x) || (a == 0.0 && x == 0.0) || (isinf(a) && isinf(x))) return {NAN, NAN, NAN};
    if (x <= 0.0 || isinf(a)) return {0.0, 1.0, 0.0};
    if (a == 0.0 || isinf(x)) return {1.0, 0.0, 0.0};
    const double weight = gamma_weight(a, x), half_square = less_log(a, x);
    if (a >= large_shape && half_square < 0.5) {
        const double eta = copysign(sqrt(2.0 * half_square), x - a), root = sqrt(a * half_square);
        const double near = 0.5 * erfc(root);
        const double rest = exp(-root * root) / sqrt(two_pi * a) * temme_rest(a, eta);
        if (x >= a) return {1.0 - (near + rest), near + rest, weight};
        return {near - rest, 1.0 - (near - rest), weight};
    }
    if (x < a + 1.0) {
        double term = 1.0 / a, sum = term;
        for (double n = 1.0; term > 1e-17 * sum; ++n) sum += term *= x / (a + n);
        const double lower = fmin(weight * sum, 1.0);
        return {lower, 1.0 - lower, weight};
    }
    constexpr double tiny = 1e-300;  // modified Lentz
    double b = x + 1.0 - a, c = 1.0 / tiny, d = 1.0 / b, fraction = d;
    for (double n = 1.0; n < 1000.0; ++n) {
        const double numerator = n * (a - n);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        fraction *= c * d;
        if (fabs(c * d - 1.0) < 1e-16) break;
    }
    return {1.0 - weight * fraction, weight * fraction, weight};
}

/// A first guess of x by the cube root of Wilson and Hilferty, or in the lowest tail by P = x^a / Gamma(a + 1).
inline double gamma_guess(double a, double tail, bool upper) noexcept {
    const double least = fmin(tail, 1.0 - tail);
    const double t = sqrt(-2.0 * log(fmax(least, 1e-300)));
    const double z = t - (2.515517 + t * (0.802853 + t * 0.010328)) /
                             (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
    const double root = 1.0 - 1.0 / (9.0 * a) + (upper == (tail <= 0.5) ? z : -z) / (3.0 * sqrt(a));
    if (root > 0.3) return a * root * root * root;
    return exp((log(upper ? 1.0 - tail : tail) + lgamma(a + 1.0)) / a);
}

/// x at which the lower (or upper) tail is `tail`: Newton steps in ln x of the logarithm of the tail, which is concave.
/// 0 or infinity at the ends; NaN where the tail is no probability or the shape not positive.
inline double gamma_quantile(double a, double tail, bool upper) noexcept {
    if (!(a > 0.0 && tail >= 0.0 && tail <= 1.0) || isinf(a)) return NAN;
    if (tail == 0.0 || tail == 1.0) return (tail == 1.0) == upper ? 0.0 : INFINITY;
    double x = gamma_guess(a, tail, upper);
    for (int round = 0; round < 50 && x > 0.0; ++round) {
        const GammaTails at = gamma_tails(a, x);
        const double value = upper ? at.upper : at.lower;
        const double step = log(value / tail) * value / at.weight * (upper ? 1.0 : -1.0);
        if (!isfinite(step)) {  // so far out that nothing is left of the tail
            x *= upper ? 0.5 : 2.0;
            continue;
        }
        // upwards to an upper tail by as much in x: in ln x the step would leave its far end behind
        x *= upper && step > 0.0 ? 1.0 + step : exp(fmax(-3.0, fmin(step, 3.0)));
        if (fabs(step) * sqrt(1.0 + a) < 1e-8) break;  // the next one is its square
    }
    return x;
}

}  // namespace allanite

#endif
