// What the brake takes is told in each step: nothing worth telling where contact was solved, and more where a solve was
// cut short and would have given energy.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/engine/lanes/worlds.h"

namespace graze::test {
namespace {

struct Seen {
  int steps = 0, converged = 0;
  int braked = 0, braked_converged = 0;  // by more than 1e-4 m/s; of these, in steps that converged
  double most = 0;                       // the largest that was taken, m/s
};

/// LINKS falls onto the ground, limp, solved by so many sweeps.
Seen fall(int sweeps) {
  World world = busy_world();
  const Particle particle = particle_of(world);
  const Model& model = particle.model;
  BlockState state{BlockArray(model.nq), BlockArray(model.nv), BlockArray(model.nv),
                   BlockArray(12 * static_cast<int>(model.bodies.size()))};
  LaneEngine engine(model, kernel_of(chosen_isa()), {state.q.row(0), state.v.row(0), state.a.row(0), state.X.row(0)});
  engine.start(0, model, particle.initial);
  engine.block().settings.most_sweeps = sweeps;
  const BlockArray tau(model.na() + 1);
  Seen out;
  for (; out.steps < 1500 && engine.suspect() == 0; ++out.steps) {
    engine.step(1e-3, 1, tau.row(0));
    EXPECT_GE(engine.braked(0), 0);
    const bool converged = engine.residual(0) <= engine.block().settings.tolerance;
    out.converged += converged;
    out.braked += engine.braked(0) > 1e-4;
    out.braked_converged += converged && engine.braked(0) > 1e-4;
    out.most = std::max(out.most, engine.braked(0));
  }
  return out;
}

TEST(Brake, TakesNothingWhereContactIsSolved) {
  for (const int sweeps : {1, 10, 60, 2000}) {
    const Seen seen = fall(sweeps);
    EXPECT_EQ(seen.steps, 1500);
    EXPECT_GT(seen.converged, 10) << sweeps;
    EXPECT_EQ(seen.braked_converged, 0) << sweeps;
  }
}

TEST(Brake, TellsWhatItTakesOfASolveThatWasCutShort) {
  const Seen seen = fall(1);
  EXPECT_LT(seen.converged, 1000);
  EXPECT_GT(seen.braked, 0);
  EXPECT_GT(seen.most, 1e-3);
}

}  // namespace
}  // namespace graze::test
