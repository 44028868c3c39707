#include "engine/model/inertia_rules.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace graze {

namespace {

/// The point of the cone {B s: s >= 0} that is nearest to I, where B s = (s2 + s3, s1 + s3, s1 + s2) are the principal
/// moments of a body with second moments s. On one of its 8 faces lies the orthogonal projection that belongs to it.
Vec3 nearest_moments(const Vec3& I) {
  const Mat3 B = Mat3::Ones() - Mat3::Identity();
  Vec3 best = Vec3::Zero();
  double least = I.norm();
  for (int face = 1; face < 8; ++face) {
    std::vector<int> free;
    for (int k = 0; k < 3; ++k) {
      if (face & (1 << k)) free.push_back(k);
    }
    Eigen::MatrixXd columns(3, free.size());
    for (std::size_t k = 0; k < free.size(); ++k) columns.col(static_cast<Eigen::Index>(k)) = B.col(free[k]);
    const Eigen::VectorXd s = columns.colPivHouseholderQr().solve(I);
    const Vec3 moments = columns * s;
    if (s.minCoeff() < 0 || (moments - I).norm() >= least) continue;
    least = (moments - I).norm();
    best = moments;
  }
  return best;
}

}  // namespace

std::string mass_problem(double mass) {
  if (mass > 0 && std::isfinite(mass)) return "";
  return fmt::format("mass {:g}: a moving body (with all that is fixed to it) must have a positive mass", mass);
}

// Physical if and only if the second moment about the centre of mass is positive semidefinite, which is the triangle
// inequality of the principal moments. Sums and affine maps of rounded numbers leave a few ulps; 1e-9 of the trace
// is far above those and far below anything that a dynamics algorithm would notice.
std::string inertia_problem(const Mat3& inertia) {
  if (!inertia.allFinite()) return "inertia is not finite";
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia, Eigen::EigenvaluesOnly);
  const Vec3& moments = solver.eigenvalues();  // ascending
  const double tolerance = 1e-9 * moments.sum();
  if (moments[0] <= std::max(0.0, 1e-3 * tolerance)) {
    return fmt::format("principal moments of inertia {:g}, {:g}, {:g} kg m^2: all must be positive", moments[0],
                       moments[1], moments[2]);
  }
  if (moments[0] + moments[1] < moments[2] - tolerance) {
    return fmt::format(
        "principal moments of inertia {0:g}, {1:g}, {2:g} kg m^2 break the triangle inequality: no rigid body has "
        "{0:g} + {1:g} < {2:g}",
        moments[0], moments[1], moments[2]);
  }
  return "";
}

bool is_of_point(const Mat3& inertia, double mass) {
  constexpr double kGyration = 1e-7;  // m
  return inertia.norm() < kGyration * kGyration * std::abs(mass);
}

Mat3 nearest_physical_inertia(const Mat3& inertia) {
  constexpr double kMargin = 1e-6;  // of the largest moment, for each second moment
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia);
  const double largest = solver.eigenvalues()[2];
  if (!(largest > 0) || !std::isfinite(largest)) return Mat3::Zero();
  const Vec3 margin = Vec3::Constant(2 * kMargin);
  const Vec3 moments = largest * (nearest_moments(solver.eigenvalues() / largest - margin) + margin);
  return solver.eigenvectors() * moments.asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace graze
