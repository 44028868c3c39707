#include "scenarios/impulse_part.h"

#include <fmt/format.h>

#include "engine/model/direction.h"

namespace graze {

ImpulsePart::ImpulsePart(const Described& own) {
  const auto written = own.find("direction");
  if (!written) return;
  const std::vector<double> u = written->numbers(3);
  const Vec3 along = direction({u[0], u[1], u[2]});
  if (along.isZero()) {
    written->fail(fmt::format("[{:g}, {:g}, {:g}]: has no direction; along y: [0, 1, 0]", u[0], u[1], u[2]));
  }
  along_ = along;
  text_ = fmt::format(" along ({:g}, {:g}, {:g})", u[0], u[1], u[2]);
}

Key ImpulsePart::key() {
  return {"direction",
          {Form::numbers(3)},
          Default::words("the normal"),
          "`[x, y, z]` in the world, of any length: the component along it, on the first-named part, signed"};
}

}  // namespace graze
