// Words and tables for people: each kind of event, number and name has its text, and columns line up whatever the
// names.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

#include "analysis/culprits.h"
#include "analysis/event_text.h"
#include "analysis/events_words.h"
#include "analysis/freedoms.h"
#include "analysis/json_of.h"
#include "analysis/particle_values.h"
#include "analysis/plots_text.h"
#include "analysis/scenario_changes.h"
#include "analysis/text_table.h"
#include "archive/files/utf8.h"
#include "engine/model/rotation.h"
#include "sampling/constants.h"
#include "tests/analysis/planted_archive.h"

namespace graze {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}

// Claim: every kind of event between parts has its own verb, features are named where they are not the whole surface,
// and limits are of a body, lower or upper by the event's sign.
TEST(Words, OfEveryEvent) {
  const CampaignInfo info = synthetic::info();
  Event event;
  event.a = 0;
  event.b = 1;
  event.feature_b = Feature::side;
  const std::pair<EventKind, const char*> verbs[] = {{EventKind::contact_begin, "touches"},
                                                     {EventKind::contact_end, "leaves"},
                                                     {EventKind::stick_to_slip, "begins to slip on"},
                                                     {EventKind::slip_to_stick, "stops slipping and sticks to"},
                                                     {EventKind::stick_to_roll, "begins to roll on"},
                                                     {EventKind::roll_to_stick, "stops rolling and sticks to"},
                                                     {EventKind::slip_to_roll, "stops slipping and rolls on"},
                                                     {EventKind::roll_to_slip, "stops rolling and slips on"}};
  for (const auto& [kind, verb] : verbs) {
    event.kind = kind;
    EXPECT_EQ(event_text(event, info), "LF_FOOT " + std::string(verb) + " curb (side)");
  }
  event.kind = EventKind::contact_begin;
  event.feature_a = Feature::rim;
  event.feature_b = Feature::surface;
  event.b = 2;
  EXPECT_EQ(event_text(event, info), "LF_FOOT (rim) touches ground");
  Event limit;
  limit.a = 1;
  limit.b = -1;
  limit.kind = EventKind::limit_begin;
  EXPECT_EQ(event_text(limit, info), "LF_SHIN reaches its lower joint limit");
  limit.b = 1;
  limit.kind = EventKind::limit_end;
  EXPECT_EQ(event_text(limit, info), "LF_SHIN leaves its upper joint limit");
  limit.a = 2;
  EXPECT_THROW(event_text(limit, info), std::out_of_range) << "of a body that the campaign does not have";
}

// Claim: contacts in words have their parts, features and modes, each from its own bits.
TEST(Words, OfEveryContact) {
  const CampaignInfo info = synthetic::info();
  const std::uint32_t parts = 0u << 20 | 1u << 8;
  EXPECT_EQ(word_text(parts, Detail::parts, info), "LF_FOOT-curb");
  EXPECT_EQ(word_text(parts | static_cast<std::uint32_t>(Feature::edge) << 2, Detail::features, info),
            "LF_FOOT-curb.edge");
  EXPECT_EQ(word_text(parts | static_cast<std::uint32_t>(Feature::cap) << 5, Detail::features, info),
            "LF_FOOT.cap-curb");
  const char* const modes[] = {" stick", " slip", " roll"};
  for (std::uint32_t mode = 0; mode < 3; ++mode) {
    EXPECT_EQ(word_text((1u << 20 | 2u << 8) + mode, Detail::modes, info), std::string("curb-ground") + modes[mode]);
  }
  EXPECT_EQ(part_a(7u << 20 | 9u << 8 | 0xff), 7);
  EXPECT_EQ(part_b(7u << 20 | 9u << 8 | 0xff), 9);
  EXPECT_EQ(part_b(0xfffu << 20 | 0xfffu << 8), 0xfff);
  EXPECT_EQ(parts_only(7u << 20 | 9u << 8 | 0xff), 7u << 20 | 9u << 8);
}

// Claim: the k-th contact has the ending that English gives k, also past a hundred; a node below another says where.
TEST(Words, OfNodesAndBranches) {
  const CampaignInfo info = synthetic::info();
  const EventWords words(info, Detail::parts);
  EventNode node;
  const std::pair<std::size_t, const char*> ordinals[] = {
      {1, "1st"},   {2, "2nd"},   {3, "3rd"},     {4, "4th"},     {11, "11th"},   {12, "12th"},  {13, "13th"},
      {21, "21st"}, {22, "22nd"}, {101, "101st"}, {111, "111th"}, {112, "112th"}, {123, "123rd"}};
  for (const auto& [k, text] : ordinals) {
    node.past.assign(k - 1, 0);
    EXPECT_EQ(words.node(node), "the " + std::string(text) + " contact of LF_FOOT");
  }
  node.past.clear();
  node.part = 1;
  node.with = 2;
  EXPECT_EQ(words.node(node), "the 1st contact of curb with ground");
  EventTree tree;
  EventBranch branch;
  branch.word = 1u << 8;
  EXPECT_EQ(words.branch(branch), "LF_FOOT-curb");
  node.branches = {branch};
  node.time = 1.93149;
  tree.nodes = {node, node};
  tree.nodes[1].parent = 0;
  tree.nodes[1].parent_branch = 0;
  EXPECT_EQ(words.place(tree, 0), "1.931 s: the 1st contact of curb with ground");
  EXPECT_EQ(words.place(tree, 1), "1.931 s: the 1st contact of curb with ground, where LF_FOOT-curb");
  branch.kind = EventBranch::Kind::nothing;
  EXPECT_EQ(words.branch(branch), "nothing more");
  branch.kind = EventBranch::Kind::others;
  EXPECT_EQ(words.branch(branch), "other contacts");
  branch.kind = EventBranch::Kind::cut;
  EXPECT_EQ(words.branch(branch), "(ended before)");
}

// Claim: a sequence is told whole if it has room, else its beginning and how many there are in all.
TEST(Words, OfSequences) {
  const CampaignInfo info = synthetic::info();
  const EventWords words(info, Detail::parts);
  const std::vector<std::uint32_t> three = {1u << 8, 2u << 8, 1u << 20 | 2u << 8};
  EXPECT_EQ(words.sequence({}), "(no contact)");
  EXPECT_EQ(words.sequence(three), "LF_FOOT-curb LF_FOOT-ground curb-ground");
  EXPECT_EQ(words.sequence(three, 3), words.sequence(three));
  EXPECT_EQ(words.sequence(three, 2), "LF_FOOT-curb LF_FOOT-ground … 3 in all");
}

// Claim: in a table of any texts (letters of several bytes, blanks, quotes, controls) each column begins or ends in the
// same place of every line, nothing is lost, and no line ends with a blank.
TEST(Words, TablesLineUp) {
  std::mt19937_64 random(141);
  const std::vector<std::string> texts = {"",    "a",    "naïve", "step/4 cm", "Ω",   "\"q\"",
                                          "a,b", "x\ty", "Füße",  "-0.25",     "\x1b"};
  for (int round = 0; round < 40; ++round) {
    const std::size_t columns = 1 + random() % 5, left = random() % (columns + 1);
    std::vector<std::vector<std::string>> rows(1 + random() % 6);
    for (auto& row : rows) {
      for (std::size_t k = 0; k < columns; ++k) row.push_back(texts[random() % texts.size()]);
    }
    const std::vector<std::string> lines = lines_of(text_table(rows, left));
    ASSERT_EQ(lines.size(), rows.size());
    std::vector<std::size_t> width(columns);
    for (const auto& row : rows) {
      for (std::size_t k = 0; k < columns; ++k) width[k] = std::max(width[k], width_of(printable(row[k])));
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      std::string wanted;
      for (std::size_t k = 0; k < columns; ++k) {
        const std::string cell = printable(rows[i][k]);
        const std::string blanks(width[k] - width_of(cell), ' ');
        wanted += (k == 0 ? "" : "  ") + (k < left ? cell + blanks : blanks + cell);
      }
      while (wanted.ends_with(' ')) wanted.pop_back();
      EXPECT_EQ(lines[i], wanted);
    }
  }
}

// Claim: JSON has null for what is not finite, and keeps every digit of what is.
TEST(Words, NumbersOfJson) {
  EXPECT_TRUE(json_of(std::nan("")).is_null());
  EXPECT_TRUE(json_of(kInfinity).is_null());
  EXPECT_TRUE(json_of(-kInfinity).is_null());
  EXPECT_EQ(nlohmann::json::parse(json_of(0.1 + 0.2).dump()).get<double>(), 0.1 + 0.2);
  EXPECT_EQ(json_of(Interval{0.25, kInfinity}).dump(), "[0.25,null]");
  EXPECT_EQ(json_list(std::vector<int>{1, 2}, [](int x) { return x * x; }).dump(), "[1,4]");
  EXPECT_EQ(json_list(std::vector<int>{}, [](int x) { return x; }).dump(), "[]");
}

// Claim: culprits are counted by requirement and part, the parts with the most traces first, requirements in their
// order and the objective last; successes and invalid traces are to blame for nothing.
TEST(Words, CulpritsAreCounted) {
  const CampaignInfo info = synthetic::info();
  Culprits culprits;
  const auto add = [&](Outcome outcome, int violated, int leaf, int part, int times) {
    TraceOutcome trace{};
    trace.outcome = outcome;
    trace.violated = violated;
    trace.culprit = {leaf, part};
    for (int i = 0; i < times; ++i) culprits.add(trace);
  };
  add(Outcome::known_failure, 1, -1, 1, 2);  // LF_FOOT and curb
  add(Outcome::known_failure, 1, -1, 5, 7);  // curb and ground
  add(Outcome::known_failure, 0, -1, kNoPart, 3);
  add(Outcome::unknown_failure, -1, 1, 2, 4);  // place of the feet: LF_FOOT
  add(Outcome::unknown_failure, -1, 0, kNoPart, 5);
  add(Outcome::success, -1, 1, 2, 9);
  add(Outcome::invalid, 1, -1, 1, 9);
  const std::vector<Culprits::Count> got = culprits.counts(info);
  ASSERT_THAT(got, SizeIs(4));
  const auto is = [&](std::size_t i, const char* what, const char* culprit, std::uint64_t traces) {
    EXPECT_EQ(got[i].what, what) << i;
    EXPECT_EQ(got[i].culprit, culprit) << i;
    EXPECT_EQ(got[i].traces, traces) << i;
  };
  is(0, "clears-curb", "curb and ground", 7);
  is(1, "clears-curb", "LF_FOOT and curb", 2);
  is(2, "objective", "height of BODY0", 5);
  is(3, "objective", "place of the feet: LF_FOOT", 4);
  EXPECT_THAT(Culprits{}.counts(info), IsEmpty());
}

// Claim: attitudes are read as the angles of R = Rz(yaw) Ry(pitch) Rx(roll), wherever their four columns stand; other
// columns stay as they are; metres are told of the places of floating bodies alone.
TEST(Words, FreedomsReadAngles) {
  const Freedoms freedoms({"hip", "base.qw", "base.qx", "base.qy", "base.qz", "base.x", "base.y", "base.z", "arm.x"});
  EXPECT_THAT(freedoms.names(),
              ElementsAre("hip", "base.roll", "base.pitch", "base.yaw", "base.x", "base.y", "base.z", "arm.x"));
  EXPECT_THAT(freedoms.units(), ElementsAre("", "rad", "rad", "rad", "m", "m", "m", ""));
  std::mt19937_64 random(142);
  std::uniform_real_distribution<double> angle(-1.4, 1.4);
  for (int round = 0; round < 20; ++round) {
    const Vec3 rpy(angle(random), angle(random), 2 * angle(random));
    const Eigen::Quaterniond q = Eigen::AngleAxisd(rpy[2], Vec3::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vec3::UnitY()) *
                                 Eigen::AngleAxisd(rpy[0], Vec3::UnitX());
    const std::vector<double> state = {0.7, q.w(), q.x(), q.y(), q.z(), 1, 2, 3, 4};
    std::vector<double> out(freedoms.size());
    freedoms.read(state, out);
    EXPECT_EQ(out[0], 0.7);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(out[1 + k], rpy[static_cast<Eigen::Index>(k)], 1e-12);
    EXPECT_EQ(std::vector<double>(out.begin() + 4, out.end()), (std::vector<double>{1, 2, 3, 4}));
  }
  EXPECT_EQ(Freedoms({"base.qw", "base.x"}).size(), 2u) << "no quaternion: one column of it alone";
  EXPECT_EQ(Freedoms(std::vector<std::string>{}).size(), 0u);
}

// Claim: angles about half a turn are put side by side by whole turns; columns that are no angles stay.
TEST(Words, FreedomsUnwrapAngles) {
  const Freedoms freedoms({"b.qw", "b.qx", "b.qy", "b.qz", "joint"});
  const double pi = std::numbers::pi;
  std::vector<std::vector<double>> columns = {{0.1, 0.2, -0.1}, {0, 0, 0}, {pi - 0.1, -pi + 0.2, pi - 0.3}, {3, -3, 3}};
  const auto before = columns;
  freedoms.unwrap(columns);
  const auto [low, high] = std::minmax_element(columns[2].begin(), columns[2].end());
  EXPECT_NEAR(*high - *low, 0.5, 1e-12);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::remainder(columns[2][i] - before[2][i], 2 * pi), 0, 1e-12) << "whole turns";
    EXPECT_NEAR(columns[0][i], before[0][i], 1e-12);
  }
  EXPECT_EQ(columns[3], before[3]) << "a joint is no angle that goes round";
}

// Claim: values are those of the particles, by particle, whatever the order they were written in; what is not there has
// no row; and why there are none is told.
TEST(Words, ParticleValuesAreThoseWritten) {
  const synthetic::Folder folder;
  const CampaignInfo info = synthetic::info(30);
  {
    CampaignWriter writer(folder / "a.graze", info, false);
    for (const std::uint32_t first : {20u, 0u, 10u}) {
      synthetic::Block block = synthetic::block(info, 0, synthetic::range(first, first + 10));
      writer.append(0, std::move(block.traces), std::move(block.values));
    }
    writer.finish(false);
  }
  const ParticleValues got = read_particle_values(Archive(folder / "a.graze"), 25);
  ASSERT_EQ(got.particles.size(), 25u);
  ASSERT_EQ(got.table.columns.size(), info.parameters.size());
  for (std::uint32_t i = 0; i < 25; ++i) {
    EXPECT_EQ(got.row_of(i), i);
    for (std::size_t k = 0; k < info.parameters.size(); ++k) {
      EXPECT_EQ(got.table.columns[k].values[i], synthetic::values(info, i)[k]);
    }
  }
  EXPECT_EQ(got.row_of(25), 25u) << "no row";
  EXPECT_EQ(got.table.columns[1].labels, info.parameters[1].labels);
  EXPECT_EQ(got.table.columns[2].unit, "s");
  EXPECT_EQ(got.none(), "");
  EXPECT_EQ(ParticleValues{}.none(), "the scenario has no uncertain parameters");
  ParticleValues empty = got;
  for (auto& column : empty.table.columns) column.values.clear();
  EXPECT_EQ(empty.none(), "the archive does not keep the particles' values");
}

// Claim: values that only one scenario has stand with an empty other side; lists of scalars are one value, lists of
// maps are told apart by their places; name, description and sampling are no change; null is a value.
TEST(Words, ScenarioChangesOfAllShapes) {
  const std::string a =
      "name: a\nsampling:\n  seed: 1\nplace: [0, 0, 1]\nlist:\n  - k: 1\n  - k: 2\nonly_a: 5\nnone: ~\n";
  const std::string b =
      "name: b\ndescription: x\nsampling:\n  seed: 2\nplace: [0, 0, 2]\nlist:\n  - k: 1\n  - k: 3\nonly_b: 6\nnone: "
      "1\n";
  std::vector<std::string> got;
  for (const ScenarioChange& one : scenario_changes(a, b)) got.push_back(one.path + "|" + one.in_a + "|" + one.in_b);
  EXPECT_THAT(got, ElementsAre("place|[0, 0, 1]|[0, 0, 2]", "list.1.k|2|3", "only_a|5|", "none|~|1", "only_b||6"));
  EXPECT_THAT(scenario_changes(a, a), IsEmpty());
  EXPECT_THAT(scenario_changes("x: []\n", "x: [1]\n"), SizeIs(1)) << "an empty list is a value";
  EXPECT_THAT(scenario_changes("x: 1\n# note\n", "x: 1\n"), IsEmpty()) << "a comment is none";
}

// Claim: ticks are whole multiples of 1, 2 or 5 times a power of ten, evenly spaced, all those within the range, and
// about as many as were asked for (half to two and a half times).
TEST(Words, TicksAreRound) {
  std::mt19937_64 random(143);
  for (int round = 0; round < 200; ++round) {
    const double scale = std::pow(10.0, static_cast<double>(random() % 13) - 6);
    const double low = scale * (static_cast<double>(random() % 2000) - 1000) / 100;
    const double high = low + scale * static_cast<double>(1 + random() % 1000) / 100;
    const double count = static_cast<double>(3 + random() % 6);
    const auto ticks = plot_ticks(low, high, count);
    ASSERT_GE(ticks.size(), 1u);
    if (ticks.size() < 2) continue;
    const double step = ticks[1].first - ticks[0].first;
    const double mantissa = step / std::pow(10.0, std::floor(std::log10(step) + 1e-9));
    EXPECT_TRUE(std::abs(mantissa - 1) < 1e-6 || std::abs(mantissa - 2) < 1e-6 || std::abs(mantissa - 5) < 1e-6)
        << step;
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      EXPECT_NEAR(ticks[i].first, ticks[0].first + static_cast<double>(i) * step, 1e-9 * step + 1e-12 * std::abs(low));
      EXPECT_NEAR(std::remainder(ticks[i].first, step), 0, 1e-6 * step);
      std::string plain = ticks[i].second;
      for (auto at = plain.find("−"); at != std::string::npos; at = plain.find("−")) {
        plain.replace(at, std::string_view("−").size(), "-");
      }
      EXPECT_NEAR(std::stod(plain), ticks[i].first, 1e-6 * step);
      if (i > 0) {
        EXPECT_NE(ticks[i].second, ticks[i - 1].second);
      }
    }
    EXPECT_LT(ticks.front().first - step, low + 1e-9 * step);
    EXPECT_GT(ticks.back().first + step, high - 1e-9 * step);
    EXPECT_LE(static_cast<double>(ticks.size()), count + 1.1);
    EXPECT_GE(static_cast<double>(ticks.size()), count / 2.5 - 1);
  }
}

// Claim: lines of a paragraph hold all of its words in order, none is longer than the room, and a word is moved to the
// next line only if it did not fit.
TEST(Words, ParagraphsAreBroken) {
  const std::string text = "Where ends differ between branches the earliest is taken that tells at least half as much";
  for (const double room : {90.0, 150.0, 300.0, 2000.0}) {
    const std::vector<std::string> lines = plot_lines(text, 11, room);
    std::string joined;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      EXPECT_LE(plot_width(lines[i], 11), room);
      joined += (i == 0 ? "" : " ") + lines[i];
      if (i + 1 < lines.size()) {
        const std::string next = lines[i + 1].substr(0, lines[i + 1].find(' '));
        EXPECT_GT(plot_width(lines[i] + " " + next, 11), room);
      }
    }
    EXPECT_EQ(joined, text);
  }
  EXPECT_THAT(plot_lines("", 11, 100), IsEmpty());
  EXPECT_THAT(plot_lines("a  b", 11, 1000), ElementsAre("a  b"));
}

// Claim: widths add up and scale with the letters' size; a title has its unit unless that is 1; numbers of pictures are
// short and have a minus, no hyphen; quotes cannot end a text of gnuplot's.
TEST(Words, OfPictures) {
  EXPECT_NEAR(plot_width("abc", 24), 2 * plot_width("abc", 12), 1e-12);
  EXPECT_NEAR(plot_width("äb", 10), plot_width("ä", 10) + plot_width("b", 10), 1e-12);
  EXPECT_GT(plot_width("WWW", 10), plot_width("iii", 10));
  EXPECT_EQ(plot_titled("friction", "1"), "friction");
  EXPECT_EQ(plot_titled("friction", ""), "friction");
  EXPECT_EQ(plot_titled("length", "m"), "length [m]");
  EXPECT_EQ(plot_number(std::nan("")), "–");
  EXPECT_EQ(plot_number(kInfinity), "–");
  EXPECT_EQ(plot_number(-1234567), "−1.235e6");
  EXPECT_EQ(plot_number(0.30000000000000004), "0.3");
  EXPECT_EQ(plot_quoted("it's"), "'it’s'");
  EXPECT_EQ(plot_quoted(""), "''");
}

}  // namespace
}  // namespace graze
