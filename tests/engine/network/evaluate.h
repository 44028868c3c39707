#pragma once
// Networks of the tests, run on the kernels of an instruction set.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "engine/lanes/isa.h"
#include "engine/network/network.h"
#include "tests/engine/network/onnx_bytes.h"

namespace graze::testing {

inline const NetworkKernel& network_kernel(Isa isa = chosen_isa()) { return GRAZE_KERNEL(isa, find_network_kernel); }

/// Numbers that differ from lane to lane, within ±2.
inline double spread_number(int i, int lane) { return 2 * std::sin(1.7 * i + 0.9 * lane + 0.3); }

/// What a lane of a network gives: every output behind the other. Inputs are spread_number(i + 100 port, lane).
inline std::vector<double> evaluate(const std::string& bytes, int lane = 0, Isa isa = chosen_isa()) {
  const Network network(bytes, network_kernel(isa));
  BlockArray memory = network.memory();
  for (std::size_t p = 0; p < network.inputs().size(); ++p) {
    const NetworkPort& port = network.inputs()[p];
    for (std::size_t i = 0; i < port.rows.size(); ++i) {
      for (int l = 0; l < kLanes; ++l) {
        const double x = spread_number(static_cast<int>(i + 100 * p), l);
        memory(port.rows[i], l) = port.single ? static_cast<double>(static_cast<float>(x)) : x;
      }
    }
  }
  network.run(memory);
  std::vector<double> out;
  for (const NetworkPort& port : network.outputs()) {
    for (const int row : port.rows) out.push_back(memory(row, lane));
  }
  return out;
}

/// The message of the NetworkError for a file; empty if it is taken.
inline std::string refusal(const std::string& bytes) try {
  const Network network(bytes, network_kernel());
  return "";
} catch (const NetworkError& error) {
  return error.what();
}

inline std::vector<double> spread(int count, int lane, int first = 0) {
  std::vector<double> out;
  for (int i = 0; i < count; ++i) out.push_back(spread_number(first + i, lane));
  return out;
}

inline void expect_near(const std::vector<double>& got, const std::vector<double>& want, double tolerance) {
  ASSERT_EQ(got.size(), want.size());
  for (std::size_t i = 0; i < got.size(); ++i) EXPECT_NEAR(got[i], want[i], tolerance) << i;
}

}  // namespace graze::testing
