#include "analysis/trace_features.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "analysis/freedoms.h"

namespace graze {
namespace {

/// What is kept of a trace until it is known which features there are.
struct Raw {
  bool success;
  std::vector<double> q, margins;
  std::map<std::pair<int, int>, double> impulses;
};

Raw raw_of(const TraceRows& rows, std::size_t i) {
  Raw out;
  out.success = rows.outcome(i) == Outcome::success;
  out.q.assign(rows.final_q(i).begin(), rows.final_q(i).end());
  out.margins.assign(rows.margins(i).begin(), rows.margins(i).end());
  for (const ContactPhase& phase : rows.phases(i)) {
    double& largest = out.impulses[{phase.a, phase.b}];
    largest = std::max(largest, phase.impulse);
  }
  return out;
}

class Columns {
 public:
  Columns(const CampaignInfo& info, const Freedoms& freedoms, const std::map<std::uint32_t, Raw>& traces)
      : info_(info), freedoms_(freedoms), traces_(traces) {}

  std::vector<TraceFeature> take() {
    add_freedoms();
    add_margins();
    add_contacts();
    return std::move(out_);
  }

 private:
  void add(TraceFeature::Kind kind, std::string name, std::string unit) {
    TraceFeature feature{kind, std::move(name), std::move(unit)};
    out_.push_back(std::move(feature));
  }

  void add_freedoms() {
    for (std::size_t i = 0; i < freedoms_.size(); ++i) {
      const std::string& unit = freedoms_.units()[i];
      add(unit == "m"     ? TraceFeature::Kind::position
          : unit == "rad" ? TraceFeature::Kind::angle
                          : TraceFeature::Kind::joint,
          freedoms_.names()[i], unit);
    }
  }

  void add_margins() {
    for (std::size_t r = 0; r < info_.requirements.size(); ++r) {
      const bool all = std::all_of(traces_.begin(), traces_.end(),
                                   [&](const auto& trace) { return std::isfinite(trace.second.margins[r]); });
      if (!all) continue;
      add(TraceFeature::Kind::margin, "margin of " + info_.requirements[r].name, info_.requirements[r].unit);
      out_.back().requirement = r;
    }
  }

  void add_contacts() {
    std::map<std::pair<int, int>, int> pairs;
    for (const auto& [particle, raw] : traces_) {
      for (const auto& [pair, impulse] : raw.impulses) ++pairs[pair];
    }
    for (const auto& [pair, count] : pairs) {
      const auto name = [&](int part) { return info_.colliders[static_cast<std::size_t>(part)]; };
      add(TraceFeature::Kind::contact, "impulse " + name(pair.first) + "-" + name(pair.second), "N s");
      out_.back().a = pair.first;
      out_.back().b = pair.second;
    }
  }

  const CampaignInfo& info_;
  const Freedoms& freedoms_;
  const std::map<std::uint32_t, Raw>& traces_;
  std::vector<TraceFeature> out_;
};

void append_row(const Raw& raw, const Freedoms& freedoms, const std::vector<TraceFeature>& columns,
                std::vector<double>& out) {
  out.resize(out.size() + freedoms.size());
  freedoms.read(raw.q, std::span(out).last(freedoms.size()));
  for (const TraceFeature& column : columns) {
    if (column.kind == TraceFeature::Kind::margin) out.push_back(raw.margins[column.requirement]);
    if (column.kind != TraceFeature::Kind::contact) continue;
    const auto found = raw.impulses.find({column.a, column.b});
    out.push_back(found == raw.impulses.end() ? 0.0 : found->second);
  }
}

/// A heading of 179 degrees is no other kind of end than one of -179.
void unwrap_angles(const Freedoms& freedoms, TraceFeatures& out) {
  std::vector<std::vector<double>> columns(freedoms.size());
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t row = 0; row < out.rows(); ++row) columns[c].push_back(out(row, c));
  }
  freedoms.unwrap(columns);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    for (std::size_t row = 0; row < out.rows(); ++row) out.values[row * out.columns.size() + c] = columns[c][row];
  }
}

}  // namespace

TraceFeatures trace_features(const Archive& archive, const std::string& policy, std::size_t most) {
  TraceFeatures out;
  std::map<std::uint32_t, Raw> successes, failures;
  archive.scan(
      policy, kMargins | kFinalState | kContactPhases,
      [&](const TraceRows& rows) {
        for (std::size_t i = 0; i < rows.size(); ++i) {
          const bool success = rows.outcome(i) == Outcome::success;
          ++(success ? out.successes : out.failures);
          std::map<std::uint32_t, Raw>& of = success ? successes : failures;
          if (of.size() >= most && rows.particle(i) > of.rbegin()->first) continue;
          of.emplace(rows.particle(i), raw_of(rows, i));
          if (of.size() > most) of.erase(std::prev(of.end()));
        }
      },
      [](std::uint32_t, Outcome outcome) {
        return outcome == Outcome::success || outcome == Outcome::unknown_failure;
      });
  successes.merge(failures);
  const Freedoms freedoms(archive.info().q_names);
  out.columns = Columns(archive.info(), freedoms, successes).take();
  for (const auto& [particle, raw] : successes) {
    out.particle.push_back(particle);
    out.success.push_back(raw.success);
    append_row(raw, freedoms, out.columns, out.values);
  }
  unwrap_angles(freedoms, out);
  return out;
}

}  // namespace graze
