#include "analysis/freedoms.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/model/rotation.h"

namespace graze {

Freedoms::Freedoms(const std::vector<std::string>& q_names) {
  const auto named = [&](std::size_t column, const std::string& name) {
    return column < q_names.size() && q_names[column] == name;
  };
  for (std::size_t i = 0; i < q_names.size(); ++i) {
    const std::string& name = q_names[i];
    const std::string body = name.substr(0, name.rfind('.'));
    if (name == body + ".qw" && named(i + 1, body + ".qx") && named(i + 2, body + ".qy") &&
        named(i + 3, body + ".qz")) {
      parts_.push_back({i, true});
      for (const char* angle : {".roll", ".pitch", ".yaw"}) {
        names_.push_back(body + angle);
        units_.emplace_back("rad");
      }
      i += 3;
    } else {
      parts_.push_back({i, false});
      names_.push_back(name);
      const bool floats = std::find(q_names.begin(), q_names.end(), body + ".qw") != q_names.end();
      const bool place = floats && (name == body + ".x" || name == body + ".y" || name == body + ".z");
      units_.emplace_back(place ? "m" : "");
    }
  }
}

void Freedoms::read(std::span<const double> q, std::span<double> out) const {
  std::size_t k = 0;
  for (const Part& part : parts_) {
    const double* at = &q[part.column];
    if (part.is_attitude) {
      const Vec3 angles = rpy_from_rotation(Eigen::Quaterniond(at[0], at[1], at[2], at[3]).toRotationMatrix());
      for (int axis = 0; axis < 3; ++axis) out[k++] = angles[axis];
    } else {
      out[k++] = *at;
    }
  }
}

void Freedoms::unwrap(std::vector<std::vector<double>>& columns) const {
  for (std::size_t k = 0; k < size(); ++k) {
    if (units_[k] != "rad") continue;
    double sine = 0, cosine = 0;
    for (const double angle : columns[k]) {
      sine += std::sin(angle);
      cosine += std::cos(angle);
    }
    const double mean = std::atan2(sine, cosine);
    for (double& angle : columns[k]) angle = mean + std::remainder(angle - mean, 2 * std::numbers::pi);
  }
}

}  // namespace graze
