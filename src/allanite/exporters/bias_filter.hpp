// SPDX-License-Identifier: BSD-3-Clause
// The filter that `allanite export cpp` writes behind the constants of a model, in their namespace: everything from the
// line below on, and from the second line on only where the model has a steady gain. The arithmetic is that of the
// allanite/*.hpp of the kernels, which the Python package runs too; it is written before the constants.

// -- the filter -------------------------------------------------------------------------------------------------------

using allanite::Index;
using allanite::Slice;

template <class T, Index size>
constexpr Slice<T> all_of(T (&array)[size]) noexcept {
    return {array, size};
}

/// Everything the filter carries, and its scratch. The covariance is kept as its factors U and D (one matrix): no
/// rounding can make it less than positive, whatever the length of the run.
struct BiasFilter {
    Scalar state[n_states];
    Scalar factors[n_states * n_states];
    bool is_started;
    Scalar gain[n_states];
    Scalar transition_parts[allanite::transition_numbers(n_states)];
    Scalar process_parts[allanite::factor_prediction_numbers(n_states)];
    Scalar work[allanite::orthogonalise_scratch(n_states, n_states)];
    allanite::Transition<Scalar> transition_plan;
    allanite::FactorPrediction<Scalar> process_plan;
};

/// Before the first sample. The filter must stay where it is in memory from then on: it points into itself.
inline void begin(BiasFilter& f) noexcept {
    f.is_started = false;
    f.transition_plan = allanite::split_transition<Scalar>(all_of(transition), n_states, all_of(f.transition_parts));
    f.process_plan = allanite::plan_factors<Scalar>(f.transition_plan, all_of(process), all_of(f.process_parts));
    for (Index i = 0; i < n_states; ++i) f.state[i] = Scalar(0);
}

/// State and covariance of the next sample.
inline void predict(BiasFilter& f) noexcept {
    allanite::predict_state<n_states, Scalar>(f.transition_plan, all_of(f.state), all_of(f.gain));
    allanite::predict_factors<n_states, Scalar>(f.transition_plan, f.process_plan, all_of(f.factors), all_of(f.work));
}

/// One sample: y at rest; not a number while the sensor moves, or where the sample is missing. Returns the innovation,
/// not a number where there is none.
inline Scalar on_sample(BiasFilter& f, Scalar y) noexcept {
    Scalar innovation = allanite::not_a_number<Scalar>();
    if (!f.is_started) {
        if (!allanite::is_finite(y)) return innovation;
        for (Index i = 0; i < n_states; ++i) f.state[i] = start_gain[i] * y;
        for (Index i = 0; i < n_states * n_states; ++i) f.factors[i] = start_covariance[i];
        f.is_started = allanite::factor<Scalar>(all_of(f.factors), n_states, all_of(f.gain));
    } else {
        innovation = allanite::update_factors<n_states, Scalar>(all_of(output), noise, y, all_of(f.state),
                                                                all_of(f.factors), all_of(f.gain), all_of(f.work))
                         .innovation;
    }
    predict(f);
    return innovation;
}

/// What to subtract from the samples; 0 before the first.
inline Scalar bias(const BiasFilter& f) noexcept {
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(f.state));
}

/// Its variance; not a number before the first sample.
inline Scalar bias_variance(const BiasFilter& f) noexcept {
    if (!f.is_started) return allanite::not_a_number<Scalar>();
    Scalar product[n_states];
    allanite::product_of_factors<Scalar>(all_of(f.factors), all_of(bias_of_states), all_of(product));
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(product));
}

// -- with the steady gain ---------------------------------------------------------------------------------------------

/// The same with the gain that the filter settles at: no covariance, a few multiplications per sample. It takes long to
/// forget where it starts, so begin() it with a mean of samples at rest.
struct FixedGainFilter {
    Scalar state[n_states];
};

inline void begin(FixedGainFilter& f, Scalar mean_at_rest) noexcept {
    for (Index i = 0; i < n_states; ++i) f.state[i] = start_gain[i] * mean_at_rest;
}

inline void on_sample(FixedGainFilter& f, Scalar y) noexcept {
    const Scalar innovation = y - allanite::dot<n_states>(all_of(output), all_of(f.state));
    Scalar next[n_states];
    for (Index i = 0; allanite::is_finite(y) && i < n_states; ++i) f.state[i] += steady_gain[i] * innovation;
    for (Index i = 0; i < n_states; ++i) {
        next[i] = Scalar(0);
        for (Index j = 0; j < n_states; ++j) next[i] += transition[i * n_states + j] * f.state[j];
    }
    for (Index i = 0; i < n_states; ++i) f.state[i] = next[i];
}

inline Scalar bias(const FixedGainFilter& f) noexcept {
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(f.state));
}
