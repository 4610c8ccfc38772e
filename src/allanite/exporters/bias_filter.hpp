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
    Scalar gate;   ///< standard deviations of the innovation beyond which a sample is left out; 0: none is
    int left_out;  ///< samples in a row that were left out so
    bool is_started;
    Scalar gain[n_states];
    Scalar transition_parts[allanite::transition_numbers(n_states)];
    Scalar process_parts[allanite::factor_prediction_numbers(n_states)];
    Scalar work[allanite::orthogonalise_scratch(n_states, n_states)];
    allanite::Transition<Scalar> transition_plan;
    allanite::FactorPrediction<Scalar> process_plan;
};

/// Before the first sample. The filter must stay where it is in memory from then on: it points into itself.
/// gate: see there; 5 is usual where samples may be spikes.
inline void begin(BiasFilter& f, Scalar gate = Scalar(0)) noexcept {
    f.gate = gate;
    f.left_out = 0;
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

/// The variance of readout . s, from the factors.
inline Scalar variance_of(const BiasFilter& f, Slice<const Scalar> readout) noexcept {
    Scalar product[n_states];
    allanite::product_of_factors<Scalar>(all_of(f.factors), readout, all_of(product));
    return allanite::dot<n_states>(readout, all_of(product));
}

/// The innovation that y would have, without using y: y less its prediction. Not a number where there is none: before
/// the first sample, or y is missing.
inline Scalar innovation(const BiasFilter& f, Scalar y) noexcept {
    if (!f.is_started || !allanite::is_finite(y)) return allanite::not_a_number<Scalar>();
    return y - allanite::dot<n_states>(all_of(output), all_of(f.state));
}

/// Its variance; not a number before the first sample.
inline Scalar innovation_variance(const BiasFilter& f) noexcept {
    return f.is_started ? variance_of(f, all_of(output)) + noise : allanite::not_a_number<Scalar>();
}

/// Is y further from its prediction than the gate lets pass?
inline bool is_beyond_gate(const BiasFilter& f, Scalar y) noexcept {
    if (!(f.gate > Scalar(0)) || !f.is_started || !allanite::is_finite(y)) return false;
    const Scalar v = innovation(f, y);
    return v * v > f.gate * f.gate * innovation_variance(f);
}

/// One sample: y at rest; not a number while the sensor moves, or where the sample is missing. Returns the innovation,
/// that of a sample too that the gate leaves out; not a number where there is none.
inline Scalar on_sample(BiasFilter& f, Scalar y) noexcept {
    const Scalar found = innovation(f, y);
    const bool is_left_out = is_beyond_gate(f, y);
    if (is_left_out) {
        ++f.left_out;
    } else if (allanite::is_finite(y)) {
        f.left_out = 0;
    }
    if (f.is_started && !is_left_out) {
        allanite::update_factors<n_states, Scalar>(all_of(output), noise, y, all_of(f.state), all_of(f.factors),
                                                   all_of(f.gain), all_of(f.work));
    } else if (!f.is_started) {
        if (!allanite::is_finite(y)) return found;
        for (Index i = 0; i < n_states; ++i) f.state[i] = start_gain[i] * y;
        for (Index i = 0; i < n_states * n_states; ++i) f.factors[i] = start_covariance[i];
        f.is_started = allanite::factor<Scalar>(all_of(f.factors), n_states, all_of(f.gain));
    }
    predict(f);
    return found;
}

/// What to subtract from the samples; 0 before the first.
inline Scalar bias(const BiasFilter& f) noexcept {
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(f.state));
}

/// Its variance; not a number before the first sample.
inline Scalar bias_variance(const BiasFilter& f) noexcept {
    return f.is_started ? variance_of(f, all_of(bias_of_states)) : allanite::not_a_number<Scalar>();
}

// -- with the steady gain ---------------------------------------------------------------------------------------------

/// The same with the gain that the filter settles at: no covariance, a few multiplications per sample. It is slow to
/// forget its start: initialize it with begin() and the mean of some samples at rest.
struct FixedGainFilter {
    Scalar state[n_states];
    Scalar gate;   ///< as that of BiasFilter, in standard deviations of the settled innovation
    int left_out;  ///< samples in a row that were left out so
};

inline void begin(FixedGainFilter& f, Scalar mean_at_rest, Scalar gate = Scalar(0)) noexcept {
    f.gate = gate;
    f.left_out = 0;
    for (Index i = 0; i < n_states; ++i) f.state[i] = start_gain[i] * mean_at_rest;
}

/// As innovation() of BiasFilter.
inline Scalar innovation(const FixedGainFilter& f, Scalar y) noexcept {
    if (!allanite::is_finite(y)) return allanite::not_a_number<Scalar>();
    return y - allanite::dot<n_states>(all_of(output), all_of(f.state));
}

/// As on_sample() of BiasFilter.
inline Scalar on_sample(FixedGainFilter& f, Scalar y) noexcept {
    const Scalar found = innovation(f, y), most = f.gate * steady_innovation_sd;
    const bool is_there = allanite::is_finite(y), is_left_out = is_there && most > Scalar(0) && found * found > most * most;
    if (is_there) f.left_out = is_left_out ? f.left_out + 1 : 0;
    Scalar next[n_states];
    for (Index i = 0; is_there && !is_left_out && i < n_states; ++i) f.state[i] += steady_gain[i] * found;
    for (Index i = 0; i < n_states; ++i) {
        next[i] = Scalar(0);
        for (Index j = 0; j < n_states; ++j) next[i] += transition[i * n_states + j] * f.state[j];
    }
    for (Index i = 0; i < n_states; ++i) f.state[i] = next[i];
    return found;
}

inline Scalar bias(const FixedGainFilter& f) noexcept {
    return allanite::dot<n_states>(all_of(bias_of_states), all_of(f.state));
}
