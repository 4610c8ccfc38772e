// SPDX-License-Identifier: BSD-3-Clause
// The log-likelihood of a filter: sums over its innovations, and one logarithm for all of them. Firmware-safe.
#ifndef ALLANITE_LIKELIHOOD_HPP
#define ALLANITE_LIKELIHOOD_HPP

#include <math.h>

#include "ieee_only.hpp"
#include "kalman.hpp"

namespace allanite {

inline float square_root(float x) noexcept { return ::sqrtf(x); }
inline double square_root(double x) noexcept { return ::sqrt(x); }
inline float logarithm(float x) noexcept { return ::logf(x); }
inline double logarithm(double x) noexcept { return ::log(x); }

/// A product of positive numbers of any size: mantissa * 2^exponent. Its logarithm is the sum of theirs, without a
/// call of log() per number.
template <class Scalar>
struct LogProduct {
    Scalar mantissa = Scalar(1);  ///< between 1 / range and range
    int64_t exponent = 0;
};

/// Binary digits of the range, well inside that of the exponent of Scalar.
template <class Scalar>
constexpr int range_digits = sizeof(Scalar) > 4 ? 448 : 56;

template <class Scalar>
constexpr Scalar power_of_two(int digits) noexcept {
    Scalar power = Scalar(1);
    for (; digits > 0; --digits) power *= Scalar(2);
    for (; digits < 0; ++digits) power *= Scalar(0.5F);
    return power;
}

/// Brings x between 1 / range and range by powers of two, which cost no digits, and counts them.
template <class Scalar>
void bring_into_range(Scalar& x, int64_t& exponent) noexcept {
    constexpr int digits = range_digits<Scalar>;
    constexpr Scalar top = power_of_two<Scalar>(digits), bottom = power_of_two<Scalar>(-digits);
    for (; x >= top; exponent += digits) x *= bottom;
    for (; x <= bottom && x > Scalar(0); exponent -= digits) x *= top;
}

template <class Scalar>
void multiply(LogProduct<Scalar>& product, Scalar factor) noexcept {
    constexpr Scalar top = power_of_two<Scalar>(range_digits<Scalar>);
    constexpr Scalar bottom = power_of_two<Scalar>(-range_digits<Scalar>);
    const Scalar mantissa = product.mantissa * factor;
    if (mantissa < top && mantissa > bottom) {
        product.mantissa = mantissa;
        return;
    }
    bring_into_range(factor, product.exponent);
    product.mantissa *= factor;
    bring_into_range(product.mantissa, product.exponent);
}

template <class Scalar>
Scalar log_of(const LogProduct<Scalar>& product) noexcept {
    return logarithm(product.mantissa) + Scalar(product.exponent) * Scalar(0.693147180559945309417232L);
}

/// Sums over the measurements so far.
template <class Scalar>
struct Likelihood {
    LogProduct<Scalar> variances;          ///< of S over the proper innovations
    LogProduct<Scalar> diffuse_variances;  ///< of F_inf = (h a)^2 over the diffuse updates
    Scalar squares = Scalar(0);            ///< sum of v^2 / S
    Scalar remainder = Scalar(0);          ///< what that sum could not hold (compensated summation)
    int64_t innovations = 0;               ///< proper ones: scalars, not rows
    int64_t diffuse_updates = 0;
    int64_t skipped = 0;  ///< not missing and yet of no use: R < 0, or S not positive
};

template <class Scalar>
void add_innovation(Likelihood<Scalar>& sums, const Measured<Scalar>& measured) noexcept {
    multiply(sums.variances, measured.variance);
    const Scalar term = measured.innovation * measured.innovation * measured.inverse + sums.remainder;
    const Scalar sum = sums.squares + term;
    sums.remainder = term - (sum - sums.squares);
    sums.squares = sum;
    ++sums.innovations;
}

/// ln of the density of the proper innovations, with its constant.
template <class Scalar>
Scalar log_likelihood(const Likelihood<Scalar>& sums) noexcept {
    constexpr Scalar log_two_pi = Scalar(1.83787706640934548356L);
    return Scalar(-0.5F) * (Scalar(sums.innovations) * log_two_pi + log_of(sums.variances) + sums.squares);
}

}  // namespace allanite

#endif
