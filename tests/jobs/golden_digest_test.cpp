// The results of the shipped scenarios are the bits that golden_digests.txt has: whoever moves one must say so, by the
// rule of simulation/results_epoch.h: by raising the epoch of results if it was released, else by renewing the table.
// Every compiler's build runs this, so that the compilers agree, too.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "sampling/stream.h"
#include "simulation/build_facts.h"
#include "simulation/results_epoch.h"
#include "tests/jobs/program.h"
#include "tests/jobs/traces.h"
#include "tests/sanitized.h"
#include "tests/trace_bits.h"

namespace graze {
namespace {

constexpr std::uint64_t kSeed = 11, kParticles = 8;

constexpr const char* kTable = "tests/jobs/golden_digests.txt";
constexpr const char* kCommand = "GRAZE_UPDATE_GOLDEN=1 build/release/test_jobs --gtest_filter='GoldenDigests.*'";

/// What Bullet's bits depend on beside this program: its library, and the C library that it computes sines by.
std::string bullet_and_c_library() {
  const BuildFacts facts = build_facts();
  return fmt::format("bullet {}, {}", facts.bullet, facts.c_library);
}

/// The table: what is computed by ("epoch", "libraries" and names of cases), and what it comes to.
class Table {
 public:
  Table() {
    std::ifstream file(path_);
    for (std::string line; std::getline(file, line);) {
      const std::size_t colon = line.find(": ");
      if (!line.starts_with("#") && colon != std::string::npos) rows_[line.substr(0, colon)] = line.substr(colon + 2);
    }
  }

  std::string at(const std::string& name) const { return rows_.contains(name) ? rows_.at(name) : "none"; }

  void set(const std::string& name, const std::string& value) {
    rows_[name] = value;
    std::ofstream file(path_);
    file << "# Digests of results (golden_digest_test.cpp, which writes this file on request).\n";
    for (const auto& [key, text] : rows_) file << key << ": " << text << "\n";
  }

 private:
  std::filesystem::path path_ = std::filesystem::path(GRAZE_SOURCE_DIR) / kTable;
  std::map<std::string, std::string> rows_;
};

/// Of everything that is drawn for the particles and kept of their traces, under every policy.
std::string digest_of(const Scenario& scenario) {
  std::string bits;
  const Sampler sampler(scenario.space, scenario.design, kSeed, kParticles);
  for (std::uint32_t i = 0; i < kParticles; ++i) testing::add_bits(sampler.draw(i), bits);
  for (const auto& [key, trace] : testing::simulate(scenario, kParticles, kSeed, 1)) {
    bits += fmt::format("{} {} ", key.first, key.second) + testing::bits_of(trace);
  }
  return fmt::format("{:#018x}", name_hash(bits));
}

/// Those that are shipped, and one with the functions that these leave out.
std::vector<std::filesystem::path> scenarios() {
  std::vector<std::filesystem::path> out;
  for (const auto& entry : std::filesystem::directory_iterator(testing::data("scenarios"))) {
    if (entry.path().extension() == ".yaml") out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  EXPECT_GE(out.size(), 8u);
  out.push_back(std::filesystem::path(GRAZE_SOURCE_DIR) / "tests/jobs/golden_kinds.yaml");
  return out;
}

constexpr bool kMayMove = kResultsEpoch > kReleasedEpoch;

/// Compares with the table; or writes into it, if it was asked to, and if the epoch of a row that moved may move or was
/// raised.
void expect_golden(const std::string& name, const Scenario& scenario) {
  Table table;
  const std::string golden = table.at(name), digest = digest_of(scenario);
  const std::string epoch = std::to_string(kResultsEpoch);
  if (std::getenv("GRAZE_UPDATE_GOLDEN") != nullptr) {
    if (kMayMove || golden == "none" || golden.ends_with(digest) || !golden.starts_with("epoch " + epoch + " ")) {
      return table.set(name, "epoch " + epoch + " " + digest);
    }
    FAIL() << name << ": the digest moved from " << golden << " to " << digest << ", but kResultsEpoch is " << epoch
           << " still, which was released; raise it first (simulation/results_epoch.h)";
  }
  const std::string got = "epoch " + epoch + " " + digest;
  EXPECT_EQ(got, golden) << "RESULTS MOVED: scenario " << name << " gives " << digest << " where " << kTable << " has "
                         << golden << ". If it was on purpose, "
                         << (kMayMove ? "" : "raise kResultsEpoch (simulation/results_epoch.h) and ") << "update "
                         << kTable << " by\n  " << kCommand;
}

Scenario load(const std::filesystem::path& path, std::vector<Override> overrides) {
  ScenarioOptions options;
  options.overrides = {{"record", "{telemetry: none, events: true}"}};
  options.overrides.insert(options.overrides.end(), overrides.begin(), overrides.end());
  return load_scenario(path.string(), options);
}

// Run under other_c_library/math.cpp, which says so by this variable, the tests below show that no bit of a trace comes
// from the C library. They would show nothing if it were not there.
TEST(GoldenDigests, OfAnotherCLibraryWhereItIsAskedFor) {
  if (std::getenv("GRAZE_OTHER_C_LIBRARY") == nullptr) GTEST_SKIP() << "this is the C library's own";
  volatile double one = 1.0;
  EXPECT_LT(std::sin(one), 0.8414709848078965);
  EXPECT_LT(std::exp(one), 2.718281828459045);
  EXPECT_LT(std::hypot(3 * one, 4 * one), 5.0);
}

// Sanitized builds run this one, which is short enough for them.
TEST(GoldenDigests, FirstTenthOfASecond) {
  for (const auto& path : scenarios()) {
    expect_golden(path.stem().string() + ", 0.1 s", load(path, {{"time.end", "0.1 s"}}));
  }
}

// Whole, but for what would take a minute: of that the first seconds, in which all of it has begun.
TEST(GoldenDigests, WholeRuns) {
  if (GRAZE_SANITIZED) GTEST_SKIP() << "too long for a sanitizer";
  constexpr double kLongest = 20;  // s
  for (const auto& path : scenarios()) {
    const Scenario whole = load(path, {});
    if (whole.timing.end <= kLongest) {
      expect_golden(path.stem().string(), whole);
    } else {
      expect_golden(path.stem().string() + ", 2 s", load(path, {{"time.end", "2 s"}}));
    }
  }
}

// Bullet and the C library have bits of their own: those of other versions are compared with nothing.
TEST(GoldenDigests, OfBullet) {
  Table table;
  const std::string libraries = bullet_and_c_library();
  if (std::getenv("GRAZE_UPDATE_GOLDEN") != nullptr) table.set("bullet's libraries", libraries);
  if (table.at("bullet's libraries") != libraries) {
    GTEST_SKIP() << "the table is of " << table.at("bullet's libraries") << ", this is " << libraries;
  }
  for (const auto& path : scenarios()) {
    if (testing::is_for_lanes_alone(load(path, {}))) continue;
    expect_golden(path.stem().string() + ", bullet, 0.1 s",
                  load(path, {{"physics", "bullet"},
                              {"uncertain.contact.model", "{choice: [sequential_impulse, dantzig]}"},
                              {"time.end", "0.1 s"}}));
  }
}

}  // namespace
}  // namespace graze
