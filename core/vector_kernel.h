#pragma once

#include <bit>
#include <cstdint>

/// Compiles a kernel for several instruction sets; which one runs is decided when the program is
/// loaded. All give the same bits: no fused operations (-ffp-contract=off), no reordering.
/// Sanitizers are not ready where that is decided.
#if defined(__x86_64__) && !defined(__AVX2__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__clang__)
#define SCARP_VECTOR_KERNEL __attribute__((target_clones("avx2", "default")))
#else
#define SCARP_VECTOR_KERNEL
#endif

/// The same for loops that gain by the widest registers, too.
#if defined(__x86_64__) && !defined(__SANITIZE_THREAD__)
#define SCARP_WIDE_KERNEL [[gnu::target_clones("avx512f", "avx2", "default")]]
#else
#define SCARP_WIDE_KERNEL
#endif

/// What a kernel is made of: compiled anew inside every kernel, for its instruction set. A call
/// would go to a function for the lowest one.
#if defined(__GNUC__)
#define SCARP_KERNEL_PART [[gnu::always_inline]] inline
#else
#define SCARP_KERNEL_PART inline
#endif

namespace scarp {

/// a where it holds, b elsewhere, without a branch: compilers thread several conditions into a maze
/// of paths, and then make no vectors of a loop.
SCARP_KERNEL_PART float select(bool holds, float a, float b) {
  const std::int32_t mask = -static_cast<std::int32_t>(holds);
  return std::bit_cast<float>((mask & std::bit_cast<std::int32_t>(a)) |
                              (~mask & std::bit_cast<std::int32_t>(b)));
}
SCARP_KERNEL_PART double select(bool holds, double a, double b) {
  const std::int64_t mask = -static_cast<std::int64_t>(holds);
  return std::bit_cast<double>((mask & std::bit_cast<std::int64_t>(a)) |
                               (~mask & std::bit_cast<std::int64_t>(b)));
}

/// As std::max and std::min, by value: references are paths through memory to loops.
SCARP_KERNEL_PART float larger(float a, float b) { return a < b ? b : a; }
SCARP_KERNEL_PART float smaller(float a, float b) { return b < a ? b : a; }

}  // namespace scarp
