// Claim: links that begin in each other are told with what is to be pasted, and are kept apart where that is wanted, by
// every particle; so are neighbours across a body of no account.
#include "scenarios/overlaps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/model/fabrication.h"
#include "tests/scenarios/support.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

Scenario tangle(const std::string& robot, const std::string& more = "") {
  return testing::read("graze: 1\nrobot: {urdf: robots/tangle.urdf" + robot + "}\ngravity: 0\n" +
                       "policies: {rest: {hold: {}, control: {joint_pd: {kp: 10}}}}\n" + more);
}

/// "a-c", of pairs that may touch.
std::vector<std::string> pairs_of(const Model& model) {
  std::vector<std::string> out;
  for (const ColliderPair& pair : model.pairs) {
    out.push_back(model.colliders[pair.a].name + "-" + model.colliders[pair.b].name);
  }
  return out;
}

TEST(Overlaps, AreToldWithWhatMendsThem) {
  const Scenario s = tangle("");
  EXPECT_THAT(pairs_of(s.model), ElementsAre("a-c", "a-d", "b-d", "b-e", "c-e", "d-e"));  // a-e are neighbours
  EXPECT_THAT(s.warnings, Contains(AllOf(HasSubstr("links are in each other at the start: b and d by 20 mm"),
                                         HasSubstr("'contact: {ignore: [[b, d]]}'"),
                                         HasSubstr("'robot: {ignore_initial_overlaps: true}'"))));
  EXPECT_THAT(tangle("", "contact: {ignore: [[b, d]]}\n").warnings,
              Not(Contains(HasSubstr("each other"))));  // what it says is right
}

TEST(Overlaps, AreIgnoredWhereThatIsWanted) {
  const Scenario s =
      tangle(", ignore_initial_overlaps: true", "uncertain: {\"robot.link.*.mass\": {normal: {std: 5 %}}}\n");
  EXPECT_THAT(pairs_of(s.model), ElementsAre("a-c", "a-d", "b-e", "c-e", "d-e"));
  EXPECT_THAT(s.warnings, Contains(HasSubstr("1 pair of links begin in each other and never touch: b and d by 20 mm")));
  std::vector<std::string> paths;
  std::vector<double> values;
  for (const UncertainParameter& parameter : s.space.parameters) {
    paths.push_back(parameter.name);
    values.push_back(2 * parameter.nominal);
  }
  const Particle heavy = Fabricator(s.world, paths).fabricate(0, values);
  EXPECT_EQ(pairs_of(heavy.model), pairs_of(s.model));
  EXPECT_THAT(pairs_of(tangle(", ignore_initial_overlaps: false").model), Contains("b-d"));
}

}  // namespace
}  // namespace graze
