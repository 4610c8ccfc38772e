// SPDX-License-Identifier: BSD-3-Clause
// Vectors as slices, and the online accumulator with its memory, for the programs that test the kernels.
#ifndef ALLANITE_TESTS_RECORDS_HPP
#define ALLANITE_TESTS_RECORDS_HPP

#include <vector>

#include "allanite/online_allan.hpp"

namespace allanite {

using Reals = std::vector<double>;
using Integers = std::vector<int64_t>;

template <class T>
Slice<T> whole(std::vector<T>& v) {
    return {v.data(), Index(v.size())};
}

template <class T>
Slice<const T> fixed(const std::vector<T>& v) {
    return {v.data(), Index(v.size())};
}

/// An online accumulator with its memory.
template <class Scalar>
struct Online {
    Integers lags;
    OnlinePlan plan;
    std::vector<Scalar> numbers;
    Integers counters;

    Online(Integers wanted, int order, Index positions, Index block)
        : lags(wanted), plan{fixed(lags), order, positions, block} {
        const Index levels = online_levels(lags.back(), positions);
        numbers.resize(size_t(online_numbers(Index(lags.size()), levels, order, positions, block)));
        counters.resize(size_t(online_counters(Index(lags.size()), levels)));
    }
    Online(const Online&) = delete;
    Online& operator=(const Online&) = delete;

    void feed(const Reals& y, Index chunk) {
        const std::vector<Scalar> samples(y.begin(), y.end());
        const auto state = online_state(plan, whole(numbers), whole(counters));
        for (Index i = 0; i < Index(y.size()); i += chunk) {
            const Index length = i + chunk < Index(y.size()) ? chunk : Index(y.size()) - i;
            online_feed(plan, state, fixed(samples).part(i, length), Scalar(0));
        }
    }
    std::vector<Scalar> read(Integers& counts) {
        std::vector<Scalar> sums(lags.size());
        counts.assign(lags.size(), 0);
        online_read(plan, online_state(plan, whole(numbers), whole(counters)), whole(sums), whole(counts));
        return sums;
    }
};

Integers fitting_lags(int64_t longest, Index positions) {
    Integers lags;
    for (int64_t lag = 1; lag <= longest; ++lag) {
        if (online_lag_fits(lag, positions)) lags.push_back(lag);
    }
    return lags;
}

}  // namespace allanite

#endif
