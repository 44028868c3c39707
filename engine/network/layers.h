#pragma once
// The steps of a network on lanes: T is double or a Pack. Sums run in the order of the file's weights, by fma, so that
// the bits are the same for every instruction set.

#include "engine/lanes/vec.h"
#include "engine/network/exponential.h"
#include "engine/network/kernel.h"

namespace graze {
inline namespace GRAZE_ISA_NAMESPACE {

inline double rounded_register(double a) { return static_cast<double>(static_cast<float>(a)); }
#if defined(GRAZE_ISA_AVX512)
// With a full mask: see pack.h.
inline Register rounded_register(Register a) { return _mm512_maskz_cvtps_pd(0xff, _mm512_maskz_cvtpd_ps(0xff, a)); }
#elif defined(GRAZE_ISA_AVX2)
inline Register rounded_register(Register a) { return _mm256_cvtps_pd(_mm256_cvtpd_ps(a)); }
#endif

/// The nearest float.
inline double to_single(double a) { return rounded_register(a); }
template <int W>
inline Pack<W> to_single(const Pack<W>& a) {
  Pack<W> out;
  for (int i = 0; i < Pack<W>::kRegisters; ++i) out.r[i] = rounded_register(a.r[i]);
  return out;
}

// Comparisons with NaN are false: what is written here hands it on.
template <class T>
inline T within(const T& x, double low, double high) {
  return select(x < T(low), T(low), select(x > T(high), T(high), x));
}

template <class T>
inline T elu(const T& x, double alpha) {
  return select(x < T(0.0), T(alpha) * exponential_less_one(x), x);
}

template <class T>
inline T circular(const T& x, bool sine) {
  T s, c;
  sin_cos(x, s, c);
  return sine ? s : c;
}

template <class T, UnaryOp op>
inline T unary(const T& x, double alpha, double beta) {
  switch (op) {
    case UnaryOp::copy:
      return x;
    case UnaryOp::negative:
      return -x;
    case UnaryOp::magnitude:
      return abs(x);
    case UnaryOp::root:
      return sqrt(x);
    case UnaryOp::inverse:
      return T(1.0) / x;
    case UnaryOp::relu:
      return select(x < T(0.0), T(0.0), x);
    case UnaryOp::leaky_relu:
      return select(x < T(0.0), T(alpha) * x, x);
    case UnaryOp::elu:
      return elu(x, alpha);
    case UnaryOp::selu:
      return T(beta) * elu(x, alpha);
    case UnaryOp::hyperbolic_tangent:
      return hyperbolic_tangent(x);
    case UnaryOp::sigmoid:
      return sigmoid(x);
    case UnaryOp::hard_sigmoid:
      return within(fma(T(alpha), x, T(beta)), 0.0, 1.0);
    case UnaryOp::softplus:
      return softplus(x);
    case UnaryOp::softsign:
      return x / (T(1.0) + abs(x));
    case UnaryOp::clip:
      return within(x, alpha, beta);
    case UnaryOp::exponential:
      return exponential(x);
    case UnaryOp::sine:
      return circular(x, true);
    case UnaryOp::cosine:
      return circular(x, false);
  }
  return x;
}

template <class T, BinaryOp op>
inline T binary(const T& a, const T& b) {
  switch (op) {
    case BinaryOp::add:
      return a + b;
    case BinaryOp::subtract:
      return a - b;
    case BinaryOp::multiply:
      return a * b;
    case BinaryOp::divide:
      return a / b;
    case BinaryOp::least:
      return select((b < a) | !(b == b), b, a);
    case BinaryOp::greatest:
      return select((b > a) | !(b == b), b, a);
    case BinaryOp::prelu:
      return select(a < T(0.0), b * a, a);
  }
  return a;
}

template <class T>
inline void put(const NetworkStep& step, double* memory, int i, const T& value) {
  store(memory + (step.out + i) * kWidth<T>, step.single ? to_single(value) : value);
}

template <class T, UnaryOp op>
void run_unary(const NetworkStep& step, double* memory) {
  for (int i = 0; i < step.count; ++i) {
    put(step, memory, i, unary<T, op>(load<T>(memory + step.a[i] * kWidth<T>), step.alpha, step.beta));
  }
}

template <class T, BinaryOp op>
void run_binary(const NetworkStep& step, double* memory) {
  for (int i = 0; i < step.count; ++i) {
    put(step, memory, i,
        binary<T, op>(load<T>(memory + step.a[i] * kWidth<T>), load<T>(memory + step.b[i] * kWidth<T>)));
  }
}

template <class T>
void run_reduce(const NetworkStep& step, double* memory) {
  for (int i = 0; i < step.count; ++i) {
    const int* const rows = step.a + i * step.width;
    T out = load<T>(memory + rows[0] * kWidth<T>);
    for (int k = 1; k < step.width; ++k) {
      const T x = load<T>(memory + rows[k] * kWidth<T>);
      out = step.op == static_cast<int>(ReduceOp::greatest) ? binary<T, BinaryOp::greatest>(out, x) : out + x;
    }
    if (step.op == static_cast<int>(ReduceOp::mean)) out = out / T(static_cast<double>(step.width));
    put(step, memory, i, out);
  }
}

/// N outputs of a dense layer from tile column `first` on; N sums live in registers.
template <class T, int N>
inline void sum_columns(const NetworkStep& step, const double* weight, const double* bias, int first, double* memory) {
  T sum[N];
  GRAZE_UNROLL
  for (int j = 0; j < N; ++j) sum[j] = T(bias[first % kTile + j]);
  for (int k = 0; k < step.width; ++k) {
    const T x = load<T>(memory + step.a[k] * kWidth<T>);
    const double* const w = weight + k * kTile + first % kTile;
    GRAZE_UNROLL
    for (int j = 0; j < N; ++j) sum[j] = fma(T(w[j]), x, sum[j]);
  }
  for (int j = 0; j < N && first + j < step.count; ++j) put(step, memory, first + j, sum[j]);
}

template <class T>
void run_dense(const NetworkStep& step, double* memory) {
  // As many as there are registers for, with those of the weights and the input.
  constexpr int kSums = kRegisterLanes == 8 ? 8 : kRegisterLanes == 4 ? 4 : 1;
  for (int first = 0; first < step.count; first += kSums) {
    const int tile = first / kTile;
    sum_columns<T, kSums>(step, step.weight + tile * step.width * kTile, step.bias + tile * kTile, first, memory);
  }
}

}  // namespace GRAZE_ISA_NAMESPACE
}  // namespace graze
