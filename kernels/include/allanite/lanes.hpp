// SPDX-License-Identifier: BSD-3-Clause
// Four doubles side by side that are computed with as if they were one: the scalar of a kernel that does the same to
// four records at once. The digits of a lane are those of a double, whatever vector registers the processor has.
#ifndef ALLANITE_LANES_HPP
#define ALLANITE_LANES_HPP

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "ieee_only.hpp"
#include "slice.hpp"

namespace allanite {

constexpr Index n_lanes = 4;

// One part of them fills a vector register. Where the compiler knows no vectors, a part is a number.
#if defined(__GNUC__)
#if defined(__AVX__)
constexpr Index part_lanes = 4;
#else
constexpr Index part_lanes = 2;
#endif
typedef double LanePart __attribute__((vector_size(part_lanes * sizeof(double))));
typedef int64_t LaneMaskPart __attribute__((vector_size(part_lanes * sizeof(double))));
#else
constexpr Index part_lanes = 1;
using LanePart = double;
using LaneMaskPart = bool;
#endif
constexpr Index n_parts = n_lanes / part_lanes;

/// The same for each part. Written out, not a loop: only so do compilers keep the parts in registers.
template <class Operation>
void for_parts(const Operation& operation) noexcept {
    operation(0);
    if constexpr (n_parts > 1) operation(1);
    if constexpr (n_parts > 2) operation(2);
    if constexpr (n_parts > 3) operation(3);
}

/// Where a comparison holds. As a condition: it holds in all lanes.
struct LaneMask {
    LaneMaskPart part[n_parts];

    explicit operator bool() const noexcept;
};

struct Lanes {
    LanePart part[n_parts];

    Lanes() = default;

    /// The same number in all lanes.
    explicit Lanes(double x) noexcept {
        for_parts([&](Index i) noexcept { part[i] = LanePart{} + x; });
    }

    /// The lanes lie side by side from `source` on.
    static Lanes load(const double* source) noexcept {
        Lanes made;
        for_parts([&](Index i) noexcept {
            __builtin_memcpy(&made.part[i], source + i * part_lanes, sizeof(LanePart));
        });
        return made;
    }

    static Lanes of(double a, double b, double c, double d) noexcept {
        Lanes made;
#if defined(__GNUC__) && defined(__AVX__)
        made.part[0] = LanePart{a, b, c, d};
#elif defined(__GNUC__)
        made.part[0] = LanePart{a, b};
        made.part[1] = LanePart{c, d};
#else
        const double all[n_lanes] = {a, b, c, d};
        made = load(all);
#endif
        return made;
    }

    void store(double* target) const noexcept {
        for_parts([&](Index i) noexcept { __builtin_memcpy(target + i * part_lanes, &part[i], sizeof(LanePart)); });
    }

    double operator[](Index lane) const noexcept {
        double all[n_lanes];
        store(all);
        return all[lane];
    }

    Lanes& operator+=(const Lanes& b) noexcept {
        for_parts([&](Index i) noexcept { part[i] += b.part[i]; });
        return *this;
    }
    Lanes& operator-=(const Lanes& b) noexcept {
        for_parts([&](Index i) noexcept { part[i] -= b.part[i]; });
        return *this;
    }
    Lanes& operator*=(const Lanes& b) noexcept {
        for_parts([&](Index i) noexcept { part[i] *= b.part[i]; });
        return *this;
    }
    Lanes& operator/=(const Lanes& b) noexcept {
        for_parts([&](Index i) noexcept { part[i] /= b.part[i]; });
        return *this;
    }
};

inline Lanes operator+(Lanes a, const Lanes& b) noexcept { return a += b; }
inline Lanes operator-(Lanes a, const Lanes& b) noexcept { return a -= b; }
inline Lanes operator*(Lanes a, const Lanes& b) noexcept { return a *= b; }
inline Lanes operator/(Lanes a, const Lanes& b) noexcept { return a /= b; }

inline LaneMask operator<(const Lanes& a, const Lanes& b) noexcept {
    LaneMask mask;
    for_parts([&](Index i) noexcept { mask.part[i] = a.part[i] < b.part[i]; });
    return mask;
}
inline LaneMask operator>(const Lanes& a, const Lanes& b) noexcept { return b < a; }

inline LaneMask operator==(const Lanes& a, const Lanes& b) noexcept {
    LaneMask mask;
    for_parts([&](Index i) noexcept { mask.part[i] = a.part[i] == b.part[i]; });
    return mask;
}
inline bool operator!=(const Lanes& a, const Lanes& b) noexcept { return !(a == b); }

/// One bit for each lane.
inline unsigned bits_of(const LaneMask& mask) noexcept {
    unsigned bits = 0;
    for_parts([&](Index i) noexcept {
#if defined(__AVX__)
        bits |= unsigned(_mm256_movemask_pd(__m256d(mask.part[i])));
#elif defined(__SSE2__)
        bits |= unsigned(_mm_movemask_pd(__m128d(mask.part[i]))) << (i * part_lanes);
#elif defined(__GNUC__)
        for (Index l = 0; l < part_lanes; ++l) bits |= (mask.part[i][l] ? 1u : 0u) << (i * part_lanes + l);
#else
        bits |= (mask.part[i] ? 1u : 0u) << i;
#endif
    });
    return bits;
}

inline LaneMask::operator bool() const noexcept { return bits_of(*this) == (1u << n_lanes) - 1; }

/// a where the mask holds, else b.
inline Lanes choose(const LaneMask& mask, const Lanes& a, const Lanes& b) noexcept {
    Lanes chosen;
    for_parts([&](Index i) noexcept {
#if defined(__GNUC__)
        chosen.part[i] = LanePart((LaneMaskPart(a.part[i]) & mask.part[i]) | (LaneMaskPart(b.part[i]) & ~mask.part[i]));
#else
        chosen.part[i] = mask.part[i] ? a.part[i] : b.part[i];
#endif
    });
    return chosen;
}

// ---- what the kernels ask of a scalar -------------------------------------------------------------------------------

inline Lanes where_positive(const Lanes& x, const Lanes& a, const Lanes& b) noexcept {
    return choose(x > Lanes(0.0), a, b);
}

inline bool nowhere_positive(const Lanes& x) noexcept { return bits_of(x > Lanes(0.0)) == 0; }

/// Lanes cannot part company over a row: who feeds them sees to it that noise is positive, and looks at the sums
/// afterwards, where an innovation or a variance that is none leaves its mark.
constexpr bool is_sound(const Lanes&, const Lanes&, const Lanes&) noexcept { return true; }

}  // namespace allanite

#endif
