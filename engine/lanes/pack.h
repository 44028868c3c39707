#pragma once
// Packs: W doubles, one per lane, and the operations that kernels use. Kernels are templates on T; plain `double` is
// the instance for one lane. Every operation rounds once and correctly (fma is one operation), so all lane widths and
// instruction sets give the same bits. Masks are combined with & | and negated with ! (which, unlike ~, is right for
// bool, too).

#include <cmath>

#include "engine/lanes/isa_namespace.h"

#if defined(GRAZE_ISA_AVX512) || defined(GRAZE_ISA_AVX2)
#include <immintrin.h>
#endif

// Before a loop of few turns that must become straight code, so that its arrays live in registers.
// For what is rarely called: keeps its variables out of the callers' registers.
#define GRAZE_OUT_OF_LINE __attribute__((noinline))

#if defined(__clang__)
#define GRAZE_UNROLL _Pragma("clang loop unroll(full)")
#else
#define GRAZE_UNROLL _Pragma("GCC unroll 8")
#endif

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

// --- One hardware register ------------------------------------------------------------------------------------------
// GCC 12 warns about its own unmasked min, max and sqrt of 512 bits; with a full mask they are the same instructions.
// `Register` and its functions are all that differs between instruction sets. reg_min(a, b) is a < b ? a : b, also for
// zeros and NaN (as the vminpd instruction).

#if defined(GRAZE_ISA_AVX512)

inline constexpr int kRegisterLanes = 8;
using Register = __m512d;
using RegisterMask = __mmask8;

inline Register reg_set(double a) { return _mm512_set1_pd(a); }
inline Register reg_load(const double* p) { return _mm512_loadu_pd(p); }
inline void reg_store(double* p, Register a) { _mm512_storeu_pd(p, a); }
inline Register reg_add(Register a, Register b) { return _mm512_add_pd(a, b); }
inline Register reg_sub(Register a, Register b) { return _mm512_sub_pd(a, b); }
inline Register reg_mul(Register a, Register b) { return _mm512_mul_pd(a, b); }
inline Register reg_div(Register a, Register b) { return _mm512_div_pd(a, b); }
inline Register reg_fma(Register a, Register b, Register c) { return _mm512_fmadd_pd(a, b, c); }
inline Register reg_fnma(Register a, Register b, Register c) { return _mm512_fnmadd_pd(a, b, c); }
inline Register reg_sqrt(Register a) { return _mm512_maskz_sqrt_pd(0xff, a); }
inline Register reg_min(Register a, Register b) { return _mm512_maskz_min_pd(0xff, a, b); }
inline Register reg_max(Register a, Register b) { return _mm512_maskz_max_pd(0xff, a, b); }
inline Register reg_neg(Register a) { return _mm512_xor_pd(a, _mm512_set1_pd(-0.0)); }
inline Register reg_abs(Register a) { return _mm512_andnot_pd(_mm512_set1_pd(-0.0), a); }
inline RegisterMask reg_lt(Register a, Register b) { return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ); }
inline RegisterMask reg_le(Register a, Register b) { return _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ); }
inline RegisterMask reg_eq(Register a, Register b) { return _mm512_cmp_pd_mask(a, b, _CMP_EQ_OQ); }
inline RegisterMask reg_and(RegisterMask a, RegisterMask b) { return static_cast<RegisterMask>(a & b); }
inline RegisterMask reg_or(RegisterMask a, RegisterMask b) { return static_cast<RegisterMask>(a | b); }
inline RegisterMask reg_not(RegisterMask a) { return static_cast<RegisterMask>(~a); }
inline Register reg_select(RegisterMask m, Register a, Register b) { return _mm512_mask_blend_pd(m, b, a); }
inline unsigned reg_bits(RegisterMask m) { return m; }
inline RegisterMask reg_mask(unsigned bits) { return static_cast<RegisterMask>(bits); }

#elif defined(GRAZE_ISA_AVX2)

inline constexpr int kRegisterLanes = 4;
using Register = __m256d;
struct RegisterMask {
  __m256d m;
};

inline Register reg_set(double a) { return _mm256_set1_pd(a); }
inline Register reg_load(const double* p) { return _mm256_loadu_pd(p); }
inline void reg_store(double* p, Register a) { _mm256_storeu_pd(p, a); }
inline Register reg_add(Register a, Register b) { return _mm256_add_pd(a, b); }
inline Register reg_sub(Register a, Register b) { return _mm256_sub_pd(a, b); }
inline Register reg_mul(Register a, Register b) { return _mm256_mul_pd(a, b); }
inline Register reg_div(Register a, Register b) { return _mm256_div_pd(a, b); }
inline Register reg_fma(Register a, Register b, Register c) { return _mm256_fmadd_pd(a, b, c); }
inline Register reg_fnma(Register a, Register b, Register c) { return _mm256_fnmadd_pd(a, b, c); }
inline Register reg_sqrt(Register a) { return _mm256_sqrt_pd(a); }
inline Register reg_min(Register a, Register b) { return _mm256_min_pd(a, b); }
inline Register reg_max(Register a, Register b) { return _mm256_max_pd(a, b); }
inline Register reg_neg(Register a) { return _mm256_xor_pd(a, _mm256_set1_pd(-0.0)); }
inline Register reg_abs(Register a) { return _mm256_andnot_pd(_mm256_set1_pd(-0.0), a); }
inline RegisterMask reg_lt(Register a, Register b) { return {_mm256_cmp_pd(a, b, _CMP_LT_OQ)}; }
inline RegisterMask reg_le(Register a, Register b) { return {_mm256_cmp_pd(a, b, _CMP_LE_OQ)}; }
inline RegisterMask reg_eq(Register a, Register b) { return {_mm256_cmp_pd(a, b, _CMP_EQ_OQ)}; }
inline RegisterMask reg_and(RegisterMask a, RegisterMask b) { return {_mm256_and_pd(a.m, b.m)}; }
inline RegisterMask reg_or(RegisterMask a, RegisterMask b) { return {_mm256_or_pd(a.m, b.m)}; }
inline RegisterMask reg_not(RegisterMask a) {
  return {_mm256_xor_pd(a.m, _mm256_castsi256_pd(_mm256_set1_epi64x(-1)))};
}
inline Register reg_select(RegisterMask m, Register a, Register b) { return _mm256_blendv_pd(b, a, m.m); }
inline unsigned reg_bits(RegisterMask m) { return static_cast<unsigned>(_mm256_movemask_pd(m.m)); }
inline RegisterMask reg_mask(unsigned bits) {
  const __m256i bit = _mm256_set_epi64x(8, 4, 2, 1);
  return {_mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(_mm256_set1_epi64x(bits), bit), bit))};
}

#else

inline constexpr int kRegisterLanes = 1;
using Register = double;
using RegisterMask = bool;

inline Register reg_set(double a) { return a; }
inline Register reg_load(const double* p) { return *p; }
inline void reg_store(double* p, Register a) { *p = a; }
inline Register reg_add(Register a, Register b) { return a + b; }
inline Register reg_sub(Register a, Register b) { return a - b; }
inline Register reg_mul(Register a, Register b) { return a * b; }
inline Register reg_div(Register a, Register b) { return a / b; }
inline Register reg_fma(Register a, Register b, Register c) { return std::fma(a, b, c); }
inline Register reg_fnma(Register a, Register b, Register c) { return std::fma(-a, b, c); }
inline Register reg_sqrt(Register a) { return std::sqrt(a); }
inline Register reg_min(Register a, Register b) { return a < b ? a : b; }
inline Register reg_max(Register a, Register b) { return a > b ? a : b; }
inline Register reg_neg(Register a) { return -a; }
inline Register reg_abs(Register a) { return std::fabs(a); }
inline RegisterMask reg_lt(Register a, Register b) { return a < b; }
inline RegisterMask reg_le(Register a, Register b) { return a <= b; }
inline RegisterMask reg_eq(Register a, Register b) { return a == b; }
inline RegisterMask reg_and(RegisterMask a, RegisterMask b) { return a && b; }
inline RegisterMask reg_or(RegisterMask a, RegisterMask b) { return a || b; }
inline RegisterMask reg_not(RegisterMask a) { return !a; }
inline Register reg_select(RegisterMask m, Register a, Register b) { return m ? a : b; }
inline unsigned reg_bits(RegisterMask m) { return m ? 1u : 0u; }
inline RegisterMask reg_mask(unsigned bits) { return (bits & 1u) != 0; }

#endif

// --- Packs ----------------------------------------------------------------------------------------------------------

/// One truth value per lane.
template <int W>
struct PackMask {
  static constexpr int kRegisters = W / kRegisterLanes;
  RegisterMask r[kRegisters];

  friend PackMask operator&(const PackMask& a, const PackMask& b) {
    PackMask out;
    for (int i = 0; i < kRegisters; ++i) out.r[i] = reg_and(a.r[i], b.r[i]);
    return out;
  }
  friend PackMask operator|(const PackMask& a, const PackMask& b) {
    PackMask out;
    for (int i = 0; i < kRegisters; ++i) out.r[i] = reg_or(a.r[i], b.r[i]);
    return out;
  }
  friend PackMask operator!(const PackMask& a) {
    PackMask out;
    for (int i = 0; i < kRegisters; ++i) out.r[i] = reg_not(a.r[i]);
    return out;
  }
  friend PackMask operator~(const PackMask& a) { return !a; }
};

/// W doubles.
template <int W>
struct Pack {
  static_assert(W % kRegisterLanes == 0);
  static constexpr int kRegisters = W / kRegisterLanes;
  using Mask = PackMask<W>;
  Register r[kRegisters];

  Pack() = default;
  Pack(double a) {  // NOLINT: numbers mix with packs in formulas
    for (int i = 0; i < kRegisters; ++i) r[i] = reg_set(a);
  }

#define GRAZE_PACK_BINARY(op, function)                                       \
  friend Pack operator op(const Pack& a, const Pack& b) {                     \
    Pack out;                                                                 \
    for (int i = 0; i < kRegisters; ++i) out.r[i] = function(a.r[i], b.r[i]); \
    return out;                                                               \
  }
  GRAZE_PACK_BINARY(+, reg_add)
  GRAZE_PACK_BINARY(-, reg_sub)
  GRAZE_PACK_BINARY(*, reg_mul)
  GRAZE_PACK_BINARY(/, reg_div)
#undef GRAZE_PACK_BINARY

#define GRAZE_PACK_COMPARE(op, function, first, second)                                \
  friend Mask operator op(const Pack& a, const Pack& b) {                              \
    Mask out;                                                                          \
    for (int i = 0; i < kRegisters; ++i) out.r[i] = function(first.r[i], second.r[i]); \
    return out;                                                                        \
  }
  GRAZE_PACK_COMPARE(<, reg_lt, a, b)
  GRAZE_PACK_COMPARE(<=, reg_le, a, b)
  GRAZE_PACK_COMPARE(>, reg_lt, b, a)
  GRAZE_PACK_COMPARE(>=, reg_le, b, a)
  GRAZE_PACK_COMPARE(==, reg_eq, a, b)
#undef GRAZE_PACK_COMPARE

  friend Pack operator-(const Pack& a) {
    Pack out;
    for (int i = 0; i < kRegisters; ++i) out.r[i] = reg_neg(a.r[i]);
    return out;
  }
  Pack& operator+=(const Pack& b) { return *this = *this + b; }
  Pack& operator-=(const Pack& b) { return *this = *this - b; }
  Pack& operator*=(const Pack& b) { return *this = *this * b; }
};

#define GRAZE_PACK_UNARY(name, function)                                       \
  template <int W>                                                             \
  inline Pack<W> name(const Pack<W>& a) {                                      \
    Pack<W> out;                                                               \
    for (int i = 0; i < Pack<W>::kRegisters; ++i) out.r[i] = function(a.r[i]); \
    return out;                                                                \
  }
GRAZE_PACK_UNARY(abs, reg_abs)
GRAZE_PACK_UNARY(sqrt, reg_sqrt)
#undef GRAZE_PACK_UNARY

template <int W>
inline Pack<W> min(const Pack<W>& a, const Pack<W>& b) {
  Pack<W> out;
  for (int i = 0; i < Pack<W>::kRegisters; ++i) out.r[i] = reg_min(a.r[i], b.r[i]);
  return out;
}
template <int W>
inline Pack<W> max(const Pack<W>& a, const Pack<W>& b) {
  Pack<W> out;
  for (int i = 0; i < Pack<W>::kRegisters; ++i) out.r[i] = reg_max(a.r[i], b.r[i]);
  return out;
}
template <int W>
inline Pack<W> min(const Pack<W>& a, double b) {
  return min(a, Pack<W>(b));
}
template <int W>
inline Pack<W> min(double a, const Pack<W>& b) {
  return min(Pack<W>(a), b);
}
template <int W>
inline Pack<W> max(const Pack<W>& a, double b) {
  return max(a, Pack<W>(b));
}
template <int W>
inline Pack<W> max(double a, const Pack<W>& b) {
  return max(Pack<W>(a), b);
}

/// a b + c, rounded once.
template <int W>
inline Pack<W> fma(const Pack<W>& a, const Pack<W>& b, const Pack<W>& c) {
  Pack<W> out;
  for (int i = 0; i < Pack<W>::kRegisters; ++i) out.r[i] = reg_fma(a.r[i], b.r[i], c.r[i]);
  return out;
}
template <int W>
inline Pack<W> fma(const Pack<W>& a, double b, const Pack<W>& c) {
  return fma(a, Pack<W>(b), c);
}
template <int W>
inline Pack<W> fma(const Pack<W>& a, const Pack<W>& b, double c) {
  return fma(a, b, Pack<W>(c));
}
template <int W>
inline Pack<W> fma(const Pack<W>& a, double b, double c) {
  return fma(a, Pack<W>(b), Pack<W>(c));
}

/// c - a b, rounded once.
template <int W>
inline Pack<W> fnma(const Pack<W>& a, const Pack<W>& b, const Pack<W>& c) {
  Pack<W> out;
  for (int i = 0; i < Pack<W>::kRegisters; ++i) out.r[i] = reg_fnma(a.r[i], b.r[i], c.r[i]);
  return out;
}

template <int W>
inline Pack<W> recip(const Pack<W>& a) {
  return Pack<W>(1.0) / a;
}

/// Per lane: mask ? a : b.
template <int W>
inline Pack<W> select(const PackMask<W>& mask, const Pack<W>& a, const Pack<W>& b) {
  Pack<W> out;
  for (int i = 0; i < Pack<W>::kRegisters; ++i) out.r[i] = reg_select(mask.r[i], a.r[i], b.r[i]);
  return out;
}
template <int W>
inline Pack<W> select(const PackMask<W>& mask, const Pack<W>& a, double b) {
  return select(mask, a, Pack<W>(b));
}
template <int W>
inline Pack<W> select(const PackMask<W>& mask, double a, const Pack<W>& b) {
  return select(mask, Pack<W>(a), b);
}

/// Bit l is lane l.
template <int W>
inline unsigned bits(const PackMask<W>& mask) {
  unsigned out = 0;
  for (int i = 0; i < PackMask<W>::kRegisters; ++i) out |= reg_bits(mask.r[i]) << (i * kRegisterLanes);
  return out;
}
template <int W>
inline bool any(const PackMask<W>& mask) {
  return bits(mask) != 0;
}
template <int W>
inline bool all(const PackMask<W>& mask) {
  return bits(mask) == (1u << W) - 1u;
}

template <int W>
inline void store(double* p, const Pack<W>& a) {
  for (int i = 0; i < Pack<W>::kRegisters; ++i) reg_store(p + i * kRegisterLanes, a.r[i]);
}

// --- The same for one lane -------------------------------------------------------------------------------------------

inline double abs(double a) { return std::fabs(a); }
inline double sqrt(double a) { return std::sqrt(a); }
inline double min(double a, double b) { return a < b ? a : b; }
inline double max(double a, double b) { return a > b ? a : b; }
inline double fma(double a, double b, double c) { return std::fma(a, b, c); }
inline double fnma(double a, double b, double c) { return std::fma(-a, b, c); }
inline double recip(double a) { return 1.0 / a; }
inline double select(bool mask, double a, double b) { return mask ? a : b; }
inline unsigned bits(bool mask) { return mask ? 1u : 0u; }
inline bool any(bool mask) { return mask; }
inline bool all(bool mask) { return mask; }
inline void store(double* p, double a) { *p = a; }

// --- What templates on T ask for -------------------------------------------------------------------------------------

template <class T>
struct LaneTraits;
template <>
struct LaneTraits<double> {
  static constexpr int kWidth = 1;
  using Mask = bool;
  static double load(const double* p) { return *p; }
  static bool mask(unsigned bits) { return (bits & 1u) != 0; }
};
template <int W>
struct LaneTraits<Pack<W>> {
  static constexpr int kWidth = W;
  using Mask = PackMask<W>;
  static Pack<W> load(const double* p) {
    Pack<W> out;
    for (int i = 0; i < Pack<W>::kRegisters; ++i) out.r[i] = reg_load(p + i * kRegisterLanes);
    return out;
  }
  static Mask mask(unsigned bits) {
    Mask out;
    for (int i = 0; i < Mask::kRegisters; ++i) out.r[i] = reg_mask(bits >> (i * kRegisterLanes));
    return out;
  }
};

template <class T>
inline constexpr int kWidth = LaneTraits<T>::kWidth;
template <class T>
using mask_of = typename LaneTraits<T>::Mask;

/// kWidth<T> doubles from p.
template <class T>
inline T load(const double* p) {
  return LaneTraits<T>::load(p);
}
/// Bit l for lane l.
template <class T>
inline mask_of<T> mask_from_bits(unsigned b) {
  return LaneTraits<T>::mask(b);
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
