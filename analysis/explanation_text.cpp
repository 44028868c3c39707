// An explanation for people, on 80 columns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/explanation.h"
#include "analysis/number_words.h"
#include "analysis/text_table.h"
#include "archive/files/utf8.h"

namespace graze {
namespace {

constexpr std::size_t kWidth = 80, kMostMargins = 12, kMostFreedoms = 8;
using Rows = std::vector<std::vector<std::string>>;

/// `text` in lines that fit, the first indented by `first`, the others by `rest`; a longer word has a line of its own.
std::string paragraph(const std::string& text, std::size_t first, std::size_t rest) {
  std::string out, line(first, ' ');
  bool empty = true;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    const std::string word = text.substr(at, end - at);
    if (!empty && line.size() + 1 + word.size() > kWidth) {
      out += line + "\n";
      line = std::string(rest, ' ');
      empty = true;
    }
    line += (empty ? "" : " ") + word;
    empty = false;
    at = end + 1;
  }
  return out + line + "\n";
}

std::string indented(const std::string& text) {
  std::string out = "    ";
  for (const char c : text) out += c == '\n' ? std::string("\n    ") : std::string(1, c);
  out.resize(out.size() - 4);
  return out;
}

std::string number(double x) { return std::isnan(x) ? "-" : fmt::format("{:.3g}", x); }
std::string number_with_unit(double x, const std::string& unit) {
  return number(x) + (std::isnan(x) || unit.empty() || unit == "1" ? "" : " " + unit);
}
std::string share(double x) { return std::isnan(x) ? "-" : fmt::format("{:.3f}", x); }
std::string interval(const Interval& of) { return fmt::format("{:.3f} .. {:.3f}", of.low, of.high); }

const PolicyScore& score_of(const Explanation& all, std::size_t policy) { return all.score.policies[policy]; }

std::string head_of(const Explanation& all, std::size_t policy) {
  const PolicyScore& score = score_of(all, policy);
  const RateBounds& bounds = all.rates.policies[policy];
  std::string out = fmt::format("{}: {} of {} succeed, {} ({}", printable(score.policy), score.success, score.n,
                                share(score.rate), interval(score.interval));
  if (all.policies.size() > 1) out += fmt::format("; all policies at once {}", interval(bounds.simultaneous));
  out += ")";
  if (bounds.unknown > 0) {
    out += fmt::format("; if the {} none, {} ({})",
                       counted(bounds.unknown, "unknown failure were", "unknown failures were"), share(bounds.best),
                       interval(bounds.best_interval));
  }
  if (score.invalid > 0) out += fmt::format("; {} invalid", score.invalid);
  return paragraph(out, 0, 2);
}

std::string tree_text(const Causes& causes, const MarginSummary* margins, const ParticleTable& table) {
  const DecisionTree& tree = causes.tree;
  std::string out;
  const std::vector<TreeRule> rules = rules_of(tree);
  const std::string skill =
      tree.binary ? fmt::format(
                        "balanced accuracy {:.2f} ± {:.2f} on traces kept out, chance 0.50; the "
                        "majority alone is right in {:.2f}",
                        tree.skill, tree.standard_error, tree.majority)
                  : fmt::format("rank correlation {:.2f} ± {:.2f} on traces kept out", tree.skill, tree.standard_error);
  out += paragraph(fmt::format("tree ({}):", skill), 6, 8);
  for (const TreeRule& rule : rules) {
    const std::string mean = tree.binary ? fmt::format("{:.0f} %", 100 * rule.mean)
                                         : "mean " + (margins ? mean_text(rule.mean, *margins) : number(rule.mean));
    out += paragraph(fmt::format("{} of {}: {}", mean, rule.rows, rule_text(rule, table)), 8, 10);
  }
  return out;
}

/// Targets that nothing explains share a line.
std::string causes_text(const PolicyExplanation& policy, const ParticleTable& table) {
  std::string out, nothing;
  for (std::size_t i = 0; i < policy.causes.size(); ++i) {
    const Causes& causes = policy.causes[i];
    const MarginSummary* const margins = margins_of(causes, policy.margins);
    std::string count = causes.binary ? fmt::format(" ({} of {})", causes.ones, causes.rows) : "";
    if (margins) {  // what parameters do to it may be next to nothing, however sure it is
      count = fmt::format(" (nine in ten lie within {})", number_with_unit(spread_of(*margins), margins->unit));
    }
    if (!causes.explained() && !causes.effects.empty()) {
      nothing += (nothing.empty() ? "" : "; ") + causes.target + count;
      continue;
    }
    out += paragraph(fmt::format("{}{}: {}", causes.target, count, policy.verdicts[i]), 4, 6);
    if (causes.tree_tells) out += tree_text(causes, margins, table);
  }
  if (!nothing.empty()) out += paragraph("no parameter explains it: " + nothing, 4, 6);
  std::vector<std::string> notes;
  for (const Causes& causes : policy.causes) {
    for (const std::string& note : causes.notes) {
      // Shares are in the JSON and the tables alone.
      const bool told = note.starts_with("not tested") || note.starts_with("no shares") ||
                        std::find(notes.begin(), notes.end(), note) != notes.end();
      if (!told) notes.push_back(note);
    }
  }
  for (const std::string& note : notes) out += paragraph(note, 4, 6);
  return out.empty() ? "    not asked: all traces have ended alike\n" : out;
}

std::string modes_text(const PolicyExplanation& policy) {
  const Scatter& ended = policy.ended;
  std::string out = paragraph(fmt::format("{} of {} ran to the end: {}", ended.traces,
                                          counted(policy.n, "trace", "traces"), scatter_text(ended)),
                              4, 6);
  for (std::size_t k = 0; k < policy.modes.size(); ++k) {
    const ModeTraces& mode = policy.modes[k];
    std::string some;
    for (std::size_t i = 0; i < std::min<std::size_t>(mode.particles.size(), 8); ++i) {
      some += fmt::format("{}{}", i > 0 ? ", " : "", mode.particles[i]);
    }
    if (mode.particles.size() > 8) some += ", …";
    out += paragraph(
        fmt::format("mode {}: {} S, {} K, {} U; particles {}", k + 1, mode.success, mode.known, mode.unknown, some), 6,
        8);
  }
  if (policy.all.traces != ended.traces) {
    out += paragraph(fmt::format("with those that ended early, where they ended: {}", scatter_text(policy.all)), 4, 6);
  }
  if (ended.freedoms.empty()) return out;
  Rows rows = {{"degree of freedom", "mean", "median", "deviation", "IQR", "dip p", "modes"}};
  for (std::size_t k = 0; k < std::min(ended.freedoms.size(), kMostFreedoms); ++k) {
    const FreedomSpread& f = ended.freedoms[k];
    rows.push_back({f.name + (f.unit.empty() ? "" : ", " + f.unit), number(f.mean), number(f.median),
                    number(f.deviation), number(f.iqr), p_text(f.p_holm), std::to_string(f.modes.size())});
  }
  out += indented(text_table(rows, 1));
  const std::size_t left = ended.freedoms.size() + 1 - rows.size();
  if (left > 0) out += fmt::format("    … and {} more (--json has all)\n", left);
  return out;
}

std::string growth_text(const Growth& growth) {
  if (!growth.note.empty()) return paragraph(growth.note, 4, 6);
  Rows rows = {{"time, s"}};
  for (std::size_t k = 0; k < growth.names.size(); ++k) rows[0].push_back(growth.names[k]);
  for (const SpreadAt& at : growth.times) {
    rows.push_back({number(at.time)});
    for (const double deviation : at.deviations) rows.back().push_back(fmt::format("{:.2g}", deviation));
  }
  return paragraph(fmt::format("standard deviation over time, of {}", counted(growth.traces, "trace", "traces")), 4,
                   6) +
         indented(text_table(rows, 1));
}

std::string survival_text(const PolicyExplanation& policy) {
  Rows rows = {{"until", "failed", "left at the end", "95 % interval", "median, s"}};
  for (const Survival& s : policy.survival) {
    if (s.failed == 0 || s.what == "objective") continue;
    const SurvivalStep& last = s.steps.back();
    rows.push_back({s.what, std::to_string(s.failed), share(last.share), interval(last.interval), number(s.median)});
  }
  std::string out = rows.size() > 1 ? indented(text_table(rows, 1)) : "    no requirement was violated\n";
  const Survival& objective = policy.survival.back();
  if (objective.failed > 0) {
    out += fmt::format("    objective unmet at the end, nothing violated: {} of {}\n", objective.failed, policy.n);
  }
  return out;
}

std::string margins_text(const PolicyExplanation& policy) {
  Rows rows = {{"margin of", "median", "worst", "trace", "below 0", "95 % interval"}};
  for (std::size_t i = 0; i < std::min(policy.margins.size(), kMostMargins); ++i) {
    const MarginSummary& m = policy.margins[i];
    const double below = m.n > 0 ? static_cast<double>(m.below) / static_cast<double>(m.n) : std::nan("");
    const std::string particle = m.n > 0 ? std::to_string(m.worst_particle) : "-";
    rows.push_back({m.name, number(m.quantiles[3]), number_with_unit(m.worst, m.unit), particle, share(below),
                    interval(m.interval)});
  }
  return indented(text_table(rows, 1));
}

std::string sizes_text(const PolicyExplanation& policy) {
  std::vector<std::string> widths;
  for (std::size_t k = 0; k < policy.sizes.size(); ++k) {
    const std::uint64_t n = policy.sizes[k];  // 0: no traces, or more than anybody simulates
    if (n > 0) widths.push_back(fmt::format("± {} takes {}", kHalfWidths[k], n));
  }
  if (widths.empty()) return "";
  std::string out = fmt::format("were the rate what was seen: {} particles", fmt::join(widths, ", "));
  for (const DecisionSize& one : policy.decisions) {
    if (one.fixed <= policy.n && one.fixed > 0) continue;  // known already
    if (one.fixed == 0) continue;
    out += fmt::format("; 'p >= {}' is decided after {} (with --until {})", one.bound, one.fixed,
                       one.sequence > 0 ? std::to_string(one.sequence) : "many");
  }
  return paragraph(out, 4, 6);
}

std::string pairs_text(const Explanation& all) {
  if (all.pairs.empty()) return {};
  Rows rows = {{"a", "b", "rate b - a", "McNemar p", "survival p", "of pairs"}};
  std::vector<double> p_values;
  for (const CorrectedPair& rate : all.rates.pairs) p_values.push_back(rate.p_value);
  const std::vector<std::size_t> shown = pairs_to_show(p_values);
  for (const std::size_t i : shown) {
    const CorrectedPair& rate = all.rates.pairs[i];
    rows.push_back({rate.a, rate.b, std::isnan(rate.difference) ? "-" : fmt::format("{:+.3f}", rate.difference),
                    p_text(rate.p_holm), p_text(all.pairs[i].plain.p_value), p_text(all.pairs[i].p_holm)});
  }
  std::string out = "\nThe same particles under two policies\n" + text_table(rows, 2) +
                    pairs_left_out(all.pairs.size(), shown.size());
  out += paragraph(
      "McNemar's and the last column are corrected by Holm for the number of pairs; 'of pairs' is the log-rank test "
      "that "
      "uses that particles are shared, 'survival p' the plain one, which takes the policies' traces as independent.",
      0, 0);
  if (!std::isnan(all.log_rank.p_value) && all.policies.size() > 2) {
    out += paragraph(fmt::format("All policies together: log-rank chi-square {:.3g} with {:g} degree{} of freedom, {}",
                                 all.log_rank.chi_square, all.log_rank.freedom, all.log_rank.freedom == 1 ? "" : "s",
                                 p_equation(all.log_rank.p_value)),
                     0, 0);
  }
  return out;
}

}  // namespace

std::string format_explanation(const Explanation& all) {
  std::string out = printable(all.campaign) + (all.complete ? "" : " (INCOMPLETE: not all traces have been simulated)");
  out += fmt::format("\n{}, {} each\n", counted(all.particles, "particle", "particles"),
                     counted(all.parameters.columns.size(), "scalar", "scalars"));
  for (const std::string& note : all.notes) out += paragraph(note, 0, 2);
  for (std::size_t i = 0; i < all.policies.size(); ++i) {
    const PolicyExplanation& policy = all.policies[i];
    out += "\n" + head_of(all, i);
    const std::string solver = convergence_sentence(score_of(all, i).convergence, all.score.unconverged);
    if (!solver.empty()) out += paragraph(solver, 2, 4);
    if (!policy.causes.empty()) out += "  Causes\n" + causes_text(policy, all.parameters);
    out += "  Final states\n" + modes_text(policy) + growth_text(policy.growth);
    out += "  Survival\n" + survival_text(policy);
    out += "  Margins\n" + margins_text(policy);
    const std::string sizes = sizes_text(policy);
    if (!sizes.empty()) out += "  How many particles\n" + sizes;
  }
  return printable_lines(out + pairs_text(all));
}

}  // namespace graze
