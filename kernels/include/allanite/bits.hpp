// SPDX-License-Identifier: BSD-3-Clause
// Is a number finite? Asked of its bits: with -ffast-math (-Ofast, -ffinite-math-only) a compiler takes it for granted
// that there is no NaN, and removes every comparison that would find one. Firmware-safe.
#ifndef ALLANITE_BITS_HPP
#define ALLANITE_BITS_HPP

#include <stdint.h>

// clang may take even the bits of an argument for those of a finite number.
#if defined(__clang__) && defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error "allanite marks a missing sample with NaN, which clang removes with -ffast-math: add -fno-finite-math-only"
#endif

namespace allanite {

template <int bytes>
struct WordOf;
template <>
struct WordOf<4> {
    using type = uint32_t;
    static constexpr type sign = 0x80000000U, infinity = 0x7F800000U;
};
template <>
struct WordOf<8> {
    using type = uint64_t;
    static constexpr type sign = 0x8000000000000000U, infinity = 0x7FF0000000000000U;
};

/// The bits of |x|, float or double, as a whole number: it grows with |x|, and is largest where x is NaN.
template <class Scalar>
typename WordOf<sizeof(Scalar)>::type magnitude_bits(Scalar x) noexcept {
    typename WordOf<sizeof(Scalar)>::type word = 0;
#if defined(__GNUC__)
    __builtin_memcpy(&word, &x, sizeof word);
#else
    const auto* from = reinterpret_cast<const unsigned char*>(&x);
    auto* to = reinterpret_cast<unsigned char*>(&word);
    for (unsigned i = 0; i < sizeof word; ++i) to[i] = from[i];
#endif
    return word & ~WordOf<sizeof(Scalar)>::sign;
}

template <class Scalar>
bool is_finite(Scalar x) noexcept {
    return magnitude_bits(x) < WordOf<sizeof(Scalar)>::infinity;
}

}  // namespace allanite

#endif
