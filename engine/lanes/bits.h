#pragma once
// Integers on lanes: W words of 64 bits, one per lane, for random numbers and for taking doubles apart. Kernels are
// templates on T as in pack.h; bits_of<T> is the type of T's words.

#include <cstdint>

#include "engine/lanes/pack.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

// --- One hardware register ------------------------------------------------------------------------------------------
// word_multiply multiplies the low halves of its words to all 64 bits. word_number converts words below 2^53, exactly.

#if defined(GRAZE_ISA_AVX512)

using WordRegister = __m512i;

inline WordRegister word_set(std::uint64_t a) { return _mm512_set1_epi64(static_cast<long long>(a)); }
inline WordRegister word_load(const std::uint64_t* p) { return _mm512_loadu_si512(p); }
inline WordRegister word_xor(WordRegister a, WordRegister b) { return _mm512_xor_si512(a, b); }
inline WordRegister word_xor3(WordRegister a, WordRegister b, WordRegister c) {
  return _mm512_ternarylogic_epi64(a, b, c, 0x96);
}
inline WordRegister word_and(WordRegister a, WordRegister b) { return _mm512_and_si512(a, b); }
inline WordRegister word_or(WordRegister a, WordRegister b) { return _mm512_or_si512(a, b); }
template <int N>
inline WordRegister word_right(WordRegister a) {
  return _mm512_maskz_srli_epi64(0xff, a, N);
}
template <int N>
inline WordRegister word_left(WordRegister a) {
  return _mm512_maskz_slli_epi64(0xff, a, N);
}
inline WordRegister word_multiply(WordRegister a, WordRegister b) { return _mm512_maskz_mul_epu32(0xff, a, b); }
inline Register word_number(WordRegister a) { return _mm512_maskz_cvtepu64_pd(0xff, a); }
inline Register word_as_double(WordRegister a) { return _mm512_castsi512_pd(a); }
inline WordRegister word_of_double(Register a) { return _mm512_castpd_si512(a); }

#elif defined(GRAZE_ISA_AVX2)

using WordRegister = __m256i;

inline WordRegister word_set(std::uint64_t a) { return _mm256_set1_epi64x(static_cast<long long>(a)); }
inline WordRegister word_load(const std::uint64_t* p) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
}
inline WordRegister word_xor(WordRegister a, WordRegister b) { return _mm256_xor_si256(a, b); }
inline WordRegister word_xor3(WordRegister a, WordRegister b, WordRegister c) { return word_xor(word_xor(a, b), c); }
inline WordRegister word_and(WordRegister a, WordRegister b) { return _mm256_and_si256(a, b); }
inline WordRegister word_or(WordRegister a, WordRegister b) { return _mm256_or_si256(a, b); }
template <int N>
inline WordRegister word_right(WordRegister a) {
  return _mm256_srli_epi64(a, N);
}
template <int N>
inline WordRegister word_left(WordRegister a) {
  return _mm256_slli_epi64(a, N);
}
inline WordRegister word_multiply(WordRegister a, WordRegister b) { return _mm256_mul_epu32(a, b); }
/// Without an instruction for it: the halves become the last bits of numbers near 2^84 and 2^52, whose difference from
/// there is exact.
inline Register word_number(WordRegister a) {
  const WordRegister high = word_or(word_right<32>(a), word_set(0x4530000000000000u));  // 2^84 + high 2^32
  const WordRegister low = _mm256_blend_epi32(a, word_set(0x4330000000000000u), 0xaa);  // 2^52 + low
  const Register shifted = _mm256_sub_pd(_mm256_castsi256_pd(high), _mm256_set1_pd(0x1.00000001p84));
  return _mm256_add_pd(shifted, _mm256_castsi256_pd(low));
}
inline Register word_as_double(WordRegister a) { return _mm256_castsi256_pd(a); }
inline WordRegister word_of_double(Register a) { return _mm256_castpd_si256(a); }

#else

using WordRegister = std::uint64_t;

inline WordRegister word_set(std::uint64_t a) { return a; }
inline WordRegister word_load(const std::uint64_t* p) { return *p; }
inline WordRegister word_xor(WordRegister a, WordRegister b) { return a ^ b; }
inline WordRegister word_xor3(WordRegister a, WordRegister b, WordRegister c) { return word_xor(word_xor(a, b), c); }
inline WordRegister word_and(WordRegister a, WordRegister b) { return a & b; }
inline WordRegister word_or(WordRegister a, WordRegister b) { return a | b; }
template <int N>
inline WordRegister word_right(WordRegister a) {
  return a >> N;
}
template <int N>
inline WordRegister word_left(WordRegister a) {
  return a << N;
}
inline WordRegister word_multiply(WordRegister a, WordRegister b) { return (a & 0xffffffffu) * (b & 0xffffffffu); }
inline Register word_number(WordRegister a) { return static_cast<double>(a); }
inline Register word_as_double(WordRegister a) { return __builtin_bit_cast(double, a); }
inline WordRegister word_of_double(Register a) { return __builtin_bit_cast(std::uint64_t, a); }

#endif

// --- Packs ----------------------------------------------------------------------------------------------------------

/// W words.
template <int W>
struct Bits {
  static constexpr int kRegisters = W / kRegisterLanes;
  WordRegister r[kRegisters];

  Bits() = default;
  Bits(std::uint64_t a) {  // NOLINT: constants mix with packs in formulas
    for (int i = 0; i < kRegisters; ++i) r[i] = word_set(a);
  }

#define GRAZE_BITS_BINARY(op, function)                                       \
  friend Bits operator op(const Bits& a, const Bits& b) {                     \
    Bits out;                                                                 \
    for (int i = 0; i < kRegisters; ++i) out.r[i] = function(a.r[i], b.r[i]); \
    return out;                                                               \
  }
  GRAZE_BITS_BINARY(^, word_xor)
  GRAZE_BITS_BINARY(&, word_and)
  GRAZE_BITS_BINARY(|, word_or)
#undef GRAZE_BITS_BINARY
};

/// a ^ b ^ c.
template <int W>
inline Bits<W> exclusive_or(const Bits<W>& a, const Bits<W>& b, const Bits<W>& c) {
  Bits<W> out;
  for (int i = 0; i < Bits<W>::kRegisters; ++i) out.r[i] = word_xor3(a.r[i], b.r[i], c.r[i]);
  return out;
}
/// Product of the low 32 bits of each, 64 bits.
template <int W>
inline Bits<W> multiply_low(const Bits<W>& a, const Bits<W>& b) {
  Bits<W> out;
  for (int i = 0; i < Bits<W>::kRegisters; ++i) out.r[i] = word_multiply(a.r[i], b.r[i]);
  return out;
}
template <int N, int W>
inline Bits<W> shift_right(const Bits<W>& a) {
  Bits<W> out;
  for (int i = 0; i < Bits<W>::kRegisters; ++i) out.r[i] = word_right<N>(a.r[i]);
  return out;
}
template <int N, int W>
inline Bits<W> shift_left(const Bits<W>& a) {
  Bits<W> out;
  for (int i = 0; i < Bits<W>::kRegisters; ++i) out.r[i] = word_left<N>(a.r[i]);
  return out;
}
/// The word as a number, exactly; for words below 2^53.
template <int W>
inline Pack<W> number(const Bits<W>& a) {
  Pack<W> out;
  for (int i = 0; i < Bits<W>::kRegisters; ++i) out.r[i] = word_number(a.r[i]);
  return out;
}
/// The double that these bits are.
template <int W>
inline Pack<W> as_double(const Bits<W>& a) {
  Pack<W> out;
  for (int i = 0; i < Bits<W>::kRegisters; ++i) out.r[i] = word_as_double(a.r[i]);
  return out;
}
template <int W>
inline Bits<W> as_bits(const Pack<W>& a) {
  Bits<W> out;
  for (int i = 0; i < Bits<W>::kRegisters; ++i) out.r[i] = word_of_double(a.r[i]);
  return out;
}

// --- The same for one lane -------------------------------------------------------------------------------------------

inline std::uint64_t exclusive_or(std::uint64_t a, std::uint64_t b, std::uint64_t c) { return a ^ b ^ c; }
inline std::uint64_t multiply_low(std::uint64_t a, std::uint64_t b) { return (a & 0xffffffffu) * (b & 0xffffffffu); }
template <int N>
inline std::uint64_t shift_right(std::uint64_t a) {
  return a >> N;
}
template <int N>
inline std::uint64_t shift_left(std::uint64_t a) {
  return a << N;
}
inline double number(std::uint64_t a) { return static_cast<double>(a); }
inline double as_double(std::uint64_t a) { return __builtin_bit_cast(double, a); }
inline std::uint64_t as_bits(double a) { return __builtin_bit_cast(std::uint64_t, a); }

// --- What templates on T ask for -------------------------------------------------------------------------------------

template <class T>
struct BitsTraits;
template <>
struct BitsTraits<double> {
  using Type = std::uint64_t;
  static Type load(const std::uint64_t* p) { return *p; }
};
template <int W>
struct BitsTraits<Pack<W>> {
  using Type = Bits<W>;
  static Type load(const std::uint64_t* p) {
    Type out;
    for (int i = 0; i < Type::kRegisters; ++i) out.r[i] = word_load(p + i * kRegisterLanes);
    return out;
  }
};

/// Words as wide as T.
template <class T>
using bits_of = typename BitsTraits<T>::Type;

/// kWidth<T> words from p.
template <class T>
inline bits_of<T> load_bits(const std::uint64_t* p) {
  return BitsTraits<T>::load(p);
}

/// Writes those of the kWidth<T> numbers that the mask has to `out`, one after the other; how many. What follows them
/// in out[0 … kWidth<T>) is overwritten, too.
template <class T>
inline int compress(const mask_of<T>& mask, const T& x, double* out) {
  const unsigned chosen = bits(mask);
#if defined(GRAZE_ISA_AVX512)
  if constexpr (kWidth<T> == 8) {
    _mm512_storeu_pd(out, _mm512_maskz_compress_pd(static_cast<__mmask8>(chosen), x.r[0]));
    return __builtin_popcount(chosen);
  }
#endif
  double all[kWidth<T>];
  store(all, x);
  int n = 0;
  for (int lane = 0; lane < kWidth<T>; ++lane) {
    out[n] = all[lane];
    n += static_cast<int>(chosen >> lane & 1u);
  }
  return n;
}

/// first + lane of the lanes that the mask has, in the same places.
template <class T>
inline void compress_indices(const mask_of<T>& mask, int first, int* out) {
  const unsigned chosen = bits(mask);
#if defined(GRAZE_ISA_AVX512)
  if constexpr (kWidth<T> == 8) {
    const __m256i all = _mm256_add_epi32(_mm256_set1_epi32(first), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out),
                        _mm256_maskz_compress_epi32(static_cast<__mmask8>(chosen), all));
    return;
  }
#endif
  for (int lane = 0, n = 0; lane < kWidth<T>; ++lane) {
    out[n] = first + lane;
    n += static_cast<int>(chosen >> lane & 1u);
  }
}

inline constexpr std::uint64_t kSignBit = 0x8000000000000000u;

/// |magnitude| with the sign of `sign`, also of zeros.
template <class T>
inline T copy_sign(const T& magnitude, const T& sign) {
  using B = bits_of<T>;
  return as_double((as_bits(magnitude) & B(~kSignBit)) | (as_bits(sign) & B(kSignBit)));
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
