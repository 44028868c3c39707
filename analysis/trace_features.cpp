#include "analysis/trace_features.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

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

bool ends_with_quaternion(const std::string& name) { return name.ends_with(".qw"); }

class Columns {
 public:
  Columns(const CampaignInfo& info, const std::map<std::uint32_t, Raw>& traces) : info_(info), traces_(traces) {}

  std::vector<TraceFeature> take() {
    add_positions();
    add_margins();
    add_contacts();
    return std::move(out_);
  }

 private:
  void add(TraceFeature::Kind kind, std::string name, std::string unit) {
    TraceFeature feature{kind, std::move(name), std::move(unit)};
    out_.push_back(std::move(feature));
  }

  void add_positions() {
    for (std::size_t i = 0; i < info_.q_names.size(); ++i) {
      const std::string& name = info_.q_names[i];
      if (ends_with_quaternion(name)) {
        const std::string body = name.substr(0, name.size() - 2);
        for (const char* angle : {"roll", "pitch", "yaw"}) add(TraceFeature::Kind::angle, body + angle, "rad");
        i += 3;
      } else {
        const bool place = name.ends_with(".x") || name.ends_with(".y") || name.ends_with(".z");
        add(place ? TraceFeature::Kind::position : TraceFeature::Kind::joint, name, place ? "m" : "");
      }
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
  const std::map<std::uint32_t, Raw>& traces_;
  std::vector<TraceFeature> out_;
};

void append_row(const Raw& raw, const CampaignInfo& info, const std::vector<TraceFeature>& columns,
                std::vector<double>& out) {
  for (std::size_t i = 0; i < info.q_names.size(); ++i) {
    if (ends_with_quaternion(info.q_names[i])) {
      const std::vector<double> angles = roll_pitch_yaw(raw.q[i], raw.q[i + 1], raw.q[i + 2], raw.q[i + 3]);
      out.insert(out.end(), angles.begin(), angles.end());
      i += 3;
    } else {
      out.push_back(raw.q[i]);
    }
  }
  for (const TraceFeature& column : columns) {
    if (column.kind == TraceFeature::Kind::margin) out.push_back(raw.margins[column.requirement]);
    if (column.kind != TraceFeature::Kind::contact) continue;
    const auto found = raw.impulses.find({column.a, column.b});
    out.push_back(found == raw.impulses.end() ? 0.0 : found->second);
  }
}

}  // namespace

std::vector<double> roll_pitch_yaw(double w, double x, double y, double z) {
  return {std::atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
          std::asin(std::clamp(2 * (w * y - z * x), -1.0, 1.0)),
          std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))};
}

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
  out.columns = Columns(archive.info(), successes).take();
  for (const auto& [particle, raw] : successes) {
    out.particle.push_back(particle);
    out.success.push_back(raw.success);
    append_row(raw, archive.info(), out.columns, out.values);
  }
  return out;
}

}  // namespace graze
