#pragma once

/// Compiles a kernel for several instruction sets; which one runs is decided when the program is
/// loaded. All give the same bits: no fused operations (-ffp-contract=off), no reordering.
#if defined(__x86_64__) && !defined(__AVX2__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__clang__)
#define SCARP_VECTOR_KERNEL __attribute__((target_clones("avx2", "default")))
#else
#define SCARP_VECTOR_KERNEL
#endif

/// What a kernel is made of: compiled anew inside every kernel, for its instruction set. A call
/// would go to a function for the lowest one.
#if defined(__GNUC__)
#define SCARP_KERNEL_PART [[gnu::always_inline]] inline
#else
#define SCARP_KERNEL_PART inline
#endif
