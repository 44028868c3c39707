// Claim: any bytes are a network, which then runs, or are refused with a NetworkError.

#include "engine/network/network.h"

#include <cstdint>
#include <string_view>

#include "engine/lanes/isa.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const graze::NetworkKernel& kernel = GRAZE_KERNEL(graze::chosen_isa(), graze::find_network_kernel);
  try {
    const graze::Network network(std::string_view(reinterpret_cast<const char*>(data), size), kernel);
    graze::BlockArray memory = network.memory();
    network.run(memory);
  } catch (const graze::NetworkError&) {
  }
  return 0;
}
