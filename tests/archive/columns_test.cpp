// Claim: behind a fitting seal, too, every column of an archive is checked: what cannot be is refused at its boundary,
// by verify() and by who reads it, with a message that names the column.
#include <gmock/gmock.h>

#include <array>

#include "archive/directory/campaign_directory.h"
#include "archive/directory/shard.h"
#include "archive/schema/schema.h"
#include "archive/verify.h"
#include "tests/archive/forge.h"
#include "tests/sanitized.h"

namespace graze {
namespace {

using namespace synthetic;
using ::testing::AllOf;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr std::uint64_t kBytes = 1 << 20;

class Columns : public ::testing::Test {
 protected:
  /// What verify() says of the packed campaign with one thing changed; empty: it is whole.
  std::string verdict(const std::function<void(hid_t)>& change) const {
    const VerifiedFile found = verify(forged(folder_, source_, change)).files.at(0);
    EXPECT_EQ(found.what.empty(), found.state == VerifiedFile::State::whole);
    return found.what;
  }
  /// The same, and what reading it all says.
  std::string reading(const std::function<void(hid_t)>& change) const {
    return refusal(forged(folder_, source_, change));
  }
  /// Changes a column.
  template <class T>
  static std::function<void(hid_t)> edit(const std::string& group, const hdf5::Spec& spec,
                                         const std::function<void(std::vector<T>&)>& act) {
    return [=](hid_t f) {
      auto data = hdf5::read_column<T>(f, group, spec, kBytes);
      act(data);
      replace(f, group, spec, data);
    };
  }
  template <class T>
  static std::function<void(hid_t)> put_at(const std::string& group, const hdf5::Spec& spec, std::size_t i, T value) {
    return edit<T>(group, spec, [=](std::vector<T>& data) { data.at(i) = value; });
  }
  /// Index of the first event of the kind (4: limit_begin).
  std::size_t event_of(std::uint8_t kind) const {
    const hdf5::Lock lock;
    const hdf5::Handle file = hdf5::open_for_reading(source_);
    const auto kinds = hdf5::read_column<std::uint8_t>(file.id(), events_, schema::kind(), kBytes);
    return static_cast<std::size_t>(std::find(kinds.begin(), kinds.end(), kind) - kinds.begin());
  }

  Folder folder_;
  fs::path source_ = packed(folder_);
  const Widths widths_ = widths_of(info());
  const std::string traces_ = schema::traces_group("hold"), events_ = schema::events_group("hold"),
                    telemetry_ = schema::telemetry_group("hold");
};

TEST_F(Columns, EventsNameWhatTheCampaignHas) {
  const std::size_t contact = event_of(0), limit = event_of(4);
  const auto expect = [&](const std::function<void(hid_t)>& change) {
    EXPECT_THAT(verdict(change), HasSubstr("'events/hold': an event with an index out of range"));
    EXPECT_THAT(reading(change), HasSubstr("'events/hold': an event with an index out of range"));
  };
  expect(put_at<std::uint8_t>(events_, schema::kind(), contact, 10));
  for (const char* feature : {"feature_a", "feature_b"}) {
    EXPECT_EQ(verdict(put_at<std::uint8_t>(events_, schema::feature(feature), contact, 7)), "");
    expect(put_at<std::uint8_t>(events_, schema::feature(feature), contact, 8));
  }
  for (const char* side : {"a", "b"}) {
    EXPECT_EQ(verdict(put_at<std::int32_t>(events_, schema::collider(side), contact, 2)), "");
    expect(put_at<std::int32_t>(events_, schema::collider(side), contact, 3));
    expect(put_at<std::int32_t>(events_, schema::collider(side), contact, -1));
  }
  expect(put_at<std::int32_t>(events_, schema::collider("a"), limit, 2));  // there are two bodies
  expect(put_at<std::int32_t>(events_, schema::collider("b"), limit, 0));
  EXPECT_EQ(verdict(put_at<std::int32_t>(events_, schema::collider("b"), limit, 1)), "");
}

TEST_F(Columns, TimesLieWithinTheTrace) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(verdict(put_at<double>(traces_, schema::end_time(), 3, 1.5)), "");
  const auto invalid_with = [&](double end) {
    return [=, this](hid_t f) {
      put_at<std::uint8_t>(traces_, schema::outcome(), 3, 3)(f);
      put_at<std::int32_t>(traces_, schema::violated(), 3, -1)(f);
      put_at<double>(traces_, schema::end_time(), 3, end)(f);
    };
  };
  EXPECT_EQ(verdict(invalid_with(nan)), "") << "its simulation threw";
  EXPECT_THAT(verdict(invalid_with(2)), HasSubstr("does not lie in a trace"));
  EXPECT_THAT(verdict(put_at<double>(traces_, schema::end_time(), 3, nan)),
              HasSubstr("'traces/hold/end_time': nan s does not lie in a trace"));
  EXPECT_THAT(verdict(put_at<double>(traces_, schema::end_time(), 3, 1.501)),
              HasSubstr("'traces/hold/end_time': 1.501 s does not lie in a trace, 0 to 1.5 s"));
  for (const double time : {1.501, -1e-9, nan}) {
    EXPECT_THAT(verdict(put_at<double>(events_, schema::time(), 2, time)), HasSubstr("'events/hold/time'"));
    EXPECT_THAT(verdict(put_at<double>(telemetry_, schema::time(), 2, time)), HasSubstr("'telemetry/hold/time'"));
  }
}

/// Row `row` of the traces of 'hold' becomes an invalid trace.
void make_invalid(hid_t f, std::size_t row) {
  auto outcome = hdf5::read_column<std::uint8_t>(f, "traces/hold", schema::outcome(), kBytes);
  auto violated = hdf5::read_column<std::int32_t>(f, "traces/hold", schema::violated(), kBytes);
  outcome.at(row) = 3;
  violated.at(row) = -1;
  replace(f, "traces/hold", schema::outcome(), outcome);
  replace(f, "traces/hold", schema::violated(), violated);
}

// Claim: no reader passes on when a trace ended, when it was violated or its last state if no trace can have them; the
// last state of an invalid one may be anything.
TEST_F(Columns, NumbersOfTracesArePossible) {
  constexpr double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    hdf5::Spec spec;
    unsigned column;
    std::vector<double> wrong;
    bool of_invalid;  // wrong there, too
  };
  const std::vector<Case> cases = {{schema::end_time(), kEndTime, {nan, inf, -1, 2}, false},
                                   {schema::first_violations(widths_), kFirstViolations, {inf, -inf, -1, 2}, true},
                                   {schema::final_q(widths_), kFinalState, {nan, inf, -inf}, false},
                                   {schema::final_v(widths_), kFinalState, {nan, inf, -inf}, false}};
  for (std::size_t i = 0; const Case& one : cases) {
    for (const double value : one.wrong) {
      if (!test::tried(i++, 3)) continue;
      SCOPED_TRACE(one.spec.name + " " + std::to_string(value));
      const auto change = put_at<double>(traces_, one.spec, 4 * one.spec.width, value);
      const std::string text = "'traces/hold/" + one.spec.name + "'";
      EXPECT_THAT(verdict(change), HasSubstr(text));
      {
        const Archive archive(forged(folder_, source_, change));
        const auto scan = [&](unsigned columns, Outcome unwanted) {
          archive.scan(
              "hold", columns, [](const TraceRows&) {}, [&](std::uint32_t, Outcome is) { return is != unwanted; });
        };
        EXPECT_THAT(message_of<InputError>([&] { scan(one.column, Outcome::invalid); }), HasSubstr(text));
        EXPECT_THAT(message_of<InputError>([&] { archive.trace("hold", 4); }), HasSubstr(text));
        EXPECT_NO_THROW(scan(kMargins, Outcome::invalid)) << "what was not asked for is not looked at";
      }
      const auto of_invalid = [&](hid_t f) { change(f), make_invalid(f, 4); };
      const bool refused = one.of_invalid || (one.spec.name == "end_time" && !std::isnan(value));
      EXPECT_EQ(verdict(of_invalid).empty(), !refused);
      const fs::path file = forged(folder_, source_, of_invalid);
      if (refused) {
        EXPECT_THROW(read_all(file), InputError);
      } else {
        EXPECT_NO_THROW(read_all(file));
      }
    }
  }
}

// Claim: rows without digests are refused, whatever is asked for.
TEST_F(Columns, DigestsAreNeverMissing) {
  const Archive archive(forged(folder_, source_, [](hid_t f) { drop(f, "traces/hold/digest"); }));
  const auto scan = [&] { archive.scan("hold", 0, [](const TraceRows&) {}); };
  EXPECT_THAT(message_of<InputError>(scan), AllOf(HasSubstr("forged.h5"), HasSubstr("'traces/hold/digest'")));
}

TEST_F(Columns, OutcomesArePossible) {
  const auto both = [&](std::uint8_t outcome, std::int32_t violated) {
    return [=, this](hid_t f) {
      put_at<std::uint8_t>(traces_, schema::outcome(), 5, outcome)(f);
      put_at<std::int32_t>(traces_, schema::violated(), 5, violated)(f);
    };
  };
  using Pair = std::pair<int, int>;
  for (const auto& [outcome, violated] : std::vector<Pair>{{4, -1}, {1, 2}, {1, -1}, {2, -2}}) {
    const auto change = both(static_cast<std::uint8_t>(outcome), violated);
    const std::string text =
        "outcome " + std::to_string(outcome) + " with violated requirement " + std::to_string(violated);
    EXPECT_THAT(verdict(change), HasSubstr("'traces/hold', row 5: " + text + " is not possible"));
    EXPECT_THAT(reading(change), HasSubstr("policy 'hold', particle 5: " + text));
    const Archive archive(forged(folder_, source_, change));
    EXPECT_THAT(message_of<InputError>([&] { archive.trace("hold", 5); }), HasSubstr("particle 5: " + text));
    EXPECT_TRUE(archive.trace("hold", 4));
  }
}

// Claim: verify() tells who has rewritten an outcome, or what it follows from, whatever the seal says.
TEST_F(Columns, OutcomesFollowFromTheirMargins) {
  struct Row {
    Outcome outcome;
    int violated;
    double objective;
    std::array<double, 2> margins, times;
    std::string why;
  };
  const double never = std::nan("");
  const auto change = [&](const Row& row) {
    return [=, this](hid_t f) {
      put_at<std::uint8_t>(traces_, schema::outcome(), 5, static_cast<std::uint8_t>(row.outcome))(f);
      put_at<std::int32_t>(traces_, schema::violated(), 5, row.violated)(f);
      put_at<double>(traces_, schema::end_time(), 5, 1.0)(f);
      put_at<double>(traces_, schema::objective_margin(), 5, row.objective)(f);
      for (std::size_t i = 0; i < 2; ++i) {
        put_at<double>(traces_, schema::margins(widths_), 2 * 5 + i, row.margins[i])(f);
        put_at<double>(traces_, schema::first_violations(widths_), 2 * 5 + i, row.times[i])(f);
      }
    };
  };
  using enum Outcome;
  for (const Row& row : std::vector<Row>{
           {success, -1, 0, {1, 0}, {never, never}, ""},
           {success, -1, -0.5, {1, 1}, {never, never}, "the objective's margin -0.5 makes no success"},
           {success, -1, 1, {1, -1}, {never, 0.5}, "requirement 1 was violated at 0.5 s, which is a failure"},
           {success, -1, 1, {1, -2}, {never, never}, "requirement 1 has margin -2 and was never violated"},
           {success, -1, 1, {never, 1}, {never, never}, "requirement 0 has margin nan and was never violated"},
           {success, 1, 1, {1, 1}, {never, never}, "requirement 1 is told as the failure"},
           {unknown_failure, -1, -1, {1, 1}, {never, never}, ""},
           {unknown_failure, -1, 1, {1, 1}, {never, never}, "the objective's margin 1 makes a success"},
           {known_failure, 1, 1, {1, -1}, {never, 0.5}, ""},
           {known_failure, 1, 1, {1, 1}, {never, 0.5}, ""},  // no number
           {known_failure, 1, 1, {1, -1}, {never, 1.25}, "requirement 1 was violated at 1.25 s, and the trace"},
           {known_failure, 0, 1, {1, -1}, {never, 0.5}, "requirement 0 is the failure and was never violated"},
           {known_failure, 1, 1, {-1, -1}, {0.1, 0.5}, "requirement 1 is the failure, and 0 was violated before it"}}) {
    const std::string text = "outcome " + std::to_string(static_cast<int>(row.outcome)) + " is not possible: ";
    if (row.why.empty()) {
      EXPECT_EQ(verdict(change(row)), "");
    } else {
      EXPECT_THAT(verdict(change(row)), HasSubstr("'traces/hold', row 5: " + text + row.why));
    }
  }
}

TEST_F(Columns, CulpritsArePartsOfTheCampaign) {
  // 'upright' has no parts, 'clears-curb' nine pairs.
  for (const hdf5::Spec& spec : {schema::margin_parts(widths_), schema::violation_parts(widths_)}) {
    const auto part = [&](std::size_t requirement, std::int32_t value) {
      return verdict(put_at<std::int32_t>(traces_, spec, 2 * 6 + requirement, value));
    };
    EXPECT_EQ(part(1, 8), "");
    for (const std::int32_t wrong : {9, -2}) {
      EXPECT_THAT(part(1, wrong),
                  HasSubstr("'traces/hold/" + spec.name + "': " + std::to_string(wrong) + " is no part"));
    }
    EXPECT_THAT(part(0, 0), HasSubstr("0 is no part of the campaign"));
  }
  // The first leaf has no parts, the second three links.
  const auto culprit = [&](std::int32_t leaf, std::int32_t part) {
    return verdict(edit<std::int32_t>(traces_, schema::objective_culprit(), [=](std::vector<std::int32_t>& data) {
      data.at(12) = leaf;
      data.at(13) = part;
    }));
  };
  EXPECT_EQ(culprit(0, -1), "");
  EXPECT_EQ(culprit(1, 2), "");
  EXPECT_EQ(culprit(-1, -1), "");
  using Pair = std::pair<int, int>;
  for (const auto& [leaf, part] : std::vector<Pair>{{0, 0}, {1, 3}, {2, -1}, {-2, -1}, {-1, 0}, {1, -2}}) {
    EXPECT_THAT(culprit(leaf, part), HasSubstr("'traces/hold': a culprit that the campaign does not have")) << leaf;
  }
}

TEST_F(Columns, WordsAreInTheirDictionary) {
  for (const hdf5::Spec& spec : {schema::sequence(), schema::invalid_reason()}) {
    const char* const texts = spec.name == "sequence" ? schema::kSequences : schema::kReasons;
    const std::size_t count = [&] {
      const hdf5::Lock lock;
      return hdf5::read_strings(hdf5::open_for_reading(source_).id(), texts).size();
    }();
    const auto change = [&](hid_t f) {
      put_at<std::uint8_t>(traces_, schema::outcome(), 5, 3)(f);  // invalid: it has a reason
      put_at<std::int32_t>(traces_, schema::violated(), 5, -1)(f);
      put_at<std::uint32_t>(traces_, spec, 5, static_cast<std::uint32_t>(count))(f);
    };
    EXPECT_THAT(verdict(change), HasSubstr("'traces/hold/" + spec.name + "': index out of range"));
    EXPECT_THAT(reading(change), HasSubstr("'traces/hold/" + spec.name + "': index out of range"));
    if (spec.name == "sequence") continue;
    const Archive archive(forged(folder_, source_, change));
    EXPECT_THAT(message_of<InputError>([&] { archive.trace("hold", 5); }), HasSubstr("invalid_reason"));
  }
}

TEST_F(Columns, RowsAreInOrderOfParticle) {
  const auto swap = [](std::vector<std::uint32_t>& ids) { std::swap(ids.at(7), ids.at(8)); };
  for (const std::string& group : {traces_, std::string(schema::kParticles)}) {
    EXPECT_THAT(verdict(edit<std::uint32_t>(group, schema::particle(), swap)),
                HasSubstr("'" + group + "' is not in order of particle id"));
  }
}

TEST_F(Columns, OffsetsBeginAtTheFirstRow) {
  for (const std::string& group : {events_, telemetry_}) {
    const auto change = edit<std::uint64_t>(group, schema::offset(), [](std::vector<std::uint64_t>& offset) {
      std::size_t i = 0;
      while (offset.at(i) == 0) offset.at(i++) = 1;
    });
    EXPECT_THAT(verdict(change), HasSubstr("'" + group + "/offset' does not divide its table"));
    EXPECT_THAT(reading(change), HasSubstr("'" + group + "/offset' does not divide its table"));
  }
}

TEST_F(Columns, AreAsLongAsTheirTable) {
  const auto doubles = [&](const std::string& group, const hdf5::Spec& spec, std::size_t rows) {
    return verdict([&](hid_t f) { replace(f, group, spec, std::vector<double>(rows * spec.width)); });
  };
  for (const hdf5::Spec& spec : {schema::end_time(), schema::objective_margin(), schema::solver(),
                                 schema::convergence(), schema::margins(widths_), schema::first_violations(widths_),
                                 schema::final_q(widths_), schema::final_v(widths_)}) {
    for (const std::size_t rows : {15u, 17u}) {
      EXPECT_THAT(doubles(traces_, spec, rows),
                  HasSubstr("'traces/hold/" + spec.name + "' has " + std::to_string(rows) + " rows instead of 16"));
    }
  }
  EXPECT_THAT(doubles("particles", schema::values(widths_), 15), HasSubstr("has 15 rows instead of 16"));
  EXPECT_THAT(verdict([&](hid_t f) { replace(f, traces_, schema::digest(), std::vector<std::uint64_t>(15)); }),
              HasSubstr("'traces/hold/digest' has 15 rows instead of 16"));
  EXPECT_THAT(doubles(telemetry_, schema::telemetry_tau(widths_), 1), HasSubstr("'telemetry/hold/tau' has 1 rows"));
}

// Claim: what no solver can have done is refused by whoever reads it, verifies it or packs it, with path, row and
// column.
TEST_F(Columns, OfTheSolverArePossible) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinite = std::numeric_limits<double>::infinity();
  const auto with = [&](std::vector<double> solver, std::vector<double> more) {
    return verdict([&](hid_t f) {
      std::vector<double> all, all_more;
      for (int i = 0; i < 16; ++i) {
        all.insert(all.end(), solver.begin(), solver.end());
        all_more.insert(all_more.end(), more.begin(), more.end());
      }
      replace(f, traces_, schema::solver(), all);
      replace(f, traces_, schema::convergence(), all_more);
    });
  };
  EXPECT_THAT(reading(put_at<double>(traces_, schema::solver(), 3, -1)),
              HasSubstr("hold/solver', row 0, column 3: -1 is no number"));
  EXPECT_EQ(with({2, 60, 0.1, 10}, {10, 0.01, 10, 0.1}), "");
  EXPECT_EQ(with({0, 0, 0, 0}, {0, 0, 0, 0}), "");
  for (std::size_t i = 0; const double wrong : {-1.0, 0.5, kNan, kInfinite, 1e17}) {
    if (!test::tried(i++, 3)) continue;
    EXPECT_THAT(with({2, 60, 0.1, wrong}, {1e15, 0.01, 0, 0}), HasSubstr("hold/solver', row 0, column 3: ")) << wrong;
    EXPECT_THAT(with({2, 60, 0.1, 0}, {wrong, 0.01, 0, 0}), HasSubstr("is no number of steps")) << wrong;
  }
  EXPECT_THAT(with({2, 60, 0.1, 11}, {10, 0.01, 0, 0}),
              HasSubstr("'traces/hold/solver', row 0, column 3: 11 is no number of the trace"));
  EXPECT_THAT(with({2, 60, 0.1, 1}, {10, 0.01, 11, 0}),
              HasSubstr("/convergence', row 0, column 2: 11 is no number of the trace"));
  EXPECT_THAT(with({2, 60, -0.1, 1}, {10, 0.01, 0, 0}), HasSubstr("-0.1 is no change of velocity"));
  EXPECT_THAT(with({2, 60, kNan, 1}, {10, 0.01, 0, 0}), HasSubstr("is no change of velocity"));
  EXPECT_THAT(with({2, 60, 0.1, 1}, {10, kNan, 0, 0}), HasSubstr("is no median of changes of velocity"));
  EXPECT_THAT(with({kNan, 60, 0.1, 1}, {10, 0.1, 0, 0}), HasSubstr("column 0: nan is no mean of numbers of sweeps"));
  EXPECT_THAT(with({61, 60, 0.1, 1}, {10, 0.1, 0, 0}), HasSubstr("column 0: 61 is no mean of numbers of sweeps"));
  for (std::size_t i = 0; const double wrong : {kNan, kInfinite, 0.5, -1.0}) {
    if (!test::tried(i++, 3)) continue;
    EXPECT_THAT(with({2, wrong, 0.1, 1}, {10, 0.01, 0, 0}), HasSubstr("column 1: ")) << wrong;
    EXPECT_THAT(with({2, 60, 0.1, 1}, {10, 0.01, wrong, 0}), HasSubstr("is no number of the trace's steps")) << wrong;
  }
  for (std::size_t i = 0; const double wrong : {kNan, kInfinite, -1.0}) {
    if (!test::tried(i++, 3)) continue;
    EXPECT_THAT(with({2, 60, wrong, 1}, {10, 0.01, 0, 0}), HasSubstr("hold/solver', row 0, column 2: ")) << wrong;
    EXPECT_THAT(with({2, 60, 0.1, 1}, {10, wrong, 0, 0}), HasSubstr("convergence', row 0, column 1: ")) << wrong;
    EXPECT_THAT(with({2, 60, 0.1, 1}, {10, 0.01, 1, wrong}), HasSubstr("convergence', row 0, column 3: ")) << wrong;
  }
  EXPECT_THAT(with({2, 60, 0.1, 1}, {10, 0.2, 0, 0}), HasSubstr("0.2 is no median of changes"));
  EXPECT_THAT(with({2, 60, 0.1, 0}, {10, 0.01, 0, 0}), HasSubstr("0.01 is no median of changes"));
  EXPECT_THAT(with({2, 60, 0.1, 0}, {10, 0, 1, 1e-4}), HasSubstr("0.0001 is no change of velocity that is counted"));
}

// Claim: a row is told by its number; of an invalid trace a change of velocity may be infinite, a number of steps may
// not; columns that the campaign speaks of must be there.
TEST_F(Columns, OfTheSolverAreThereAndOfInvalidTracesToo) {
  const auto put_infinite = put_at<double>(traces_, schema::solver(), 4 * 3 + 2, HUGE_VAL);
  EXPECT_THAT(verdict(put_infinite), HasSubstr("'traces/hold/solver', row 3, column 2: inf is no change of velocity"));
  EXPECT_THAT(reading(put_infinite), HasSubstr("'traces/hold/solver', row 3, column 2: inf is no change of velocity"));
  EXPECT_EQ(verdict([&](hid_t f) { make_invalid(f, 3), put_infinite(f); }), "");
  for (const char* name : {"solver", "convergence"}) {
    const auto lost = [&](hid_t f) { drop(f, (traces_ + "/" + name).c_str()); };
    EXPECT_THAT(verdict(lost), HasSubstr("'traces/hold/" + std::string(name) + "' is not there, and the campaign has"));
    EXPECT_THAT(reading(lost), HasSubstr("'traces/hold/" + std::string(name) + "' is not there"));
  }
}

// Claim: a measure decides nothing, so no failure can be by one; whoever reads a trace refuses that.
TEST(Measures, ViolateNothing) {
  const Folder folder;
  CampaignInfo facts = info();
  facts.particles = 4;
  facts.scenario_text = "graze: 1";
  facts.requirements.push_back({"smooth", "", "m", true});
  {
    CampaignWriter writer(folder / "a.graze", facts, false);
    Block one = block(facts, 0, range(0, 4));
    for (TraceRecord& record : one.traces) {
      record.outcome = Outcome::known_failure;
      record.violated = record.particle == 2 ? 2 : 1;
      record.first_violations.assign(3, std::nan(""));
      record.first_violations[static_cast<std::size_t>(record.violated)] = record.end_time;
    }
    writer.append(0, std::move(one.traces), std::move(one.values));
    writer.finish(false);
  }
  const Archive archive(folder / "a.graze");
  EXPECT_TRUE(archive.trace("step/1cm", 1));
  EXPECT_THAT(message_of<InputError>([&] { archive.trace("step/1cm", 2); }),
              HasSubstr("particle 2: outcome 1 with violated requirement 2 is not possible"));
  EXPECT_THROW(archive.scan("step/1cm", 0, [](const TraceRows&) {}), InputError);
  EXPECT_THAT(verify(folder / "a.graze").files.back().what, HasSubstr("violated requirement 2 is not possible"));
}

/// Two shards of these particles of the first policy.
void write_two(const fs::path& path, const CampaignInfo& facts, std::vector<std::uint32_t> first,
               std::vector<std::uint32_t> second, std::uint64_t changed = 0) {
  CampaignDirectory directory(path, facts, false);
  for (const auto& ids : {first, second}) {
    ShardBuffer buffer(facts.policies.size());
    Block one = block(facts, 0, ids);
    if (ids == second) one.traces.front().digest ^= changed;
    buffer.add(0, std::move(one.traces), one.values, facts.parameters.size());
    directory.add_shard(std::move(buffer));
  }
}

// Claim: who meets a particle that went two ways names both files, whichever way it reads.
TEST(TwoParts, AreNamedWhenTheyDiffer) {
  const Folder folder;
  const CampaignInfo facts = info();
  write_two(folder / "a.graze", facts, range(0, 8), range(5, 12), 1);
  const auto expect = [](const std::string& message) {
    EXPECT_THAT(message, HasSubstr("000002.h5: particle 5 of policy 'step/1cm' went another way here than in "));
    EXPECT_THAT(message, HasSubstr("000001.h5; these shards are not of one campaign: move the one"));
  };
  const Archive archive(folder / "a.graze");
  expect(message_of<InputError>([&] { archive.trace("step/1cm", 0); }));
  expect(message_of<InputError>([&] { archive.scan("step/1cm", 0, [](const TraceRows&) {}); }));
  expect(message_of<InputError>([&] { pack(folder / "a.graze", folder / "a.h5", false); }));
}

/// Takes columns that older programs do not write out of a shard.
void make_older(const fs::path& shard, const std::string& group) {
  fs::resize_file(shard, fs::file_size(shard) - 24);  // its seal
  {
    const hdf5::Lock lock;
    const hdf5::Handle file(H5Fopen(shard.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose, shard.string());
    for (const char* name : {"/solver", "/convergence", "/margin_parts", "/violation_parts", "/objective_culprit"}) {
      drop(file.id(), (group + name).c_str());
    }
  }
  reseal(shard, false);
}

// Claim: where one shard lacks later columns the packed file lacks them, too, and nothing else; a shard without traces
// of the policy lacks nothing.
TEST(TwoParts, PackWithoutWhatOneOfThemLacks) {
  const Folder folder;
  CampaignInfo facts = info();
  facts.tells_convergence = false;  // an older program began it
  write_two(folder / "a.graze", facts, range(0, 8), range(8, 16));
  {
    CampaignDirectory directory(folder / "a.graze", facts, ExistingCampaign{});
    ShardBuffer buffer(facts.policies.size());
    Block one = block(facts, 2, range(0, 8));
    buffer.add(2, std::move(one.traces), one.values, facts.parameters.size());
    directory.add_shard(std::move(buffer));
  }
  make_older(folder / "a.graze/shards/000001.h5", "traces/step/1cm");
  fs::remove_all(folder / "a.graze/manifest");
  pack(folder / "a.graze", folder / "a.h5", false);
  const Archive archive(folder / "a.h5");
  for (std::uint32_t id = 0; id < 16; ++id) {
    const std::optional<TraceRecord> got = archive.trace("step/1cm", id);
    ASSERT_TRUE(got);
    EXPECT_EQ(got->digest, trace(facts, 0, id).digest);
    EXPECT_TRUE(got->margin_parts.empty());
  }
  archive.scan("step/1cm", kSolver, [](const TraceRows& rows) { EXPECT_FALSE(rows.has_solver()); });
  archive.scan("hold", kSolver, [](const TraceRows& rows) { EXPECT_TRUE(rows.has_solver()); });
  EXPECT_EQ(archive.trace("hold", 3)->margin_parts, trace(facts, 2, 3).margin_parts);
  EXPECT_EQ(verify(folder / "a.h5").files.at(0).state, VerifiedFile::State::whole);
}

// Claim: values of particles that ran ahead are not scanned.
TEST(TwoParts, ValuesBeyondTheAnswerAreNotScanned) {
  const Folder folder;
  CampaignInfo facts = info();
  {
    CampaignWriter writer(folder / "a.graze", facts, false);
    Block one = block(facts, 0, range(0, 40));
    writer.append(0, std::move(one.traces), std::move(one.values));
    writer.finish(true, 24);
  }
  std::size_t seen = 0;
  Archive(folder / "a.graze").scan_values([&](std::uint32_t id, std::span<const double>) {
    seen += id < 24 ? 1 : 100;
  });
  EXPECT_EQ(seen, 24u);
}

}  // namespace
}  // namespace graze
