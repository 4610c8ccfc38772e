// SPDX-License-Identifier: BSD-3-Clause
// Log-likelihood of pools of vectors, its gradient and its expected information, in one pass.
//
// A pool has n vectors of d components with the mean m and the second moments S; r is what a ramp of unit slope makes
// of them. V = sum_t c_t E_t is their covariance and L its lower Cholesky factor. With
//
//     B_t = L^-1 E_t L^-T,   Y = L^-1 S L^-T,   u = L^-1 r,   w = L^-1 m,   Z = Y - b (w u' + u w') + b^2 u u' - I,  (1)
//
// minus twice the log-likelihood is n (ln det V + tr(Z + I)) but for a constant, its gradient n/2 <B_t, Z>, and the
// information n/2 <B_t, B_u>. Components that are given are the first here: what they say alone is the leading block
// of each matrix in (1), and to take it off is to leave that block out of the sums.
//
// All terms are transformed side by side: M of them (the last one S, then zeros) are one element of a matrix.
#ifndef ALLANITE_POOL_LIKELIHOOD_HPP
#define ALLANITE_POOL_LIKELIHOOD_HPP

#include <math.h>

#include <vector>

#include "ieee_only.hpp"
#include "slice.hpp"

namespace allanite {

/// Terms and second moments that are transformed side by side at most.
constexpr Index most_pool_terms = 16;

/// Likelihood of pools, and of vectors of one component each with a variance of its own (singles).
class PoolLikelihood {
public:
    /// @param pools   (3 P) of each pool: components d, how many of them are given, vectors n
    /// @param moments of each pool m (d), r (d) and S (d * d), those that are given last
    /// @param values  (k) singles          @param tilts (k) what a ramp makes of them
    PoolLikelihood(Slice<const int64_t> pools, Slice<const double> moments, Slice<const double> values,
                   Slice<const double> tilts)
        : shapes(pools), known(moments), value(values), tilt(tilts) {}

    /// Elements of the covariances of all pools.
    static Index elements(Slice<const int64_t> pools) noexcept {
        Index sum = 0;
        for (Index p = 0; p + 2 < pools.size; p += 3) sum += Index(pools[p]) * Index(pools[p]);
        return sum;
    }

    /// @param c           (n) variance coefficients
    /// @param rows        (size * width) E_t of the pools and then F_t of the singles, for each coefficient and for
    ///                    whatever else changes the covariance; size < most_pool_terms
    /// @param slope       b, or NaN: the best
    /// @param averaged    gradient of the mean over all slopes, where the slope is free
    /// @param numbers     (3) minus twice the log-likelihood but for constants, b, and the information on b
    /// @param gradient    (size)    @param information (size * size)
    /// @return false where a covariance is not positive definite; nothing is written then
    bool evaluate(Slice<const double> c, Slice<const double> rows, Index size, double slope, bool averaged,
                  Slice<double> numbers, Slice<double> gradient, Slice<double> information) {
        return with_lanes<2>(c, rows, size, slope, averaged, numbers, gradient, information);
    }

private:
    using Numbers = std::vector<double>;

    static size_t at(Index i) { return static_cast<size_t>(i); }

    template <Index M, class... Rest>
    bool with_lanes(Slice<const double> c, Slice<const double> rows, Index size, Rest... rest) {
        if constexpr (M < most_pool_terms) {
            if (size >= M) return with_lanes<M + 2>(c, rows, size, rest...);
        }
        return of_lanes<M>(c, rows, size, rest...);
    }

    template <Index M>
    bool of_lanes(Slice<const double> c, Slice<const double> rows, Index size, double slope, bool averaged,
                  Slice<double> numbers, Slice<double> gradient, Slice<double> information) {
        const Index width = size > 0 ? rows.size / size : 0;
        log_det = projection = on_slope = 0.0;
        if (!pools_invert<M>(c, rows, width, size) || !singles_invert(c, rows, width)) return false;
        const bool free = isnan(slope), informed = on_slope > 0.0;
        const double b = !free ? slope : informed ? projection / on_slope : 0.0;
        const double spread = averaged && free && informed ? 1.0 / on_slope : 0.0;

        double squares = 0.0, down[M] = {}, inner[M * M] = {};
        Index place = 0, moments = 0;
        for (Index p = 0; p + 2 < shapes.size; p += 3) {
            const Index d = Index(shapes[p]);
            squares += double(shapes[p + 2]) * of_pool<M>(place, moments, p, size, b, spread, down, inner);
            place += d * d;
            moments += 2 * d + d * d;
        }
        const Index first = width - value.size;
        for (Index j = 0; j < value.size; ++j) {
            const double weight = 1.0 / variance[at(j)], left = value[j] - b * tilt[j], power = left * left * weight;
            double f[M] = {};
            for (Index t = 0; t < size; ++t) f[t] = rows[t * width + first + j] * weight;
            add<M>(f, 0.5, power - 1.0 + tilt[j] * tilt[j] * weight * spread, down, inner);
            squares += power;
        }
        numbers[0] = log_det + squares;
        numbers[1] = b;
        numbers[2] = on_slope;
        for (Index t = 0; t < size; ++t) gradient[t] = down[t];
        for (Index t = 0; t < size; ++t)
            for (Index s = 0; s < size; ++s) information[t * size + s] = inner[t * M + s];
        return true;
    }

    /// L^-1, u and w of each pool, their log determinants, and what they say of the slope.
    template <Index M>
    bool pools_invert(Slice<const double> c, Slice<const double> rows, Index width, Index size) {
        packed.assign(at(M * elements(shapes)), 0.0);
        inverse.assign(at(elements(shapes)), 0.0);
        ramp.assign(at(known.size), 0.0);
        Index place = 0, moments = 0;
        for (Index p = 0; p + 2 < shapes.size; p += 3) {
            const Index d = Index(shapes[p]);
            pack<M>(rows, width, size, place, moments + 2 * d, d);
            if (!invert<M>(c, place, d)) return false;
            whiten_ramp(place, moments, d, Index(shapes[p + 1]), double(shapes[p + 2]));
            place += d * d;
            moments += 2 * d + d * d;
        }
        return true;
    }

    void whiten_ramp(Index place, Index moments, Index d, Index given, double n) {
        for (Index i = 0; i < d; ++i) {
            double u = 0.0, w = 0.0;
            for (Index l = 0; l <= i; ++l) {
                w += inverse[at(place + i * d + l)] * known[moments + d - 1 - l];
                u += inverse[at(place + i * d + l)] * known[moments + 2 * d - 1 - l];
            }
            ramp[at(moments + i)] = w;
            ramp[at(moments + d + i)] = u;
            if (i < given) continue;
            log_det -= 2.0 * n * log(inverse[at(place + i * d + i)]);
            projection += n * u * w;
            on_slope += n * u * u;
        }
    }

    /// Variances of the singles, none of which may be zero.
    bool singles_invert(Slice<const double> c, Slice<const double> rows, Index width) {
        variance.assign(at(value.size), 0.0);
        const Index first = width - value.size;
        for (Index t = 0; t < c.size; ++t)
            for (Index j = 0; j < value.size; ++j) variance[at(j)] += c[t] * rows[t * width + first + j];
        for (Index j = 0; j < value.size; ++j) {
            const double v = variance[at(j)];
            if (!(v > 0.0)) return false;
            log_det += log(v);
            projection += tilt[j] * value[j] / v;
            on_slope += tilt[j] * tilt[j] / v;
        }
        return true;
    }

    /// All matrices of a pool side by side, with those that are given first: in reverse order.
    template <Index M>
    void pack(Slice<const double> rows, Index width, Index size, Index place, Index second, Index d) {
        const Index last = d * d - 1;
        for (Index i = 0; i <= last; ++i) packed[at((place + i) * M + size)] = known[second + last - i];
        for (Index t = 0; t < size; ++t)
            for (Index i = 0; i <= last; ++i)
                packed[at((place + i) * M + t)] = rows[t * width + place + last - i];
    }

    /// L^-1 of a pool; false where V is not positive definite.
    template <Index M>
    bool invert(Slice<const double> c, Index place, Index d) {
        factor.assign(at(d * d), 0.0);
        for (Index i = 0; i < d; ++i) {
            for (Index j = 0; j <= i; ++j) {
                double sum = 0.0;
                for (Index t = 0; t < c.size; ++t) sum += c[t] * packed[at((place + i * d + j) * M + t)];
                for (Index k = 0; k < j; ++k) sum -= factor[at(i * d + k)] * factor[at(j * d + k)];
                if (i > j) {
                    factor[at(i * d + j)] = sum / factor[at(j * d + j)];
                } else {
                    if (!(sum > 0.0 && sum < HUGE_VAL)) return false;
                    factor[at(i * d + i)] = sqrt(sum);
                }
            }
        }
        for (Index i = 0; i < d; ++i) {
            double* row = inverse.data() + place + i * d;
            for (Index k = 0; k < i; ++k) {
                const double share = factor[at(i * d + k)];
                const double* other = inverse.data() + place + k * d;
                for (Index j = 0; j <= k; ++j) row[j] -= share * other[j];
            }
            const double diagonal = factor[at(i * d + i)];
            for (Index j = 0; j < i; ++j) row[j] /= diagonal;
            row[i] = 1.0 / diagonal;
        }
        return true;
    }

    /// Adds what a pool says to gradient and information; returns tr(Z + I).
    template <Index M>
    double of_pool(Index place, Index moments, Index pool, Index size, double b, double spread, double (&down)[M],
                   double (&inner)[M * M]) {
        const Index d = Index(shapes[pool]);
        const double n = double(shapes[pool + 2]);
        const Slice<const double> w = view(ramp, moments, d), u = view(ramp, moments + d, d);
        half.assign(at(d * M), 0.0);
        double trace = 0.0;
        for (Index i = Index(shapes[pool + 1]); i < d; ++i) {
            for (Index k = 0; k <= i; ++k) {
                const Slice<const double> terms = view(packed, (place + k * d) * M, (i + 1) * M);
                product<M>(view(inverse, place + i * d, i + 1), terms, Slice<double>{half.data() + k * M, M});
            }
            for (Index j = 0; j <= i; ++j) {
                double B[M];
                product<M>(view(inverse, place + j * d, j + 1), view(half, 0, (j + 1) * M), Slice<double>{B, M});
                double z = B[size] - b * (w[i] * u[j] + u[i] * w[j]) + b * b * u[i] * u[j];
                B[size] = 0.0;
                if (i == j) trace += z, z -= 1.0;
                add<M>(B, i == j ? n / 2.0 : n, z + spread * u[i] * u[j], down, inner);
            }
        }
        return trace;
    }

    /// out_t = sum_l factor_l terms_lt. In pairs: only so do compilers keep the sums of any M in registers.
    template <Index M>
    static void product(Slice<const double> factor, Slice<const double> terms, Slice<double> out) noexcept {
        Pair sum[M / 2] = {};
        for (Index l = 0; l < factor.size; ++l)
            for (Index t = 0; t < M / 2; ++t) sum[t] += factor[l] * pair(terms.part(l * M + 2 * t, 2));
        for (Index t = 0; t < M; ++t) out[t] = sum[t / 2][t % 2];
    }

#if defined(__GNUC__)
    typedef double Pair __attribute__((vector_size(2 * sizeof(double))));
#else
    struct Pair {
        double a, b;
        Pair& operator+=(Pair o) noexcept { return a += o.a, b += o.b, *this; }
        double operator[](Index i) const noexcept { return i ? b : a; }
        friend Pair operator*(double x, Pair p) noexcept { return {x * p.a, x * p.b}; }
    };
#endif

    static Pair pair(Slice<const double> two) noexcept { return Pair{two[0], two[1]}; }

    template <Index M>
    static void add(const double (&f)[M], double weight, double z, double (&down)[M], double (&inner)[M * M]) noexcept {
        for (Index t = 0; t < M; ++t) {
            const double share = weight * f[t];
            down[t] += share * z;
            for (Index s = 0; s < M; ++s) inner[t * M + s] += share * f[s];
        }
    }

    static Slice<const double> view(const Numbers& numbers, Index first, Index length) {
        return Slice<const double>{numbers.data(), Index(numbers.size())}.part(first, length);
    }

    double log_det = 0.0, projection = 0.0, on_slope = 0.0;
    Slice<const int64_t> shapes;
    Slice<const double> known, value, tilt;
    Numbers packed, inverse, factor, ramp, variance, half;
};

}  // namespace allanite

#endif
