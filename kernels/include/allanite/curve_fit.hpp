// SPDX-License-Identifier: BSD-3-Clause
// The inner loop of the moment fit: Newton steps to the non-negative coefficients that explain an Allan curve best.
//
// With mu = B x (+ rest) the means of the variances v at L lags, W the inverse factor of the covariance of their cube
// roots and r = W ((v/mu)^(1/3) - centre), the objective is r'r + (2/3) sum ln mu. Each step goes to the non-negative
// minimum of its quadratic part, found by the active sets of Lawson and Hanson ("Solving Least Squares Problems", 1974,
// chapter 23) on the normal equations, which are scaled to a unit diagonal.
//
// Curves of independent records stand one below the other: W is then a row of triangles, and only these are kept.
#ifndef ALLANITE_CURVE_FIT_HPP
#define ALLANITE_CURVE_FIT_HPP

#include <math.h>

#include <algorithm>
#include <vector>

#include "ieee_only.hpp"
#include "slice.hpp"

namespace allanite {

/// What one record's variances are compared by: W and the means of the cube roots; returns log det C, or NaN where C has
/// no factor.
///
/// @param relative (L * L) covariance of the variances over the products of their means
/// @param discrepancy  relative error of the model at every lag      @param least  degrees of freedom, at least
/// @param whiten (L * L) is written: the lower triangle W, zeros above it      @param centre (L) is written
inline double curve_weight(Slice<const double> relative, double discrepancy, double least, Slice<double> whiten,
                           Slice<double> centre) {
    const Index n = centre.size;
    std::vector<double> spread(static_cast<std::size_t>(n)), sd(static_cast<std::size_t>(n));
    const Slice<double> r{spread.data(), n}, s{sd.data(), n};
    double log_det = 0.0;
    for (Index i = 0; i < n; ++i) {
        const double variance = fmax(relative[i * n + i], 1e-14), share = 2.0 / (9.0 * fmax(2.0 / variance, least));
        r[i] = sqrt(variance);
        s[i] = sqrt(share);
        centre[i] = 1.0 - share;
        const double extra = discrepancy / 3.0 / s[i];
        for (Index j = 0; j < n; ++j) whiten[i * n + j] = j < i ? relative[i * n + j] / (r[i] * r[j]) : 0.0;
        double pivot = 1.0 + 1e-9 + extra * extra;
        for (Index j = 0; j < i; ++j) {  // the factor, row by row
            double sum = whiten[i * n + j];
            for (Index k = 0; k < j; ++k) sum -= whiten[i * n + k] * whiten[j * n + k];
            sum /= whiten[j * n + j];
            whiten[i * n + j] = sum;
            pivot -= sum * sum;
        }
        if (!(pivot > 0.0)) return NAN;
        whiten[i * n + i] = sqrt(pivot);
        log_det += log(pivot) + log(share);
    }
    for (Index i = 0; i < n; ++i) {  // its inverse, in its place
        const double diagonal = whiten[i * n + i];
        for (Index j = 0; j < i; ++j) {
            double sum = 0.0;
            for (Index k = j; k < i; ++k) sum += whiten[i * n + k] * whiten[k * n + j];
            whiten[i * n + j] = -sum / diagonal;
        }
        whiten[i * n + i] = 1.0 / diagonal;
    }
    for (Index i = 0; i < n; ++i)
        for (Index j = 0; j <= i; ++j) whiten[i * n + j] /= s[j];
    return log_det;
}

/// Minus twice the log-likelihood of a curve under each of n models, up to a constant; infinite where the covariance
/// that a model itself gives the curve has no factor.
///
/// @param variance (L)      @param means (n * L) of the variances under each model
/// @param weights  (n * P)  @param parts (tables * P * L * L): the covariance is the sum of the parts of the model's
/// table times its weights; the lower triangle is read     @param tables (n) that of each model
inline void curve_levels(Slice<const double> variance, Slice<const double> means, Slice<const double> weights,
                         Slice<const double> parts, Slice<const int64_t> tables, double discrepancy, double least,
                         Slice<double> levels) {
    const Index n = variance.size, square = n * n, p = levels.size > 0 ? weights.size / levels.size : 0;
    std::vector<double> relative(static_cast<std::size_t>(square)), inverse(relative.size()),
        roots(static_cast<std::size_t>(n));
    const Slice<double> C{relative.data(), square}, W{inverse.data(), square}, centre{roots.data(), n};
    for (Index model = 0; model < levels.size; ++model) {
        const Slice<const double> mu = means.part(model * n, n);
        std::fill(relative.begin(), relative.end(), 0.0);
        for (Index k = 0; k < p; ++k) {
            const double weight = weights[model * p + k];
            const Slice<const double> part = parts.part((Index(tables[model]) * p + k) * square, square);
            for (Index i = 0; i < n; ++i)
                for (Index j = 0; j <= i; ++j) C[i * n + j] += weight * part[i * n + j];
        }
        for (Index i = 0; i < n; ++i)
            for (Index j = 0; j <= i; ++j) C[i * n + j] /= mu[i] * mu[j];
        double level = curve_weight(fixed(C), discrepancy, least, W, centre);
        for (Index i = 0; i < n; ++i) centre[i] = cbrt(variance[i] / mu[i]) - centre[i];
        for (Index i = 0; i < n; ++i) {
            double residual = 0.0;
            for (Index j = 0; j <= i; ++j) residual += W[i * n + j] * centre[j];
            level += residual * residual + 2.0 / 3.0 * log(mu[i]);
        }
        levels[model] = isfinite(level) ? level : HUGE_VAL;
    }
}

/// Variances, what they are compared by, and the memory that a step needs; for p coefficients at L lags.
class CurveFit {
public:
    /// @param variance (L)         @param whiten (L * width) lower triangles, row by row
    /// @param starts   (L) column of W in which a row begins: that of the first lag of its record
    /// @param centre   (L) means of the cube roots         @param coefficients p
    CurveFit(Slice<const double> variance, Slice<const double> whiten, Slice<const int64_t> starts,
             Slice<const double> centre, Index coefficients)
        : v(variance), w(whiten), begin(starts), c(centre), lags(variance.size),
          width(lags > 0 ? whiten.size / lags : 0), p(coefficients), root(length(lags)),
          residual(length(lags)), pull(length(lags)), slope(length(lags * p)), rooted(length(lags * p)),
          H(length(p * p)), L(length(p * p)), sub(length(p * p)), scale(length(p)), target(length(p)), y(length(p)),
          x(length(p)), trial(length(p)), active(length(p)) {}

    /// The objective at these means.
    double objective(Slice<const double> mu) {
        whitened(mu);
        double sum = 0.0, logs = 0.0;
        for (Index i = 0; i < lags; ++i) sum += residual[at(i)] * residual[at(i)];
        for (Index i = 0; i < lags; ++i) logs += log(mu[i]);
        return sum + 2.0 / 3.0 * logs;
    }

    /// Newton step to the non-negative minimum of the quadratic part; Gauss-Newton where that is not convex; zeros
    /// where even this has no direction.
    ///
    /// @param columns (L * p) row by row    @param here (p)    @param mu (L) means there    @param step (p) is written
    void step(Slice<const double> columns, Slice<const double> here, Slice<const double> mu, Slice<double> out) {
        whitened(mu);
        std::fill(pull.begin(), pull.end(), 0.0);
        for (Index k = 0; k < lags; ++k)
            for (Index i = Index(begin[k]); i <= k; ++i) pull[at(i)] += whitener(k, i) * residual[at(k)];
        for (Index i = 0; i < lags; ++i) {
            pull[at(i)] *= 2.0 / 3.0 * root[at(i)];
            for (Index j = 0; j < p; ++j) slope[at(i * p + j)] = columns[i * p + j] / mu[i];
        }
        squares(0.0);
        for (Index i = 0; i < lags; ++i) {
            const double bend = 4.0 / 3.0 * pull[at(i)] - 2.0 / 3.0;
            for (Index j = 0; j < p; ++j)
                for (Index k = 0; k < p; ++k)
                    H[at(j * p + k)] += bend * slope[at(i * p + j)] * slope[at(i * p + k)];
        }
        if (!factored()) {
            // where the model lies far above the data the slope vanishes; the expected one still shows the way down
            squares(0.6);
            if (!factored()) {
                for (Index j = 0; j < p; ++j) out[j] = 0.0;
                return;
            }
        }
        for (Index j = 0; j < p; ++j) y[at(j)] = here[j] * scale[at(j)];
        for (Index j = 0; j < p; ++j) {
            double sum = 0.0, down = 0.0;
            for (Index k = 0; k < p; ++k) sum += H[at(j * p + k)] * y[at(k)];
            for (Index i = 0; i < lags; ++i) down += (2.0 / 3.0 - pull[at(i)]) * slope[at(i * p + j)];
            target[at(j)] = sum - down / scale[at(j)];
        }
        solved(L, p, target, x);
        if (p > 0 && *std::min_element(x.begin(), x.end()) < 0.0) not_negative();
        for (Index j = 0; j < p; ++j) out[j] = (x[at(j)] - y[at(j)]) / scale[at(j)];
    }

    /// Steps with halving from `here` (p), in and out, until they gain less than `settled`.
    ///
    /// @param columns (L * p) row by row    @param rest (L) means of what is held
    void minimise(Slice<const double> columns, Slice<const double> rest, Slice<double> here, int steps,
                  double settled) {
        std::vector<double> mu(length(lags)), moved(length(p)), next(length(p)), mu_next(length(lags));
        means(columns, rest, fixed(here), view(mu));
        double value = objective(fixed(view(mu)));
        for (int k = 0; k < steps; ++k) {
            step(columns, fixed(here), fixed(view(mu)), view(moved));
            double size = 1.0, reached = HUGE_VAL;
            while (size > 1e-7) {
                for (Index j = 0; j < p; ++j) next[at(j)] = std::max(here[j] + size * moved[at(j)], 0.0);
                means(columns, rest, fixed(view(next)), view(mu_next));
                if (*std::min_element(mu_next.begin(), mu_next.end()) > 0.0) {
                    reached = objective(fixed(view(mu_next)));
                    if (reached <= value + 1e-12) break;
                }
                size /= 2.0;
            }
            if (!(reached <= value + 1e-12)) return;
            const double gain = value - reached;
            for (Index j = 0; j < p; ++j) here[j] = next[at(j)];
            mu.swap(mu_next);
            value = reached;
            if (gain < settled) return;
        }
    }

private:
    using Numbers = std::vector<double>;

    double whitener(Index row, Index column) const { return w[row * width + column - Index(begin[row])]; }

    static size_t length(Index n) { return static_cast<size_t>(n); }
    static size_t at(Index i) { return static_cast<size_t>(i); }
    static Slice<double> view(Numbers& numbers) { return {numbers.data(), static_cast<Index>(numbers.size())}; }

    void means(Slice<const double> columns, Slice<const double> rest, Slice<const double> at_x, Slice<double> mu) {
        for (Index i = 0; i < lags; ++i) {
            double sum = rest[i];
            for (Index j = 0; j < p; ++j) sum += columns[i * p + j] * at_x[j];
            mu[i] = sum;
        }
    }

    /// Cube roots and the whitened residuals.
    void whitened(Slice<const double> mu) {
        for (Index i = 0; i < lags; ++i) root[at(i)] = cbrt(v[i] / mu[i]);
        for (Index i = 0; i < lags; ++i) {
            double sum = 0.0;
            for (Index k = Index(begin[i]); k <= i; ++k) sum += whitener(i, k) * (root[at(k)] - c[k]);
            residual[at(i)] = sum;
        }
    }

    /// H = 2/9 J'J of the whitened slopes, roots being at least `floor`.
    void squares(double floor) {
        for (Index i = 0; i < lags; ++i) {
            for (Index j = 0; j < p; ++j) {
                double sum = 0.0;
                for (Index k = Index(begin[i]); k <= i; ++k)
                    sum += whitener(i, k) * std::max(root[at(k)], floor) * slope[at(k * p + j)];
                rooted[at(i * p + j)] = sum;
            }
        }
        for (Index j = 0; j < p; ++j) {
            for (Index k = 0; k < p; ++k) {
                double sum = 0.0;
                for (Index i = 0; i < lags; ++i) sum += rooted[at(i * p + j)] * rooted[at(i * p + k)];
                H[at(j * p + k)] = 2.0 / 9.0 * sum;
            }
        }
    }

    /// H scaled to a unit diagonal, and its Cholesky factor; false where it is not positive definite.
    bool factored() {
        for (Index j = 0; j < p; ++j) {
            const double diagonal = H[at(j * p + j)];
            if (!(diagonal > 0.0)) return false;
            scale[at(j)] = sqrt(diagonal);
        }
        for (Index j = 0; j < p; ++j)
            for (Index k = 0; k < p; ++k) H[at(j * p + k)] /= scale[at(j)] * scale[at(k)];
        for (Index j = 0; j < p; ++j) H[at(j * p + j)] = 1.0 + 1e-9;
        return cholesky(H, p, L);
    }

    static bool cholesky(const Numbers& A, Index n, Numbers& factor) {
        for (Index j = 0; j < n; ++j) {
            for (Index i = j; i < n; ++i) {
                double sum = A[at(i * n + j)];
                for (Index k = 0; k < j; ++k) sum -= factor[at(i * n + k)] * factor[at(j * n + k)];
                if (i == j) {
                    if (!(sum > 0.0)) return false;
                    factor[at(j * n + j)] = sqrt(sum);
                } else {
                    factor[at(i * n + j)] = sum / factor[at(j * n + j)];
                }
            }
        }
        return true;
    }

    static void solved(const Numbers& factor, Index n, const Numbers& right, Numbers& out) {
        for (Index i = 0; i < n; ++i) {
            double sum = right[at(i)];
            for (Index k = 0; k < i; ++k) sum -= factor[at(i * n + k)] * out[at(k)];
            out[at(i)] = sum / factor[at(i * n + i)];
        }
        for (Index i = n - 1; i >= 0; --i) {
            double sum = out[at(i)];
            for (Index k = i + 1; k < n; ++k) sum -= factor[at(k * n + i)] * out[at(k)];
            out[at(i)] = sum / factor[at(i * n + i)];
        }
    }

    /// x: the minimum of x'Hx/2 - target'x over x >= 0.
    void not_negative() {
        double largest = 0.0;
        for (Index j = 0; j < p; ++j) largest = std::max(largest, fabs(target[at(j)]));
        const double least = 1e-13 * largest;
        std::fill(x.begin(), x.end(), 0.0);
        std::fill(active.begin(), active.end(), char(0));
        for (Index round = 0; round < 3 * p; ++round) {
            Index best = -1;
            double steepest = least;
            for (Index j = 0; j < p; ++j) {
                if (active[at(j)]) continue;
                double down = target[at(j)];
                for (Index k = 0; k < p; ++k) down -= H[at(j * p + k)] * x[at(k)];
                if (down > steepest) best = j, steepest = down;
            }
            if (best < 0) return;
            active[at(best)] = 1;
            while (!of_active()) {
                // back to where the first coefficient reaches zero, which leaves the set
                double share = 1.0;
                Index first = -1;
                for (Index j = 0; j < p; ++j) {
                    if (!active[at(j)] || trial[at(j)] > 0.0) continue;
                    const double way = x[at(j)] - trial[at(j)], here = way > 0.0 ? x[at(j)] / way : 0.0;
                    if (first < 0 || here < share) first = j, share = here;
                }
                for (Index j = 0; j < p; ++j)
                    if (active[at(j)]) x[at(j)] += share * (trial[at(j)] - x[at(j)]);
                x[at(first)] = 0.0;
                active[at(first)] = 0;
            }
            x = trial;
        }
    }

    /// `trial`: the minimum over the active coefficients; whether all of them are positive there.
    bool of_active() {
        Numbers right, out;
        std::vector<Index> of;
        for (Index j = 0; j < p; ++j)
            if (active[at(j)]) of.push_back(j);
        const Index n = static_cast<Index>(of.size());
        Numbers A(length(n * n));
        for (Index i = 0; i < n; ++i) {
            right.push_back(target[at(of[at(i)])]);
            for (Index k = 0; k < n; ++k) A[at(i * n + k)] = H[at(of[at(i)] * p + of[at(k)])];
        }
        out.resize(length(n));
        std::fill(trial.begin(), trial.end(), 0.0);
        bool positive = true;
        if (n > 0 && cholesky(A, n, sub)) solved(sub, n, right, out);
        for (Index i = 0; i < n; ++i) {
            trial[at(of[at(i)])] = out[at(i)];
            positive = positive && out[at(i)] > 0.0;
        }
        return positive;
    }

    Slice<const double> v, w;
    Slice<const int64_t> begin;
    Slice<const double> c;
    Index lags, width, p;
    Numbers root, residual, pull, slope, rooted, H, L, sub, scale, target, y, x, trial;
    std::vector<char> active;
};

}  // namespace allanite

#endif
