// Claim: a back end takes the contact models that it has, and no others silently.

#include <gtest/gtest.h>

#include "engine/settings/settings.h"
#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

// A contact model that a back end does not have is refused by name, the nearest suggested; none is the first.
TEST(ContactModel, UnknownNamesAreRefused) {
  for (const auto& [physics, model] :
       {std::pair{"lanes", "dantzig"}, std::pair{"lanes", "complementary"}, std::pair{"bullet", "compliant"}}) {
    World world = free_body(sphere(0.1), 1);
    world.contact.model = model;
    try {
      Bench run(std::string(physics), world);
      FAIL() << physics << " took " << model;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(model), std::string::npos);
      EXPECT_NE(std::string(error.what()).find(physics), std::string::npos);
      EXPECT_NE(std::string(error.what()).find(contact_models_of(physics).front()), std::string::npos);
    }
  }
  World world = free_body(sphere(0.1), 1);
  EXPECT_EQ(world.contact.model, "");
  Bench lanes("lanes", world);
  Bench bullet("bullet", world);
  world.contact.model = "complementary";
  try {
    Bench run("lanes", world);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("did you mean 'complementarity'?"), std::string::npos) << error.what();
  }
  // A particle of another model in a world that was right.
  Particle particle = particle_of(free_body(sphere(0.1), 1));
  particle.model.contact_model = "dantzig";
  EXPECT_THROW(lanes.physics().start(0, particle), InputError);
}

}  // namespace
}  // namespace graze::test
