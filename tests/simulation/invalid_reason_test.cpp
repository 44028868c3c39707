// Claim: the reason of an invalid trace names the step and the pairs that overlap most and press most, worst first.
#include "simulation/invalid_reason.h"

#include <gtest/gtest.h>

#include <limits>

namespace graze {
namespace {

/// Shows contacts that it was given.
class Shown : public BlockPhysics {
 public:
  explicit Shown(const std::vector<Contact>& contacts, int lane) {
    lists_[lane] = contacts;
    points_ = lists_.gather();
  }
  void start(int, const Particle&) override {}
  void step(double, LaneMask, const BlockArray&) override {}

 private:
  ContactLists lists_;
};

Contact contact(int a, int b, double phi, double impulse) {
  Contact out;
  out.a = a, out.b = b, out.phi = phi;
  out.impulse_W = impulse * out.n_W;
  return out;
}

Model parts(const std::vector<std::string>& names) {
  Model out;
  for (const std::string& name : names) {
    Collider collider;
    collider.name = name;
    out.colliders.push_back(collider);
  }
  return out;
}

TEST(InvalidReason, NamesStepAndCulprits) {
  const Model model = parts({"palm", "thumb", "toe", "ground"});
  const std::vector<Contact> contacts = {contact(0, 1, -1e-3, 0.5), contact(0, 1, -6.2e-3, 0.25),
                                         contact(0, 2, -2e-3, 0),   contact(1, 2, -0.5e-3, 0),
                                         contact(2, 3, 1e-3, 3),    contact(1, 3, 2e-3, 0)};
  const Shown physics(contacts, 3);
  EXPECT_EQ(
      invalid_reason("it burst", 51, 0.051, model, physics, 3),
      "step 51 (0.051 s), 'palm' in 'thumb' by 6.2 mm, 'palm' in 'toe' by 2 mm, 'toe' against 'ground' with 3 N s, "
      "'palm' against 'thumb' with 0.75 N s: it burst");
  EXPECT_EQ(invalid_reason("it burst", 7, 0.0035, model, physics, 2), "step 7 (0.0035 s), nothing touched: it burst");
}

// What has left the range of a double has contacts without numbers.
TEST(InvalidReason, PassesOverWhatIsNoNumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Shown physics({contact(0, 1, nan, nan), contact(0, 1, -2e-3, nan)}, 0);
  EXPECT_EQ(invalid_reason("state is not finite", 1, 1e-3, parts({"a", "b"}), physics, 0),
            "step 1 (0.001 s), 'a' in 'b' by 2 mm: state is not finite");
}

}  // namespace
}  // namespace graze
