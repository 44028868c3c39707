#pragma once
// What a network computes on lanes: a list of steps, each of which writes rows [lane] of one memory.

namespace graze {

enum class UnaryOp : int {
  copy,
  negative,
  magnitude,
  root,
  inverse,
  relu,
  leaky_relu,  // alpha x where x < 0
  elu,         // alpha (e^x - 1) where x < 0
  selu,        // beta times that
  hyperbolic_tangent,
  sigmoid,
  hard_sigmoid,  // alpha x + beta within 0 and 1
  softplus,
  softsign,
  clip,  // within alpha and beta
  exponential,
  sine,
  cosine
};

enum class BinaryOp : int { add, subtract, multiply, divide, least, greatest, prelu /* b a where a < 0 */ };

enum class ReduceOp : int { sum, mean, greatest };

enum class StepKind : int { unary, binary, reduce, dense };

/// One step. Rows are counted from the memory's beginning; the arrays belong to the network.
struct NetworkStep {
  StepKind kind = StepKind::unary;
  int op = 0;
  bool single = false;     // results are rounded to floats
  int out = 0, count = 0;  // rows written
  const int* a = nullptr;  // rows read: count; reduce: count times `width`; dense: width
  const int* b = nullptr;  // binary: rows of the second operand
  int width = 0;           // of a group that is reduced, or inputs of a dense layer
  double alpha = 0, beta = 0;
  // Dense: out_j = bias_j + sum over k of weight_jk a_k, in the order of k, by fma. [ceil(count / kTile)][width][kTile]
  // and [ceil(count / kTile)][kTile], zeros behind the last.
  const double* weight = nullptr;
  const double* bias = nullptr;
};

/// Outputs of a dense layer that are summed side by side, in registers.
inline constexpr int kTile = 8;

/// Turns what is sensed in world axes into the base's. Rows of lanes; null: not wanted.
struct BaseAxesCall {
  const double* rpy = nullptr;                                             // 3
  const double *rate = nullptr, *velocity = nullptr;                       // 3 each
  double *down = nullptr, *base_rate = nullptr, *base_velocity = nullptr;  // 3 each; down: of length 1
};

struct NetworkKernel {
  void (*run)(const NetworkStep* steps, int count, double* memory);
  void (*base_axes)(const BaseAxesCall& call);
};

const NetworkKernel& find_network_kernel_portable();
#if defined(GRAZE_X86_KERNELS)
const NetworkKernel& find_network_kernel_avx2();
const NetworkKernel& find_network_kernel_avx512();
#endif

}  // namespace graze
