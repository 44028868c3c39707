// Complementarity problems of inverse dynamics against their defining conditions and enumeration.

#include "engine/control/contact_pivoting.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>

#include "tests/sanitized.h"

namespace graze {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

/// Contacts at random places of a random base; some stand twice. Told, not contradictory: the wish lets the base rise.
BaseContacts random_contacts(std::mt19937& generator, int count) {
  const auto u = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator); };
  BaseContacts out;
  MatrixXd root(6, 6);
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = u(-1, 1);
  out.A = root * root.transpose() + 0.3 * MatrixXd::Identity(6, 6);
  out.J = MatrixXd::Zero(3 * count, 6);
  out.u = VectorXd(3 * count);
  out.friction = VectorXd(count);
  for (int i = 0; i < count; ++i) {
    if (i > 0 && u(0, 1) < 0.3) {
      out.J.middleRows(3 * i, 3) = out.J.middleRows(3 * i - 3, 3);
      out.u.segment(3 * i, 3) = out.u.segment(3 * i - 3, 3);
      out.friction[i] = out.friction[i - 1];
      continue;
    }
    const Eigen::Vector3d p(u(-1, 1), u(-1, 1), u(-0.3, 0));
    const int axis[3] = {2, 0, 1};  // normal z, tangents x and y
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = Eigen::Vector3d::Unit(axis[k]);
      out.J.row(3 * i + k).head(3) = p.cross(d).transpose();
      out.J.row(3 * i + k).tail(3) = d.transpose();
      out.u[3 * i + k] = u(-1, 0.5);
    }
    out.friction[i] = u(0, 1.5);
  }
  return out;
}

/// Velocities after the impulses.
VectorXd after(const BaseContacts& contacts, const VectorXd& impulse) {
  return contacts.u + contacts.delassus() * impulse;
}

// 10,000 problems with up to six contacts, one in twenty with up to forty, some doubled: all conditions of Eqs. 86 to
// 101 hold, and Lemke never ends on a ray: contacts that the base can leave upward always have a solution.
TEST(ContactPivoting, CoulombMeetsItsConditions) {
  std::mt19937 generator(11);
  for (int n = 0; n < test::trials(10000); ++n) {
    const BaseContacts contacts = random_contacts(generator, n % 20 == 19 ? 7 + n / 20 % 34 : 1 + n % 6);
    const VectorXd impulse = pivot_coulomb(contacts);
    ASSERT_EQ(impulse.size(), contacts.u.size()) << n;
    const VectorXd v = after(contacts, impulse);
    const double scale = 1e-6 * (1 + impulse.cwiseAbs().maxCoeff());
    for (int i = 0; i < contacts.friction.size(); ++i) {
      const double normal = impulse[3 * i], along = std::abs(impulse[3 * i + 1]) + std::abs(impulse[3 * i + 2]);
      const double bound = contacts.friction[i] * normal;
      EXPECT_GE(normal, -scale) << n;
      EXPECT_GE(v[3 * i], -scale) << n;
      EXPECT_NEAR(normal * v[3 * i], 0, scale) << n;
      EXPECT_LE(along, bound + scale) << n;
      // Friction takes as much power as the pyramid has: the fastest of its edges, times the bound.
      const double fastest = std::max(std::abs(v[3 * i + 1]), std::abs(v[3 * i + 2]));
      const double power = impulse[3 * i + 1] * v[3 * i + 1] + impulse[3 * i + 2] * v[3 * i + 2];
      EXPECT_NEAR(power, -bound * fastest, 10 * scale) << n;
    }
  }
}

// Of all solutions the closest: the conditions hold as above, no other is nearer to what was before, and what is a
// solution itself is kept. With more contacts than can be enumerated it is Lemke's.
TEST(ContactPivoting, ClosestKeepsWhatWasBefore) {
  std::mt19937 generator(12);
  std::normal_distribution<double> normal;
  int kept = 0;
  for (int n = 0; n < test::trials(60); ++n) {
    const BaseContacts contacts = random_contacts(generator, 1 + n % 2);
    VectorXd before = VectorXd::NullaryExpr(contacts.u.size(), [&] { return normal(generator); });
    const VectorXd lemke = pivot_coulomb(contacts), closest = pivot_coulomb(contacts, &before);
    ASSERT_EQ(closest.size(), lemke.size()) << n;
    EXPECT_LE((closest - before).norm(), (lemke - before).norm() + 1e-9) << n;
    // The motion of the base is that of rigid contact, whichever of the solutions is taken.
    EXPECT_LT((after(contacts, closest) - after(contacts, lemke)).cwiseAbs().maxCoeff(), 1e-6) << n;
    EXPECT_LT((pivot_coulomb(contacts, &closest) - closest).norm(), 1e-9 * (1 + closest.norm())) << n;
    kept += (closest - lemke).norm() > 1e-6 * (1 + lemke.norm());
  }
  EXPECT_TRUE(kept > 0 || GRAZE_SANITIZED) << "of the few trials under sanitizers all may have one solution";
  const BaseContacts many = random_contacts(generator, 3);
  const VectorXd before = VectorXd::Zero(9);
  EXPECT_EQ(pivot_coulomb(many, &before), pivot_coulomb(many));
}

/// Wrench on the base of contacts without slip by trying every set of pressing contacts, or none.
std::optional<VectorXd> enumerate_no_slip(const BaseContacts& contacts) {
  const int count = static_cast<int>(contacts.friction.size());
  const MatrixXd W = contacts.delassus();
  for (unsigned set = 0; set < 1u << count; ++set) {
    std::vector<int> rows;  // whose velocities vanish
    for (int i = 0; i < 3 * count; ++i) {
      if (i % 3 != 0 || (set >> (i / 3) & 1u)) rows.push_back(i);
    }
    const VectorXd z = MatrixXd(W(rows, rows)).completeOrthogonalDecomposition().solve(-VectorXd(contacts.u(rows)));
    VectorXd impulse = VectorXd::Zero(3 * count);
    for (std::size_t k = 0; k < rows.size(); ++k) impulse[rows[k]] = z[k];
    const VectorXd v = after(contacts, impulse);
    bool good = true;
    for (const int i : rows) good = good && std::abs(v[i]) < 1e-7;
    for (int i = 0; i < count; ++i) good = good && impulse[3 * i] > -1e-8 && v[3 * i] > -1e-8;
    if (good) return VectorXd(contacts.J.transpose() * impulse);
  }
  return std::nullopt;
}

// 3000 problems with up to seven contacts: the wrench is that of enumeration wherever there is a solution, from a cold
// start and from the last solution's contacts.
TEST(ContactPivoting, NoSlipAgreesWithEnumeration) {
  constexpr double kExact = 1e-9;  // only what rounding makes of dependent tangents
  std::mt19937 generator(12);
  int solved = 0;
  for (int n = 0; n < 3000; ++n) {
    const BaseContacts contacts = random_contacts(generator, n % 50 == 49 ? 5 + n / 50 % 3 : 1 + n % 3);
    const std::optional<VectorXd> want = enumerate_no_slip(contacts);
    std::vector<int> active;
    const VectorXd cold = pivot_no_slip(contacts, active, kExact);
    if (!want) continue;
    ASSERT_EQ(cold.size(), contacts.u.size()) << n;
    EXPECT_LT((contacts.J.transpose() * cold - *want).norm(), 1e-5 * (1 + want->norm())) << n;
    const VectorXd warm = pivot_no_slip(contacts, active, kExact);
    EXPECT_LT((contacts.J.transpose() * warm - *want).norm(), 1e-5 * (1 + want->norm())) << n;
    ++solved;
  }
  EXPECT_GT(solved, 1500);
}

// Two feet on the ground 40 cm apart that shall come nearer to each other at 1 cm/s, which the base cannot let them: at
// heights that differ by 0.1 mm no force along the line between them is asked for that could turn the base, at 5 cm
// one.
TEST(ContactPivoting, FeetAtOneHeightDoNotPressAgainstEachOther) {
  const auto largest = [](double higher) {
    BaseContacts contacts;
    contacts.A = MatrixXd::Identity(6, 6);
    contacts.A.topLeftCorner(3, 3) *= 0.01;  // 1 kg, 0.01 kg m^2
    contacts.J = MatrixXd::Zero(6, 6);
    contacts.u = VectorXd::Zero(6);
    contacts.friction = VectorXd::Ones(2);
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector3d p(i == 0 ? 0.2 : -0.2, 0, -0.2 + i * higher);
      const int axis[3] = {2, 0, 1};
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d d = Eigen::Vector3d::Unit(axis[k]);
        contacts.J.row(3 * i + k) << p.cross(d).transpose(), d.transpose();
      }
      contacts.u[3 * i] = -0.01;  // the ground holds the base up
      contacts.u[3 * i + 1] = i == 0 ? -0.005 : 0.005;
    }
    std::vector<int> active;
    return pivot_no_slip(contacts, active).cwiseAbs().maxCoeff();
  };
  EXPECT_LT(largest(1e-4), 0.02);  // N s: half of what holds 1 kg up, and what stops the foot that counts
  EXPECT_GT(largest(0.05), 0.02);
}

}  // namespace
}  // namespace graze
