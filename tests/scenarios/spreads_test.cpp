// Claim: a spread becomes the distribution that sampling makes of the same numbers in SI units, whatever form it is
// written in; it is refused where a draw could leave the parameter's bounds, and one step inside of them it is not; and
// what hardly is meant is warned of on one side of a bound and not on the other.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/settings/warnings.h"
#include "sampling/constants.h"
#include "scenarios/spread.h"
#include "tests/message_of.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Parameter parameter_of(double nominal, Quantity quantity = Quantity::length) {
  Parameter out;
  out.path = "thing.size";
  out.nominal = nominal;
  out.quantity = quantity;
  out.lower = -kInfinity;
  out.upper = kInfinity;
  return out;
}

Settings written_spread(const std::string& yaml) { return Settings::parse("s: " + yaml, "s.yaml").at("s"); }

Spread spread_of(const std::string& yaml, const Parameter& parameter, Standing standing = Standing::beside_nominal) {
  return read_spread(written_spread(yaml), parameter, standing);
}

std::string refused_spread(const std::string& yaml, const Parameter& parameter,
                           Standing standing = Standing::beside_nominal) {
  return testing::message_of([&] { spread_of(yaml, parameter, standing); });
}

std::vector<std::string> doubts_of(const std::string& yaml, const Parameter& parameter) {
  const Warnings warnings;
  spread_of(yaml, parameter);
  return warnings.texts();
}

/// The same draws from 0.1 % to 99.9 %.
void expect_same(const Distribution& a, const Distribution& b, const std::string& yaml) {
  for (int i = 1; i < 1000; i += 37) {
    const double u = i / 1000.0;
    EXPECT_NEAR(a.quantile(u), b.quantile(u), 1e-12 * (1 + std::abs(b.quantile(u)))) << yaml;
  }
}

TEST(Spreads, AreTheDistributionsOfTheirNumbers) {
  std::mt19937 random(31);
  const auto number = [&](double low, double high) { return low + (high - low) * random() / 4294967296.0; };
  for (int i = 0; i < 60; ++i) {
    const double nominal = number(0.1, 2), a = number(0.1, 1), b = a + number(0.1, 1), c = b + number(0.1, 1);
    const Parameter parameter = parameter_of(nominal);
    const auto check = [&](const std::string& yaml, const Distribution& right) {
      expect_same(spread_of(yaml, parameter).persistent, right, yaml);
    };
    check(fmt::format("{:.17g}", a), Distribution::constant(a));
    check(fmt::format("{:.17g} cm", 100 * a), Distribution::constant(a));
    check(fmt::format("{{normal: {{std: {:.17g} mm}}}}", 1000 * a), Distribution::normal(nominal, a));
    check(fmt::format("{{normal: {{std: {:.17g} %}}}}", 100 * a), Distribution::normal(nominal, a * nominal));
    check(fmt::format("{{normal: {{mean: {:.17g}, std: {:.17g} %}}}}", b, 100 * a),
          Distribution::normal(b, a * nominal));
    check(fmt::format("{{normal: {{mean: {:.17g}, std: {:.17g}, min: {:.17g}}}}}", b, a, a),
          Distribution::truncated_normal(b, a, a, kInfinity));
    check(fmt::format("{{normal: {{mean: {:.17g}, std: {:.17g}, max: {:.17g}}}}}", b, a, c),
          Distribution::truncated_normal(b, a, -kInfinity, c));
    check(fmt::format("{{uniform: [{:.17g}, {:.17g}]}}", a, b), Distribution::uniform(a, b));
    check(fmt::format("{{uniform: {{max: {:.17g} cm, min: {:.17g} mm}}}}", 100 * b, 1000 * a),
          Distribution::uniform(a, b));
    check(fmt::format("{{uniform: {{spread: {:.17g}}}}}", a), Distribution::uniform(nominal - a, nominal + a));
    check(fmt::format("{{uniform: {{spread: {:.17g} %}}}}", 100 * a),
          Distribution::uniform(nominal - a * nominal, nominal + a * nominal));
    check(fmt::format("{{log_normal: {{log_std: {:.17g}}}}}", a), Distribution::log_normal(std::log(nominal), a));
    check(fmt::format("{{log_normal: {{median: {:.17g} cm, log_std: {:.17g}}}}}", 100 * b, a),
          Distribution::log_normal(std::log(b), a));
    check(fmt::format("{{log_uniform: [{:.17g}, {:.17g}]}}", a, b), Distribution::log_uniform(a, b));
    check(fmt::format("{{log_uniform: {{min: {:.17g}, max: {:.17g}}}}}", a, b), Distribution::log_uniform(a, b));
    check(fmt::format("{{triangular: [{:.17g}, {:.17g}, {:.17g}]}}", a, b, c), Distribution::triangular(a, b, c));
    check(fmt::format("{{triangular: {{max: {:.17g}, min: {:.17g}}}}}", nominal + b, nominal - a),
          Distribution::triangular(nominal - a, nominal, nominal + b));
    check(fmt::format("{{choice: [{:.17g}, {:.17g}]}}", a, c), Distribution::discrete({a, c}));
    check(fmt::format("{{choice: {{values: [{:.17g}, {:.17g}, {:.17g}, cm], weights: [1, 5, 2]}}}}", a, b, c),
          Distribution::discrete({a / 100, b / 100, c / 100}, {1, 5, 2}));
    check(fmt::format("{{empirical: [{:.17g}, {:.17g}, {:.17g}]}}", b, a, c), Distribution::empirical({a, b, c}));
    check(fmt::format("{{empirical: {{values: [{:.17g}, {:.17g}]}}}}", c, a), Distribution::empirical({a, c}));
  }
}

// In the world a share is of the mean that is written, under `uncertain` of the nominal value; of a negative one, too.
TEST(Spreads, SharesAreOfWhatIsMeant) {
  const Parameter parameter = parameter_of(-2);
  const auto std_of = [&](const std::string& yaml, Standing standing) {
    return spread_of(yaml, parameter, standing).persistent.std();
  };
  EXPECT_DOUBLE_EQ(std_of("{normal: {mean: 10, std: 5 %}}", Standing::beside_nominal), 0.1);
  EXPECT_DOUBLE_EQ(std_of("{normal: {mean: 10, std: 5 %}}", Standing::as_nominal), 0.5);
  EXPECT_DOUBLE_EQ(std_of("{normal: {std: 5 %}}", Standing::as_nominal), 0.1);
  EXPECT_NEAR(std_of("{uniform: {spread: 5 %}}", Standing::beside_nominal), 0.1 / std::sqrt(3.0), 1e-12);
  EXPECT_THAT(refused_spread("{normal: {std: 5 %}}", parameter_of(0)),
              EndsWith("so a spread relative to it is nothing; write it with a unit (m)"));
  EXPECT_THAT(refused_spread("{normal: {std: 5 %}}", parameter_of(0, Quantity::dimensionless)),
              EndsWith("so a spread relative to it is nothing; write it without %"));
  EXPECT_THAT(refused_spread("{normal: {std: 5 %}}", parameter_of(kInfinity)),
              EndsWith("normal: the nominal value of thing.size is unlimited: the URDF gives no limit; write 'mean'"));
}

// Jitter is about 0, and its shares are of the nominal value, or of the mean that gives one.
TEST(Spreads, JitterIsAboutNothing) {
  Parameter parameter = parameter_of(4);
  parameter.transient = true;
  const Spread beside = spread_of("{normal: {mean: 8, std: 1}, jitter: {normal: {std: 10 %}}}", parameter);
  EXPECT_DOUBLE_EQ(beside.jitter->mean(), 0);
  EXPECT_DOUBLE_EQ(beside.jitter->std(), 0.4);
  EXPECT_DOUBLE_EQ(beside.persistent.mean(), 8);
  const Spread as =
      spread_of("{normal: {mean: 8, std: 1}, jitter: {uniform: {spread: 10 %}}}", parameter, Standing::as_nominal);
  EXPECT_DOUBLE_EQ(as.jitter->highest(), 0.8);
  EXPECT_DOUBLE_EQ(as.jitter->lowest(), -0.8);
  const Spread alone = spread_of("{jitter: {noise: {density: 2 cm/sqrt(Hz)}}}", parameter);
  EXPECT_FALSE(alone.jitter);
  EXPECT_DOUBLE_EQ(*alone.noise_density, 0.02);
  EXPECT_DOUBLE_EQ(alone.persistent.median(), 4) << "nothing else was said of it";
  EXPECT_TRUE(alone.persistent.is_constant());
  EXPECT_THAT(refused_spread("{jitter: {noise: {density: 1.1e100}}}", parameter),
              EndsWith("a noise density must be at most 1e+100 m/sqrt(Hz)"));
  EXPECT_EQ(refused_spread("{jitter: {noise: {density: 1e100}}}", parameter), "(accepted)");
  EXPECT_EQ(refused_spread("{jitter: {noise: {density: 0}}}", parameter), "(accepted)");
  EXPECT_THAT(refused_spread("{jitter: {choice: [1]}}", parameter), HasSubstr("choice"));
  EXPECT_THAT(refused_spread("{jitter: {}}", parameter), HasSubstr("one of: normal, uniform"));
}

// Bounds: the least and greatest draw may lie on one, unless it is strict.
TEST(Spreads, KeepWithinTheParameter) {
  Parameter closed = parameter_of(1), strict = closed;
  closed.lower = strict.lower = 0.5, closed.upper = strict.upper = 2;
  strict.strict = true;
  const std::tuple<const char*, const char*, const char*> cases[] = {
      // written, of closed bounds, of strict ones
      {"0.5", "", "constant(0.5) is 0.5 m; thing.size must be > 0.5"},
      {"2 m", "", "constant(2) is 2 m; thing.size must be < 2"},
      {"0.49", "constant(0.49) is 0.49 m; thing.size must be >= 0.5", "thing.size must be > 0.5"},
      {"2.01", "constant(2.01) is 2.01 m; thing.size must be <= 2", "thing.size must be < 2"},
      // The ends of a uniform distribution are never drawn.
      {"{uniform: [0.5, 2]}", "", ""},
      {"{uniform: [0.4, 2]}", "can be as low as 0.4 m; thing.size must be >= 0.5: begin it at 0.5 m or above",
       "thing.size must be > 0.5: begin it at 0.5 m or above"},
      {"{uniform: [0.6, 2.1]}", "can be as high as 2.1 m; thing.size must be <= 2: end it at 2 m or below",
       "thing.size must be < 2: end it at 2 m or below"},
      {"{choice: [0.5, 2]}", "", "can be as low as 0.5 m; thing.size must be > 0.5: take out what is not above 0.5 m"},
      {"{choice: [0.6, 2]}", "", "can be as high as 2 m; thing.size must be < 2: take out what is not below 2 m"},
      {"{choice: [1, 2.5]}", "thing.size must be <= 2: take out what is above 2 m", "take out what is not below 2 m"},
      {"{normal: {std: 0.2}}", "thing.size must be >= 0.5: cut it with min: …", "cut it with min: …"},
      {"{normal: {std: 0.2, min: 0.6}}", "thing.size must be <= 2: cut it with max: …", "cut it with max: …"},
      {"{log_normal: {log_std: 1}}", "give it a smaller median or log_std", "give it a smaller median or log_std"},
      {"{uniform: {spread: 0.6 m}}", "thing.size must be >= 0.5: give it a smaller spread", "give it a smaller spread"},
      {"{uniform: {spread: 20}}", "thing.size must be >= 0.5; did you mean 20 %?", "did you mean 20 %?"},
      {"{uniform: {spread: 60}}", "thing.size must be >= 0.5: give it a smaller spread", "give it a smaller spread"},
      {"{normal: {std: 5}}", "cut it with min: …; did you mean 5 %?", "cut it with min: …; did you mean 5 %?"},
  };
  for (const auto& [yaml, of_closed, of_strict] : cases) {
    for (const auto& [bounds, message] : {std::pair{&closed, of_closed}, {&strict, of_strict}}) {
      const std::string said = refused_spread(yaml, *bounds);
      if (*message == 0) {
        EXPECT_EQ(said, "(accepted)") << yaml;
      } else {
        EXPECT_THAT(said, EndsWith(message)) << yaml;
      }
    }
  }
}

// About a nominal value on its bound half of all draws are impossible, and the message says why.
TEST(Spreads, OnTheirBoundNeedAMiddle) {
  Parameter parameter = parameter_of(0);
  parameter.lower = 0;
  EXPECT_THAT(refused_spread("{normal: {std: 1 m}}", parameter),
              EndsWith(": its middle is the nominal value 0; give it a 'mean', or cut it with min: …"));
  EXPECT_THAT(refused_spread("{uniform: {spread: 1 m}}", parameter),
              EndsWith(": its middle is the nominal value 0; write [min, max]"));
  EXPECT_THAT(refused_spread("{normal: {mean: 1, std: 1 m}}", parameter), EndsWith(">= 0: cut it with min: …"));
  parameter.upper = 1;
  EXPECT_THAT(refused_spread("40", parameter), EndsWith("thing.size must be <= 1; did you mean 40 %?"));
}

TEST(Spreads, ThatAreNoneAreRefusedWithWhatIsMeant) {
  const Parameter parameter = parameter_of(1);
  const std::pair<const char*, const char*> cases[] = {
      {"~", "s: nothing: must be a number or a distribution"},
      {"{}", "s: {}: must be a number or a distribution"},
      {"[1, 2]", "s: [1, 2]: must be a number or a distribution; did you mean {uniform: [1, 2]}?"},
      {"[1, 2, 3]", "must be a number or a distribution; did you mean {choice: [1, 2, 3]}?"},
      {"[1, [2]]", "s: [1, …]: must be a number or a distribution; did you mean {uniform: [1, …]}?"},
      {"{mean: 1}", "s.mean: is written {normal: {mean: …, std: …}}"},
      {"{std: 1}", "s.std: is written {normal: {mean: …, std: …}}"},
      {"{min: 1, max: 2}", "s.min: is written {uniform: {min: …, max: …}}"},
      {"{max: 2}", "s.max: is written {uniform: {min: …, max: …}}"},
      {"{spread: 2}", "s.spread: is written {uniform: {spread: …}}"},
      {"{uniform: 3}", "s.uniform: 3: one number is no range; write [min, max], or {spread: 3}"},
      {"{uniform: {spread: 1, min: 2}}", "s.uniform: either spread, or min and max"},
      {"{uniform: {spread: -1 m}}", "s.uniform.spread: -1 m: must be >= 0"},
      {"{uniform: [2, 1]}", "s.uniform: min 2 is above max 1; write the smaller number first"},
      {"{normal: {std: -1}}", "s.normal.std: -1: a standard deviation must be >= 0"},
      {"{normal: {std: 1 kg}}", "s.normal.std: 1 kg: the unit 'kg' does not fit; one of: m, cm, mm, in"},
      {"{log_normal: {median: -1, log_std: 1}}",
       "s.log_normal: the median -1 is not positive; a log-normal value is always > 0"},
      {"{triangular: {min: 2, max: 3}}",
       "s.triangular: the nominal value 1 of thing.size, which is the mode if none "
       "is given, is outside [2, 3]; give it a 'mode'"},
      {"{choice: {values: [1, 2], weights: [1]}}", "s.choice.weights: [1]: must be a list of 2 numbers; this has 1"},
      {"{jitter: {normal: {std: 1}}}",
       "s.jitter: thing.size is drawn once per particle and cannot change while it runs; "
       "jitter is for control.lag, actuator.… and sensor.…, but for sensor.contact.…"},
  };
  for (const auto& [yaml, message] : cases) EXPECT_THAT(refused_spread(yaml, parameter), EndsWith(message)) << yaml;
  EXPECT_EQ(refused_spread("{triangular: {min: 1, max: 3}}", parameter), "(accepted)") << "the mode may be an end";
}

// Words are drawn by their place among all that the parameter can be.
TEST(Spreads, OfWordsAreIndices) {
  Parameter model;
  model.path = "contact.model";
  model.choices = {"rigid", "soft", "sticky"};
  const Spread fixed = spread_of("sticky", model);
  EXPECT_EQ(fixed.persistent.median(), 2);
  EXPECT_THAT(fixed.labels, ElementsAre("rigid", "soft", "sticky"));
  const Spread some = spread_of("{choice: {values: [sticky, rigid], weights: [3, 1]}}", model);
  expect_same(some.persistent, Distribution::choice(3, {1, 0, 3}), "choice");
  EXPECT_THAT(refused_spread("{choice: [soft, stiky]}", model), HasSubstr("did you mean 'sticky'?"));
  EXPECT_THAT(refused_spread("hard", model), HasSubstr("must be one of: rigid, soft, sticky"));
}

TEST(Spreads, FarFromTheNominalAreDoubted) {
  Parameter mass = parameter_of(2, Quantity::mass);
  mass.lower = 0;
  mass.strict = true;
  EXPECT_THAT(doubts_of("{uniform: [199, 201]}", mass), IsEmpty()) << "a hundred times";
  EXPECT_THAT(doubts_of("{uniform: [200, 202]}", mass),
              ElementsAre(HasSubstr("201 kg is 100 times the nominal 2 kg of thing.size; is the unit right?")));
  EXPECT_THAT(doubts_of("0.0201", mass), IsEmpty());
  EXPECT_THAT(doubts_of("0.0199", mass), ElementsAre(HasSubstr("0.0199 kg is 0.00995 times the nominal 2 kg")));
  mass.strict = false;
  EXPECT_THAT(doubts_of("0.0199", mass), IsEmpty()) << "only of what must be there";
  Parameter friction = parameter_of(1, Quantity::dimensionless);
  friction.path = "contact.friction";
  EXPECT_THAT(doubts_of("5", friction), IsEmpty());
  EXPECT_THAT(doubts_of("{uniform: [4, 6.2]}", friction),
              ElementsAre(HasSubstr("friction of 5.1; rubber on asphalt has "
                                    "about 1; did you mean 5.1 %?")));
  EXPECT_THAT(friction_doubt(200), HasSubstr("did you mean 200 %?"));
  EXPECT_THAT(friction_doubt(201), EndsWith("rubber on asphalt has about 1"));
}

TEST(Spreads, ConesAreNarrowerThanHalfATurn) {
  EXPECT_DOUBLE_EQ(read_cone(written_spread("{std: 3 deg}")), 3 * std::numbers::pi / 180);
  EXPECT_DOUBLE_EQ(read_cone(written_spread("{std: 3.14159}")), 3.14159);
  EXPECT_THAT(testing::message_of([] { read_cone(written_spread("{std: 3.1416}")); }),
              EndsWith("s.std: 3.1416 rad: an axis is tilted by half a turn at most, 3.1416 rad"));
  EXPECT_THAT(testing::message_of([] { read_cone(written_spread("{std: -1 deg}")); }),
              HasSubstr("-1 deg: must be >= 0"));
}

}  // namespace
}  // namespace graze
