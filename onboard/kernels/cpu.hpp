// Instruction sets of this machine's processor.
#pragma once

namespace eldorado {

// 0 baseline, 1 AVX2, 2 AVX-512 (F, BW, DQ, VL). Off x86-64 there is the baseline only: on ARM64 it has NEON already.
inline int simd_width() {
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("avx2")) return 0;
    const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    return wide ? 2 : 1;
#else
    return 0;
#endif
}

}  // namespace eldorado
