// SPDX-License-Identifier: BSD-3-Clause
// A pointer and a length, and the index type of all kernels.
#ifndef ALLANITE_SLICE_HPP
#define ALLANITE_SLICE_HPP

#include <stddef.h>
#include <stdint.h>

// A function that takes in all that it calls; not in the test build, where each access carries its check.
#if defined(ALLANITE_CHECK_BOUNDS) || !defined(__GNUC__)
#define ALLANITE_FLAT
#else
#define ALLANITE_FLAT __attribute__((flatten))
#endif

namespace allanite {

using Index = ptrdiff_t;

/// A view of `size` elements owned by the caller. Off-by-one in windows of m, 2m, 3m samples is *the* bug of this
/// field: with ALLANITE_CHECK_BOUNDS each access is checked (the test build); without it this is a bare pointer.
template <class T>
struct Slice {
    T* data;
    Index size;

    T& operator[](Index i) const noexcept {
#ifdef ALLANITE_CHECK_BOUNDS
        if (i < 0 || i >= size) __builtin_trap();
#endif
        return data[i];
    }

    /// Elements [start, start + length).
    Slice part(Index start, Index length) const noexcept {
#ifdef ALLANITE_CHECK_BOUNDS
        if (start < 0 || length < 0 || start + length > size) __builtin_trap();
#endif
        return {data + start, length};
    }
};

/// The same elements, not to be changed.
template <class T>
constexpr Slice<const T> fixed(Slice<T> slice) noexcept {
    return {slice.data, slice.size};
}

}  // namespace allanite

#endif
