// The kernels of one instruction set; compiled once for each (see CMakeLists.txt).

#include "engine/sensing/kernel.h"

#include "engine/sensing/draw.h"
#include "engine/sensing/reading.h"

namespace graze {

const SensingKernel* GRAZE_OF_ISA(find_sensing_kernel)() {
  static constexpr SensingKernel kernel = {&draw_noise<Pack<8>>, &read_sensors<Pack<8>>};
  return &kernel;
}

}  // namespace graze
