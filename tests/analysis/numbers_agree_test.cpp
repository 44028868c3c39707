// Tables, JSON and CSV of one thing agree number by number, also where names have commas, quotes, blanks and letters
// that are not ASCII.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "analysis/failure_table.h"
#include "analysis/proportions.h"
#include "analysis/score.h"
#include "analysis/sources.h"
#include "analysis/sweep.h"
#include "tests/analysis/planted_archive.h"

namespace graze {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;
using PlainJson = nlohmann::json;

/// Rows of a CSV file by RFC 4180, without the program's own writer or reader.
std::vector<std::vector<std::string>> rows_of_csv(const std::string& text) {
  std::vector<std::vector<std::string>> rows(1, std::vector<std::string>(1));
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '"' && i + 1 < text.size() && text[i + 1] == '"') {
        rows.back().back() += text[++i];
      } else if (c == '"') {
        quoted = false;
      } else {
        rows.back().back() += c;
      }
    } else if (c == '"') {
      quoted = true;
    } else if (c == ',') {
      rows.back().emplace_back();
    } else if (c == '\n') {
      rows.emplace_back(1);
    } else {
      rows.back().back() += c;
    }
  }
  EXPECT_FALSE(quoted);
  EXPECT_EQ(rows.back(), std::vector<std::string>(1)) << "the last line has its end";
  rows.pop_back();
  return rows;
}

std::vector<std::string> table_lines(const std::string& text, const std::string& with) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (line.find(with) != std::string::npos) out.push_back(line);
  }
  return out;
}

/// Two axes, two policies with odd names, random outcomes, lifetimes of the valid traces.
Sweep odd_sweep(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Sweep out;
  out.scenario = "Füße, \"schnell\"";
  out.policies = {"step, 4 cm", "größer \"weich\""};
  out.axes = {{"contact.friction", "", true, {"0.25", "0.5", "0.75"}, {0.25, 0.5, 0.75}},
              {"gait.kind", "", false, {"trot, slow", "walk"}, {0, 1}}};
  for (std::size_t i = 0; i < 6; ++i) {
    SweepPoint point;
    point.at = {i % 3, i / 3};
    point.campaign = "00" + std::to_string(i) + ".graze";
    point.particles = 30;
    for (int policy = 0; policy < 2; ++policy) {
      std::vector<std::int8_t> traces;
      std::vector<Lifetime> lives;
      for (int k = 0; k < 30; ++k) {
        traces.push_back(static_cast<std::int8_t>(random() % 4));
        if (traces.back() == static_cast<int>(Outcome::invalid)) continue;
        lives.push_back({0.1 * static_cast<double>(1 + random() % 20), traces.back() == 1});
      }
      point.traces.push_back(traces);
      point.lifetimes.push_back(lives);
    }
    out.points.push_back(point);
  }
  return out;
}

// Claim: each line of a sweep's CSV has the numbers of the same entry of its JSON and of counting its traces, with
// names as they are; and each is a line of the table for people.
TEST(NumbersAgree, OfASweep) {
  const Sweep sweep = odd_sweep(161);
  const PlainJson json = PlainJson::parse(sweep_json(sweep));
  const auto csv = rows_of_csv(sweep_csv(sweep));
  const std::string text = format_sweep(sweep);
  ASSERT_EQ(csv.size(), 13u);
  ASSERT_EQ(json["rates"].size(), 12u);
  EXPECT_EQ(json["scenario"], sweep.scenario);
  EXPECT_EQ(json["policies"], PlainJson(sweep.policies));
  EXPECT_EQ(json["axes"][1]["texts"][0], "trot, slow");
  const auto column = [&](const char* name) {
    return static_cast<std::size_t>(std::find(csv[0].begin(), csv[0].end(), name) - csv[0].begin());
  };
  for (std::size_t i = 0; i < 12; ++i) {
    const PlainJson& one = json["rates"][i];
    const std::vector<std::string>& row = csv[i + 1];
    ASSERT_EQ(row.size(), csv[0].size());
    std::uint64_t counts[4] = {};
    for (const std::int8_t trace : sweep.points[i % 6].traces[i / 6]) ++counts[trace];
    const std::uint64_t n = counts[0] + counts[1] + counts[2];
    const std::pair<const char*, std::uint64_t> wanted[] = {{"n", n},
                                                            {"success", counts[0]},
                                                            {"known_failure", counts[1]},
                                                            {"unknown_failure", counts[2]},
                                                            {"invalid", counts[3]}};
    for (const auto& [key, count] : wanted) {
      EXPECT_EQ(one[key], count) << key;
      EXPECT_EQ(row[column(key)], std::to_string(count)) << key;
    }
    EXPECT_EQ(row[column("policy")], sweep.policies[i / 6]);
    EXPECT_EQ(one["policy"], sweep.policies[i / 6]);
    EXPECT_EQ(std::stod(row[column("rate")]), one["rate"].get<double>());
    EXPECT_EQ(one["rate"].get<double>(), static_cast<double>(counts[0]) / static_cast<double>(n));
    const Interval interval = clopper_pearson(counts[0], n);
    EXPECT_EQ(one["interval"], PlainJson({interval.low, interval.high}));
    EXPECT_EQ(std::stod(row[column("low")]), interval.low);
    EXPECT_EQ(std::stod(row[column("high")]), interval.high);
    EXPECT_EQ(row[0], sweep.axes[0].texts[i % 3]);
    EXPECT_EQ(row[1], sweep.axes[1].texts[i % 6 / 3]);
    EXPECT_EQ(one["values"]["gait.kind"], row[1]);
    EXPECT_EQ(one["numbers"][0].get<double>(), std::stod(row[0]));
    EXPECT_EQ(one["campaign"], row[column("campaign")]);
    char rate[16];
    std::snprintf(rate, sizeof rate, "%.4f", one["rate"].get<double>());
    const auto lines = table_lines(text, row[column("campaign")]);
    ASSERT_THAT(lines, SizeIs(2)) << "one for each policy";
    EXPECT_THAT(lines[i / 6], HasSubstr(rate));
    EXPECT_THAT(lines[i / 6], HasSubstr(sweep.policies[i / 6]));
  }
}

// Claim: changes are between neighbours along the first axis alone, on the particles that are valid at both, counted
// here again; none is from the end of one row to the beginning of the next; Holm's correction is over all eight.
TEST(NumbersAgree, OfASweepsChanges) {
  const Sweep sweep = odd_sweep(162);
  const PlainJson changes = PlainJson::parse(sweep_json(sweep))["changes"];
  ASSERT_EQ(changes.size(), 8u);
  double least = 1, corrected = 1;
  std::size_t at = 0;
  for (std::size_t policy = 0; policy < 2; ++policy) {
    for (const std::size_t to : {1u, 2u, 4u, 5u}) {
      const auto &a = sweep.points[to - 1].traces[policy], &b = sweep.points[to].traces[policy];
      std::uint64_t n = 0, mended = 0, broke = 0;
      for (std::size_t k = 0; k < 30; ++k) {
        if (a[k] == 3 || b[k] == 3) continue;
        ++n;
        mended += a[k] != 0 && b[k] == 0;
        broke += a[k] == 0 && b[k] != 0;
      }
      const PlainJson& one = changes[at++];
      EXPECT_EQ(one["policy"], sweep.policies[policy]);
      EXPECT_EQ(one["pairs"], n);
      EXPECT_EQ(one["mended"], mended);
      EXPECT_EQ(one["broke"], broke);
      EXPECT_NEAR(one["change"].get<double>(),
                  (static_cast<double>(mended) - static_cast<double>(broke)) / static_cast<double>(n), 1e-15);
      EXPECT_EQ(one["p_value"].get<double>(), mcnemar_exact(broke, mended));
      EXPECT_EQ(one["to"]["contact.friction"], sweep.axes[0].texts[to % 3]);
      EXPECT_EQ(one["to"]["gait.kind"], one["from"]["gait.kind"]);
      if (one["p_value"].get<double>() < least) {
        least = one["p_value"].get<double>(), corrected = one["p_corrected"].get<double>();
      }
    }
  }
  EXPECT_NEAR(corrected, std::min(1.0, 8 * least), 1e-12);
}

// Claim: a sweep of which a value has no valid trace has no rate there: null, an empty cell, "-"; and no point in its
// picture; with one trace it has one.
TEST(NumbersAgree, OfASweepWithoutTraces) {
  Sweep sweep = odd_sweep(163);
  sweep.points[0].traces[0].assign(30, static_cast<std::int8_t>(Outcome::invalid));
  sweep.points[1].traces[0].assign(30, kNoTrace);
  sweep.points[2].traces[0].assign(30, kNoTrace);
  sweep.points[2].traces[0][7] = 0;
  const PlainJson rates = PlainJson::parse(sweep_json(sweep))["rates"];
  const auto csv = rows_of_csv(sweep_csv(sweep));
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE(rates[i]["rate"].is_null());
    EXPECT_EQ(csv[i + 1][8], "");
    EXPECT_EQ(rates[i]["interval"], PlainJson({0.0, 1.0}));
  }
  EXPECT_EQ(rates[0]["invalid"], 30);
  EXPECT_EQ(rates[1]["invalid"], 0);
  EXPECT_EQ(rates[2]["rate"], 1.0);
  EXPECT_EQ(rates[2]["n"], 1);
  std::size_t most = 0, least = 99;
  for (const PlotPanel& panel : sweep_figure(sweep).panels) {
    for (const PlotSeries& series : panel.series) {
      most = std::max(most, series.x.size());
      least = std::min(least, series.x.size());
    }
  }
  EXPECT_EQ(most, 3u);
  EXPECT_EQ(least, 1u) << "the two values without traces are left out";
}

// Claim: a study of sources has the same numbers in its JSON as in the structure, in SI units, and in its table in the
// units that its head names; a fixed base has no columns of place and heading, and null.
TEST(NumbersAgree, OfSources) {
  std::vector<SourceSpread> rows(2);
  rows[0] = {"fabrication", "größer, schneller", 7, {50, 20, 10, 3}, {0.5, 0.75}, 60, 0.0123, 0.25, 0.0044, 20,
             {0.5, 1.25, 2}};
  rows[1].source = "lag";
  rows[1].policy = "hold";
  rows[1].interval = {0, 1};
  rows[1].place = rows[1].heading = rows[1].joints = std::nan("");
  rows[1].failure_time.fill(std::nan(""));
  const PlainJson json = PlainJson::parse(sources_json("Quer", 83, rows));
  EXPECT_EQ(json["particles"], 83);
  const PlainJson& one = json["sources"][0];
  EXPECT_EQ(one["n"], 80);
  EXPECT_EQ(one["success"], 50);
  EXPECT_EQ(one["known_failure"], 20);
  EXPECT_EQ(one["unknown_failure"], 10);
  EXPECT_EQ(one["invalid"], 3);
  EXPECT_EQ(one["place"], 0.0123);
  EXPECT_EQ(one["heading"], 0.25);
  EXPECT_EQ(one["joints"], 0.0044);
  EXPECT_EQ(one["end_time_quartiles"], PlainJson({0.5, 1.25, 2.0}));
  EXPECT_TRUE(json["sources"][1]["place"].is_null());
  EXPECT_TRUE(json["sources"][1]["end_time_quartiles"][1].is_null());
  const std::string text = format_sources("Quer", 83, rows);
  const std::string line = table_lines(text, "fabrication")[0];
  std::istringstream words(line.substr(line.find("schneller") + 9));
  std::vector<std::string> cells;
  for (std::string cell; words >> cell;) cells.push_back(cell);
  EXPECT_EQ(cells, (std::vector<std::string>{"7", "80", "50", "20", "10", "3", "0.6250", "0.5000", "..", "0.7500", "60",
                                             "12.3", "14.3", "4.4", "20", "0.5", "1.25", "2"}));
  rows[0].place = rows[0].heading = std::nan("");
  const std::string fixed = format_sources("Quer", 83, rows);
  EXPECT_THAT(text, HasSubstr("place mm"));
  EXPECT_EQ(table_lines(fixed, "place mm").size(), 0u);
  EXPECT_EQ(table_lines(fixed, "joints mrad").size(), 1u);
  EXPECT_THAT(table_lines(fixed, "fabrication")[0], HasSubstr("60          4.4"));
}

// Claim: the score of a planted campaign has the planted counts in its structure, its JSON and its table, whatever the
// policies are called; pairs are those of the planted particles.
TEST(NumbersAgree, OfAScore) {
  const synthetic::Folder folder;
  CampaignInfo info = synthetic::info(60);
  info.policies = {"step, \"4 cm\"", "größer"};
  const auto fate = [](int policy, std::uint32_t i) {
    return i % 10 == 9                                    ? Outcome::invalid
           : i % (3 + static_cast<unsigned>(policy)) == 0 ? Outcome::unknown_failure
                                                          : Outcome::success;
  };
  {
    CampaignWriter writer(folder / "a.graze", info, false);
    for (int policy = 0; policy < 2; ++policy) {
      std::vector<TraceRecord> records;
      std::vector<double> values;
      for (std::uint32_t i = 0; i < 60; ++i) {
        records.push_back(planted::plain_trace(info, policy, i, fate(policy, i)));
        const auto row = synthetic::values(info, i);
        values.insert(values.end(), row.begin(), row.end());
      }
      writer.append(policy, std::move(records), std::move(values));
    }
    writer.finish();
  }
  const Score got = score(Archive(folder / "a.graze"), "a.graze");
  const PlainJson json = PlainJson::parse(score_json(got));
  const std::string text = format_score(got);
  for (int policy = 0; policy < 2; ++policy) {
    std::map<Outcome, std::uint64_t> counts;
    for (std::uint32_t i = 0; i < 60; ++i) ++counts[fate(policy, i)];
    const PolicyScore& one = got.policies[static_cast<std::size_t>(policy)];
    EXPECT_EQ(one.success, counts[Outcome::success]);
    EXPECT_EQ(one.unknown, counts[Outcome::unknown_failure]);
    EXPECT_EQ(one.invalid, 6u);
    EXPECT_EQ(one.n, 54u);
    const PlainJson& in_json = json["policies"][static_cast<std::size_t>(policy)];
    EXPECT_EQ(in_json["policy"], info.policies[static_cast<std::size_t>(policy)]);
    EXPECT_EQ(in_json["success"], one.success);
    EXPECT_EQ(in_json["unknown_failure"], one.unknown);
    EXPECT_EQ(in_json["invalid"], one.invalid);
    EXPECT_NEAR(in_json["rate"].get<double>(), static_cast<double>(one.success) / 54, 1e-15);
    EXPECT_FALSE(table_lines(text, info.policies[static_cast<std::size_t>(policy)]).empty());
  }
  std::uint64_t only_a = 0, only_b = 0, both = 0;
  for (std::uint32_t i = 0; i < 60; ++i) {
    if (i % 10 == 9) continue;
    const bool a = fate(0, i) == Outcome::success, b = fate(1, i) == Outcome::success;
    both += a && b, only_a += a && !b, only_b += !a && b;
  }
  ASSERT_THAT(got.pairs, SizeIs(1));
  EXPECT_EQ(got.pairs[0].n, 54u);
  EXPECT_EQ(got.pairs[0].both, both);
  EXPECT_EQ(got.pairs[0].only_a, only_a);
  EXPECT_EQ(got.pairs[0].only_b, only_b);
}

// Claim: of no valid trace there is no rate, in no form, and nothing fails to be told; of one trace there is.
TEST(NumbersAgree, OfScoresOfNothingAndOfOne) {
  const synthetic::Folder folder;
  CampaignInfo info = synthetic::info(5);
  info.policies = {"only"};
  planted::write(folder / "none.graze", info,
                 [&](std::uint32_t i) { return planted::plain_trace(info, 0, i, Outcome::invalid); });
  const Score none = score(Archive(folder / "none.graze"));
  EXPECT_TRUE(std::isnan(none.policies[0].rate));
  EXPECT_EQ(none.policies[0].invalid, 5u);
  EXPECT_EQ(none.policies[0].interval.low, 0);
  EXPECT_EQ(none.policies[0].interval.high, 1);
  EXPECT_TRUE(PlainJson::parse(score_json(none))["policies"][0]["rate"].is_null());
  EXPECT_THAT(format_score(none), HasSubstr("only"));
  info.particles = 1;
  planted::write(folder / "one.graze", info, [&](std::uint32_t i) { return planted::plain_trace(info, 0, i); });
  const Score one = score(Archive(folder / "one.graze"));
  EXPECT_EQ(one.policies[0].rate, 1);
  EXPECT_NEAR(one.policies[0].interval.low, 0.025, 1e-12);
  EXPECT_TRUE(one.pairs.empty());
  EXPECT_TRUE(one.failures.empty());
}

}  // namespace
}  // namespace graze
