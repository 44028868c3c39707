#include "archive/schema/outcome_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "archive/schema/kept.h"
#include "archive/schema/part_rows.h"

namespace graze {
namespace {

constexpr std::uint64_t kPiece = std::uint64_t{1} << 16;  // rows

/// Calls act(part, its rows, first, count) for all pieces of a policy's tables.
template <class Act>
void for_each_piece(Parts& parts, const std::string& policy, const Act& act) {
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const OpenPart& file = parts.open(part);
    const std::uint64_t rows = file.traces(policy);
    for (std::uint64_t first = 0; first < rows; first += kPiece) {
      act(file, rows, first, std::min(kPiece, rows - first));
    }
  }
}

/// `margins`: of all requirements and measures.
void judge_measures(std::span<const double> margins, double end_time, const CampaignInfo& info, TraceOutcome& out) {
  const std::size_t deciding = info.deciding(), measures = std::min(margins.size() - deciding, kMostMeasures);
  for (std::size_t k = 0; k < measures; ++k) {
    const std::size_t i = deciding + k;
    const Kept kept = kept_by(info.requirements[i], margins[i], out.outcome, end_time, info);
    out.kept |= std::uint64_t{kept == Kept::yes} << k;
    out.undecided |= std::uint64_t{kept == Kept::undecided} << k;
  }
}

/// Particles that stand in two parts must have gone the same way in both.
void check_again(Parts& parts, const std::string& policy, const std::vector<std::uint32_t>& twice) {
  struct First {
    bool found = false;
    std::uint64_t digest = 0;
    std::string file;
  };
  std::map<std::uint32_t, First> firsts;
  for (const std::uint32_t particle : twice) firsts[particle];
  const std::string group = schema::traces_group(policy);
  for_each_piece(parts, policy,
                 [&](const OpenPart& file, std::uint64_t rows, std::uint64_t first, std::uint64_t count) {
                   const auto particle = file.slice<std::uint32_t>(group, schema::particle(), rows, first, count);
                   const auto digest = file.slice<std::uint64_t>(group, schema::digest(), rows, first, count);
                   for (std::size_t i = 0; i < count; ++i) {
                     const auto at = firsts.find(particle[i]);
                     if (at == firsts.end()) continue;
                     First& one = at->second;
                     if (!one.found) one = {true, digest[i], file.path().string()};
                     if (one.digest != digest[i]) fail_two_ways(file, particle[i], policy, one.file);
                   }
                 });
}

}  // namespace

void scan_outcomes(Parts& parts, const std::string& policy, const CampaignInfo& info,
                   const std::function<void(std::span<const TraceOutcome>)>& take) {
  const std::size_t requirements = info.requirements.size(), deciding = info.deciding();
  std::vector<bool> seen;
  std::vector<std::uint32_t> twice;
  std::vector<TraceOutcome> out;
  const std::string group = schema::traces_group(policy);
  for_each_piece(
      parts, policy, [&](const OpenPart& file, std::uint64_t rows, std::uint64_t first, std::uint64_t count) {
        const auto particle = file.slice<std::uint32_t>(group, schema::particle(), rows, first, count);
        const auto outcome = file.slice<std::uint8_t>(group, schema::outcome(), rows, first, count);
        const auto violated = file.slice<std::int32_t>(group, schema::violated(), rows, first, count);
        const auto margin = file.slice<double>(group, schema::objective_margin(), rows, first, count);
        const auto end_time = file.slice<double>(group, schema::end_time(), rows, first, count);
        std::vector<double> margins;  // [row][requirement]
        if (deciding < requirements) {
          margins = file.slice<double>(group, schema::margins(widths_of(info)), rows, first, count);
        }
        const std::vector<Culprit> culprits = read_culprits(file, policy, {rows, first, count}, violated, info);
        out.clear();
        for (std::size_t i = 0; i < count; ++i) {
          const std::uint32_t id = particle[i];
          if (id >= parts.particles_that_count()) continue;
          const auto result = static_cast<Outcome>(outcome[i]);
          if (!possible_outcome(result, violated[i], deciding)) {
            file.fail(fmt::format("policy '{}', particle {}: outcome {} with violated requirement {} is not possible",
                                  policy, id, static_cast<int>(outcome[i]), violated[i]));
          }
          if (id >= seen.size()) seen.resize(std::max<std::size_t>(std::size_t{id} + 1, 2 * seen.size()));
          if (seen[id]) twice.push_back(id);
          if (!seen[id]) {
            out.push_back({id, result, violated[i], margin[i], cut_short(result, end_time[i], info)});
            out.back().culprit = culprits[i];
            if (!margins.empty())
              judge_measures({&margins[i * requirements], requirements}, end_time[i], info, out.back());
          }
          seen[id] = true;
        }
        take(out);
      });
  if (!twice.empty()) check_again(parts, policy, twice);
}

}  // namespace graze
