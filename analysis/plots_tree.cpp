// Where behaviour divides, as a tree from left to right: boxes are traces that went the same way.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "analysis/events_words.h"
#include "analysis/plots.h"
#include "analysis/plots_text.h"

namespace graze {
namespace {

constexpr double kLeftEdge = 18, kBoxWidth = 230, kBoxHeight = 68, kRowHeight = 80, kColumn = 267;  // px
constexpr double kTreeGap = 26, kHeadline = 26;

/// One box, and those that follow from it.
struct TreeBox {
  std::string title, divides;  // "": it does not
  OutcomeCounts outcomes;
  double time = 0;  // s, median; NaN: none
  std::vector<TreeBox> children = {};
};

std::string without_article(const std::string& text) { return text.starts_with("the ") ? text.substr(4) : text; }

TreeBox branch_box(const PolicyEvents& policy, const EventBranch& branch, const EventWords& words) {
  TreeBox out{words.branch(branch), "", branch.outcomes, branch.time.median};
  if (branch.node < 0) return out;
  const EventNode& node = policy.tree.nodes[static_cast<std::size_t>(branch.node)];
  out.divides = without_article(words.node(node));
  for (const EventBranch& one : node.branches) out.children.push_back(branch_box(policy, one, words));
  return out;
}

TreeBox root_box(const PolicyEvents& policy, const EventWords& words) {
  TreeBox out{"all traces", "", policy.tree.all, std::nan("")};
  if (policy.tree.nodes.empty()) return out;
  const EventNode& node = policy.tree.nodes.front();
  out.divides = without_article(words.node(node));
  for (const EventBranch& one : node.branches) out.children.push_back(branch_box(policy, one, words));
  return out;
}

std::size_t leaves_of(const TreeBox& box) {
  std::size_t out = 0;
  for (const TreeBox& child : box.children) out += leaves_of(child);
  return std::max<std::size_t>(out, 1);
}

std::size_t depth_of(const TreeBox& box) {
  std::size_t out = 0;
  for (const TreeBox& child : box.children) out = std::max(out, depth_of(child));
  return out + 1;
}

std::uint64_t known_of(const OutcomeCounts& counts) {
  return std::accumulate(counts.violated.begin(), counts.violated.end(), std::uint64_t{0});
}

/// S, K, U as one bar.
void add_shares(const OutcomeCounts& counts, double left, double top, double right, PlotDrawing& out) {
  constexpr double kThick = 8;
  const std::pair<std::uint64_t, PlotColor> parts[] = {
      {counts.success, PlotColor::success}, {known_of(counts), PlotColor::known}, {counts.unknown, PlotColor::unknown}};
  double x = left;
  for (const auto& [count, color] : parts) {
    if (count == 0) continue;
    const double width = (right - left) * static_cast<double>(count) / static_cast<double>(counts.n);
    out.boxes.push_back({x, top, x + width, top + kThick, color});
    x += width;
  }
}

/// Draws a box and all behind it; returns the height of its middle.
double add_box(const TreeBox& box, std::size_t depth, double top, double all, PlotDrawing& out) {
  const double left = kLeftEdge + kColumn * static_cast<double>(depth), right = left + kBoxWidth;
  std::vector<double> middles;
  double next = top;
  for (const TreeBox& child : box.children) {
    middles.push_back(add_box(child, depth + 1, next, all, out));
    next += kRowHeight * static_cast<double>(leaves_of(child));
  }
  const double middle = middles.empty() ? top + kRowHeight / 2 : (middles.front() + middles.back()) / 2;
  const double upper = middle - kBoxHeight / 2;
  out.boxes.push_back({left, upper, right, upper + kBoxHeight, PlotColor::panel, true});
  const double inside = left + 8, room = kBoxWidth - 16;
  out.texts.push_back({inside, upper + 13, box.title, 12, PlotColor::ink, true, room});
  const OutcomeCounts& n = box.outcomes;
  const std::string time =
      std::isfinite(box.time) ? fmt::format(", {} s", plot_number(std::round(box.time * 1e3) / 1e3)) : "";
  out.texts.push_back({inside, upper + 29,
                       fmt::format("{}: S {}, K {}, U {}{}", n.n, n.success, known_of(n), n.unknown, time), 11,
                       PlotColor::soft, false, room});
  if (n.n > 0) add_shares(n, inside, upper + 38, right - 8, out);
  if (!box.divides.empty()) {
    out.texts.push_back({inside, upper + 57, "◆ " + box.divides, 10.5, PlotColor::ink, false, room});
    out.diamonds.push_back({right, middle, PlotColor::ink});
  }
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const double share = static_cast<double>(box.children[i].outcomes.n) / all;
    out.arrows.push_back({right + 7, middle, left + kColumn - 2, middles[i], 0.8 + 4 * share});
  }
  return middle;
}

}  // namespace

Figure tree_figure(const CampaignEvents& events) {
  const EventWords words(events.info, std::max(events.request.rules.detail, Detail::features));
  Figure out{"tree", "Where behaviour divides"};
  out.legend = {{"Success (S)", PlotColor::success},
                {"Known failure (K)", PlotColor::known},
                {"Unknown failure (U)", PlotColor::unknown},
                {"bifurcation: the next contact has to do with the outcome", PlotColor::ink, PlotLegend::Kind::mark,
                 PlotMark::diamond}};
  double top = 4;
  std::size_t deepest = 1;
  for (const PolicyEvents& policy : events.policies) {
    const TreeBox root = root_box(policy, words);
    std::string said = policy.policy;
    if (policy.tree.tested == 0) {
      said += ": no contact could be tested";
    } else if (policy.tree.nodes.empty()) {
      said += fmt::format(": no contact decides how a trace ends ({} were tested)", policy.tree.tested);
    }
    out.drawing.texts.push_back({kLeftEdge, top + 10, said, 13, PlotColor::ink, true});
    add_box(root, 0, top + kHeadline, std::max(1.0, static_cast<double>(policy.tree.all.n)), out.drawing);
    top += kHeadline + kRowHeight * static_cast<double>(leaves_of(root)) + kTreeGap;
    deepest = std::max(deepest, depth_of(root));
  }
  out.drawing.height = top - kTreeGap + 6;
  out.width = std::max(out.width, 2 * kLeftEdge + kColumn * static_cast<double>(deepest - 1) + kBoxWidth);
  for (PlotDrawing::Text& one : out.drawing.texts) one.room = std::min(one.room, out.width - 2 * kLeftEdge);
  out.notes = {fmt::format(
      "A branch is what touches next: traces, their outcomes, median time. Arrows are as wide as traces are "
      "many; who went another way before is on none. A bifurcation is found where there is none with a probability of "
      "at most {:g} %.",
      100 * events.request.tree.error_rate)};
  return out;
}

}  // namespace graze
