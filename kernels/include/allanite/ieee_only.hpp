// SPDX-License-Identifier: BSD-3-Clause
// Included by what needs the arithmetic of IEEE 754: sums that keep their remainder, comparisons that a NaN fails.
#ifndef ALLANITE_IEEE_ONLY_HPP
#define ALLANITE_IEEE_ONLY_HPP

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__) || \
    defined(__ASSOCIATIVE_MATH__) || defined(_M_FP_FAST)
#error "this header of allanite needs IEEE 754 arithmetic: compile what includes it without -ffast-math and -Ofast"
#endif

#endif
