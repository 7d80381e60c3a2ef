// A function that is built for wider vectors, too; the loader takes what the processor has.
#pragma once

// Before the definition of a function in a source file. Without fused multiplication, so every
// clone computes the same numbers. Sanitizers' runtimes start after the loader has chosen.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define ATLAS_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define ATLAS_VECTOR_CLONES
#endif
