// Vectorised loops without special compile options.
#pragma once

// A function marked so is compiled for AVX-512, AVX2 and the baseline, and the loader picks by CPU.
// Lambdas and templates it calls must be forced inline to be compiled along. The sanitizers run
// before the loader's choice works: baseline only there.
#if defined(__x86_64__) && defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define LUXFIELD_SIMD_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define LUXFIELD_SIMD_CLONES
#endif
#define LUXFIELD_INLINE inline __attribute__((always_inline))

// Asserts that a loop's iterations are independent, so that it needs no run-time alias check.
#if defined(__clang__)
#define LUXFIELD_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#else
#define LUXFIELD_INDEPENDENT _Pragma("GCC ivdep")
#endif
