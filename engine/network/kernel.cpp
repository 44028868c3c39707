// The kernels of networks for one instruction set; compiled once for each (see CMakeLists.txt).

#include "engine/network/kernel.h"

#include "engine/network/layers.h"

namespace graze {

namespace {

using StepFunction = void (*)(const NetworkStep& step, double* memory);

template <class T>
StepFunction unary_function(UnaryOp op) {
  switch (op) {
#define GRAZE_UNARY(name) \
  case UnaryOp::name:     \
    return &run_unary<T, UnaryOp::name>;
    GRAZE_UNARY(copy)
    GRAZE_UNARY(negative)
    GRAZE_UNARY(magnitude)
    GRAZE_UNARY(root)
    GRAZE_UNARY(inverse)
    GRAZE_UNARY(relu)
    GRAZE_UNARY(leaky_relu)
    GRAZE_UNARY(elu)
    GRAZE_UNARY(selu)
    GRAZE_UNARY(hyperbolic_tangent)
    GRAZE_UNARY(sigmoid)
    GRAZE_UNARY(hard_sigmoid)
    GRAZE_UNARY(softplus)
    GRAZE_UNARY(softsign)
    GRAZE_UNARY(clip)
    GRAZE_UNARY(exponential)
    GRAZE_UNARY(sine)
    GRAZE_UNARY(cosine)
#undef GRAZE_UNARY
  }
  return nullptr;
}

template <class T>
StepFunction binary_function(BinaryOp op) {
  switch (op) {
#define GRAZE_BINARY(name) \
  case BinaryOp::name:     \
    return &run_binary<T, BinaryOp::name>;
    GRAZE_BINARY(add)
    GRAZE_BINARY(subtract)
    GRAZE_BINARY(multiply)
    GRAZE_BINARY(divide)
    GRAZE_BINARY(least)
    GRAZE_BINARY(greatest)
    GRAZE_BINARY(prelu)
#undef GRAZE_BINARY
  }
  return nullptr;
}

template <class T>
void run(const NetworkStep* steps, int count, double* memory) {
  for (int i = 0; i < count; ++i) {
    const NetworkStep& step = steps[i];
    switch (step.kind) {
      case StepKind::unary:
        unary_function<T>(static_cast<UnaryOp>(step.op))(step, memory);
        break;
      case StepKind::binary:
        binary_function<T>(static_cast<BinaryOp>(step.op))(step, memory);
        break;
      case StepKind::reduce:
        run_reduce<T>(step, memory);
        break;
      case StepKind::dense:
        run_dense<T>(step, memory);
        break;
    }
  }
}

/// The world's axes in the base's are the columns of R^T, R = Rz(yaw) Ry(pitch) Rx(roll).
template <class T>
void base_axes(const BaseAxesCall& call) {
  constexpr int W = kWidth<T>;
  T s[3], c[3];
  for (int i = 0; i < 3; ++i) sin_cos(load<T>(call.rpy + i * W), s[i], c[i]);
  const Vec3T<T> up{-s[1], c[1] * s[0], c[1] * c[0]};
  const auto put_vec3 = [](double* out, const Vec3T<T>& a) {
    store(out, a.x);
    store(out + W, a.y);
    store(out + 2 * W, a.z);
  };
  if (call.down != nullptr) put_vec3(call.down, -up);
  const Vec3T<T> x{c[2] * c[1], fma(c[2] * s[1], s[0], -(s[2] * c[0])), fma(c[2] * s[1], c[0], s[2] * s[0])};
  const Vec3T<T> y{s[2] * c[1], fma(s[2] * s[1], s[0], c[2] * c[0]), fma(s[2] * s[1], c[0], -(c[2] * s[0]))};
  const auto turned = [&](const double* from) {
    const Vec3T<T> a = load_vec3<T>(from);
    return axpy(a.x, x, axpy(a.y, y, a.z * up));
  };
  if (call.base_rate != nullptr) put_vec3(call.base_rate, turned(call.rate));
  if (call.base_velocity != nullptr) put_vec3(call.base_velocity, turned(call.velocity));
}

}  // namespace

const NetworkKernel& GRAZE_OF_ISA(find_network_kernel)() {
  static constexpr NetworkKernel kernel{&run<Pack<8>>, &base_axes<Pack<8>>};
  return kernel;
}

}  // namespace graze
