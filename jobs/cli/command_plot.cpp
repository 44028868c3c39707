// graze plot: pictures of what a campaign found, for papers and slides.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <set>

#include "analysis/explained_traces.h"
#include "analysis/plots.h"
#include "analysis/plots_script.h"
#include "analysis/report_data.h"
#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/files/shell_word.h"
#include "archive/files/utf8.h"
#include "archive/hdf5/reading_child.h"
#include "jobs/campaign/archived_scenario.h"
#include "jobs/campaign/page_traces.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/gnuplot.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/page.h"
#include "jobs/cli/path_scene.h"
#include "jobs/cli/picture_file.h"
#include "jobs/cli/reading_verb.h"
#include "jobs/cli/shared_options.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPaths = 1000;
constexpr double kLeastEvery = 1e-3, kMostEvery = 1e6;  // s
constexpr std::uint64_t kLeastPixels = 100, kMostPixels = 16'000;

struct PlotArguments {
  std::string archive, output, format, channel, requirement;
  std::vector<std::string> pictures, policies, parameters;
  std::string size, theme = "light", by = "outcome";
  double every = 0;  // s; 0: not given
  std::size_t trajectories = 60;
  bool force = false;
};

/// What is asked for, checked before anything is read.
struct PlotOrder {
  std::vector<std::string> pictures;  // each once, in the order of pictures()
  bool all = false;                   // those that cannot be had are left out
  PlotStyle style;
  std::vector<fs::path> files;  // of the pictures
  bool has(const std::string& picture) const {
    return std::find(pictures.begin(), pictures.end(), picture) != pictures.end();
  }
};

std::string listed_pictures() {
  std::string out;
  for (const Picture& one : pictures()) out += one.name + ", ";
  return out + "or all";
}

std::vector<std::string> ordered_pictures(const PlotArguments& arguments, bool& all) {
  if (arguments.pictures.empty()) {
    throw InputError(fmt::format("plot: no PICTURE was given; there are: {}", listed_pictures()));
  }
  std::vector<std::string> names;
  for (const Picture& one : pictures()) names.push_back(one.name);
  names.emplace_back("all");
  for (const std::string& one : arguments.pictures) {
    if (std::find(names.begin(), names.end(), one) != names.end()) continue;
    if (std::find(names.begin(), names.end(), arguments.archive) != names.end() && fs::exists(one)) {
      throw InputError(
          fmt::format("plot: the archive stands first: graze plot {} {}", shell_path(one), arguments.archive));
    }
    const std::string near = nearest(one, names);
    throw InputError(fmt::format("plot: {}: there is no such picture; {}there are: {}", one,
                                 near.empty() ? "" : fmt::format("nearest: {}; ", near), listed_pictures()));
  }
  const std::set<std::string> asked(arguments.pictures.begin(), arguments.pictures.end());
  all = asked.count("all") > 0;
  std::vector<std::string> out;
  for (const Picture& one : pictures()) {
    if (all || asked.count(one.name) > 0) out.push_back(one.name);
  }
  return out;
}

/// Options that no picture asked for takes.
void check_options(const PlotArguments& arguments, const PlotOrder& order) {
  const auto needs = [&](bool given, const char* option, const std::vector<std::string>& takers) {
    if (!given) return;
    std::string list;
    for (const std::string& one : takers) {
      if (order.has(one)) return;
      list += (list.empty() ? "" : ", ") + one;
    }
    throw InputError(fmt::format("{}: is for {}, which was not asked for", option, list));
  };
  needs(!arguments.channel.empty(), "--channel", {"channel"});
  needs(!arguments.parameters.empty(), "--parameter", {"parameters"});
  needs(!arguments.requirement.empty(), "--requirement", {"margins", "parameters", "survival", "causes"});
  needs(arguments.by != "outcome", "--by", {"plan", "side", "isometric", "channel"});
  needs(arguments.every > 0, "--every", {"plan", "side", "isometric", "lapse"});
}

void read_size(const std::string& text, PlotStyle& style) {
  if (text.empty()) return;
  const std::size_t x = text.find_first_of("xX");
  if (x == std::string::npos) {
    throw InputError(fmt::format("--size {}: not of the form WIDTHxHEIGHT in pixels, e.g. --size 1200x800", text));
  }
  style.width = static_cast<int>(parse_whole(text.substr(0, x), "--size", kLeastPixels, kMostPixels));
  style.height = static_cast<int>(parse_whole(text.substr(x + 1), "--size", kLeastPixels, kMostPixels));
}

bool names_folder(const PlotArguments& arguments, const PlotOrder& order) {
  if (arguments.output.empty()) return order.pictures.size() > 1;
  const std::string& output = arguments.output;
  return output.ends_with("/") || ending_of(output).empty() || fs::is_directory(output);
}

void read_outputs(const PlotArguments& arguments, PlotOrder& order) {
  const bool folder = names_folder(arguments, order);
  const std::string ending = arguments.output.empty() || folder ? "" : ending_of(arguments.output);
  if (!ending.empty()) {
    check_ending(arguments.output, "a picture is one SVG or PNG file", {".svg", ".png"}, Endings::only);
    if (order.pictures.size() > 1) {
      throw InputError(fmt::format("-o {}: names a file, and {} pictures go into a folder; nearest right answer: -o {}",
                                   arguments.output, order.pictures.size(),
                                   fs::path(arguments.output).replace_extension().string()));
    }
    if (!arguments.format.empty() && "." + arguments.format != ending) {
      throw InputError(fmt::format("--format {}: -o {} names another format; leave one of them out", arguments.format,
                                   arguments.output));
    }
  }
  const std::string format = !arguments.format.empty() ? arguments.format : ending == ".png" ? "png" : "svg";
  order.style.format = format == "png" ? PlotStyle::Format::png : PlotStyle::Format::svg;
  for (const std::string& picture : order.pictures) {
    if (folder) {
      const fs::path into = arguments.output.empty()
                                ? fs::path(default_page(arguments.archive, "_plots")).replace_extension()
                                : fs::path(arguments.output);
      order.files.push_back(into / (picture + "." + format));
    } else if (arguments.output.empty()) {
      order.files.push_back(default_page(arguments.archive, "." + picture).replace_extension(format));
    } else {
      order.files.emplace_back(arguments.output);
    }
    check_new_file(order.files.back(), arguments.force, {arguments.archive});
  }
}

PlotOrder read_order(const PlotArguments& arguments) {
  PlotOrder out;
  out.pictures = ordered_pictures(arguments, out.all);
  check_options(arguments, out);
  out.style.theme = arguments.theme == "dark" ? PlotStyle::Theme::dark : PlotStyle::Theme::light;
  read_size(arguments.size, out.style);
  read_outputs(arguments, out);
  return out;
}

/// Pictures of traces that are simulated again.
bool is_played(const std::string& picture) {
  static const std::set<std::string> kPlayed = {"plan", "side", "isometric", "lapse", "channel"};
  return kPlayed.count(picture) > 0;
}

/// Makes the figures of an order. What several of them need is read once.
class PlotMaker {
 public:
  PlotMaker(const PlotArguments& arguments, const PlotOrder& order) : arguments_(arguments), order_(order) {
    archive_.emplace(arguments.archive);
    warn(archive_->warnings());
    info_ = archive_->info();
    complete_ = archive_->complete();
    policies_ = chosen_names(info_.policies, arguments.policies, arguments.archive);
  }
  bool complete() const { return complete_; }

  /// By picture of the order; none: it cannot be had, as a warning has said.
  std::vector<std::optional<Figure>> figures() {
    std::vector<std::optional<Figure>> out(order_.pictures.size());
    for (const bool simulated : {false, true}) {
      if (simulated) close_archive();
      for (std::size_t i = 0; i < out.size(); ++i) {
        const std::string& picture = order_.pictures[i];
        if (is_played(picture) == simulated) out[i] = figure(picture);
      }
    }
    return out;
  }

 private:
  std::optional<Figure> figure(const std::string& picture) {
    try {
      Figure out = made(picture);
      out.subtitle = fmt::format("{}, {} particles{}", info_.scenario_name, info_.particles,
                                 complete_ ? "" : " – the campaign is not complete");
      return out;
    } catch (const InputError& error) {
      if (!order_.all) throw;
      spdlog::warn("without the picture {}: {}", picture, error.what());
      return std::nullopt;
    }
  }

  Figure made(const std::string& picture) {
    if (picture == "success") return success_figure(policy_families(info_, policies_), scored());
    if (picture == "failures") return failures_figure(scored());
    if (picture == "margins") return margins_figure(margin_histograms(*archive_, sample()), arguments_.requirement);
    if (picture == "plan") return paths(PathView::above);
    if (picture == "side") return paths(PathView::side);
    if (picture == "isometric") return paths(PathView::isometric);
    if (picture == "lapse") {
      return lapse_figure(played(), policies_, path_scene_, arguments_.every > 0 ? arguments_.every : 1);
    }
    if (picture == "channel") return channel_figure(played(), policies_, arguments_.channel, by());
    if (picture == "parameters") {
      return parameters_figure(info_, sample(),
                               {arguments_.parameters, arguments_.requirement, !arguments_.policies.empty()});
    }
    if (picture == "survival") return survival();
    if (picture == "tree") return tree();
    check_requirement();
    return causes_figure(explain(*archive_, policies_), arguments_.requirement);
  }

  Figure paths(PathView view) { return path_figure(played(), policies_, path_scene_, {view, by(), arguments_.every}); }
  PlotBy by() const { return arguments_.by == "policy" ? PlotBy::policy : PlotBy::outcome; }

  const Score& scored() {
    if (!score_) score_ = score(*archive_, arguments_.archive, policies_);
    return *score_;
  }
  const ReportSample& sample() {
    if (!sample_) sample_ = sample_traces(*archive_, policies_);
    return *sample_;
  }

  /// Of pictures that know no measures: what decides, and the objective.
  void check_requirement() const {
    if (arguments_.requirement.empty()) return;
    std::vector<std::string> names;
    for (std::size_t r = 0; r < info_.deciding(); ++r) names.push_back(info_.requirements[r].name);
    names.emplace_back("objective");
    check_plotted_name("--requirement", arguments_.requirement, names);
  }

  Figure survival() {
    check_requirement();
    const std::string what = arguments_.requirement.empty() ? "any requirement" : arguments_.requirement;
    const Freedoms freedoms(info_.q_names);
    const std::uint64_t end =
        info_.part.begin + std::min(info_.part.count(info_.particles), ExplainOptions().most_particles);
    std::vector<PolicySurvival> all;
    for (const std::string& policy : policies_) {
      const std::vector<Survival> each = survivals(info_, explained_traces(*archive_, policy, freedoms, end));
      const auto at = std::find_if(each.begin(), each.end(), [&](const Survival& one) { return one.what == what; });
      all.push_back({policy, *at});
    }
    return survival_figure(all, what, info_.end);
  }

  Figure tree() {
    EventsRequest request;
    request.name = arguments_.archive;
    request.policies = policies_;
    return tree_figure(campaign_events(*archive_, request));
  }

  /// What is to be simulated again is chosen while the archive can be read.
  void close_archive() {
    if (std::any_of(order_.pictures.begin(), order_.pictures.end(), is_played)) {
      const std::vector<FailureWay> ways = failure_ways(*archive_, policies_);
      const bool lapse = order_.has("lapse");  // has a panel for each policy
      const std::size_t most = lapse ? std::max(arguments_.trajectories, policies_.size()) : arguments_.trajectories;
      traces_ = find_traces(*archive_, choose_traces(ways, sample(), info_, most), lapse ? most : 0);
    }
    archive_.reset();
    end_of_reading();
  }

  /// Simulates once; fills path_scene_, too.
  const Json& played() {
    if (page_) return *page_;
    check_results_version(arguments_.archive, info_, "plot it with that program");
    const ArchivedScenario reloaded(arguments_.archive, info_, "nothing can be simulated again");
    Json page = {{"notes", Json::array()}};
    for (const std::string& one :
         add_traces(page, reloaded.scenario(), info_, arguments_.archive, traces_, NumberForm::plain)) {
      spdlog::warn("{}: {} went ANOTHER WAY than the archive says; graze replay tells how", arguments_.archive, one);
    }
    path_scene_ = path_scene(reloaded.scenario(), policies_);
    page_ = std::move(page);
    return *page_;
  }

  const PlotArguments& arguments_;
  const PlotOrder& order_;
  std::optional<Archive> archive_;
  CampaignInfo info_;
  bool complete_ = true;
  std::vector<std::string> policies_;
  std::optional<Score> score_;
  std::optional<ReportSample> sample_;
  std::vector<PageTrace> traces_;
  std::optional<Json> page_;
  PathScene path_scene_;
};

int plot(const PlotArguments& arguments, const PlotOrder& order) {
  const ParentFolders folders(order.files.front());
  PlotMaker maker(arguments, order);
  const std::vector<std::optional<Figure>> figures = maker.figures();
  std::vector<std::string> drawn(figures.size());  // all of them before the first is written
  for (std::size_t i = 0; i < figures.size(); ++i) {
    if (!figures[i]) continue;
    drawn[i] = drawn_figure(*figures[i], order.style, order.files[i]);
  }
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (!drawn[i].empty()) write_picture(order.files[i], arguments.force, drawn[i]);
  }
  return maker.complete() ? kDone : kMachineFailed;
}

std::string picture_help() {
  std::string out;
  for (const Picture& one : pictures()) out += fmt::format("  {:<12}{}\n", one.name, one.what);
  return out + "  all         each of them, into a folder\n";
}

}  // namespace

void add_plot(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<PlotArguments>();
  PlotArguments& a = *arguments;
  CLI::App* verb =
      add_verb(app, "plot", "Pictures of the report as SVG or PNG files, for papers and slides",
               "  graze plot quadruped_curb.graze success                 # writes quadruped_curb.success.svg\n"
               "  graze plot curb.h5 success failures -o figures          # figures/success.svg, figures/failures.svg\n"
               "  graze plot curb.h5 all --format png --theme dark -o slides\n"
               "  graze plot curb.h5 channel --channel base.z --policy step/3cm -o height.png --size 1600x900\n"
               "  graze plot curb.h5 parameters --parameter contact.friction --requirement upright\n\n"
               "Pictures:\n" +
                   picture_help() +
                   "\ngnuplot draws them (Debian's package gnuplot-nox). graze report --json and graze explain --json\n"
                   "have the numbers.\n");
  add_archive(*verb, a.archive);
  verb->add_option("pictures", a.pictures, "Which: success, failures, … (below), or all")->type_name("PICTURE");
  verb->add_option("-o,--output", a.output,
                   "A file ending in .svg or .png for one picture, a folder for several (default: beside the archive)");
  add_choice(*verb, "--format", a.format, {"svg", "png"}, "Of files in a folder (default: svg)");
  add_policies(*verb, a.policies);
  verb->add_option("--size", a.size, "Pixels of each picture; letters grow with it (default: as it needs)")
      ->type_name("WIDTHxHEIGHT");
  add_choice(*verb, "--theme", a.theme, {"light", "dark"}, "Colours for white or for dark paper")->default_str("light");
  verb->add_option("--channel", a.channel,
                   "channel: which one, 'base.z', 'base.yaw' or 'velocity: LF_X_1' (default: height of the base)")
      ->type_name("NAME");
  verb->add_option("--requirement", a.requirement,
                   "margins, parameters, survival, causes: about this requirement, or 'objective'")
      ->type_name("NAME");
  verb->add_option("--parameter", a.parameters,
                   "parameters: one of the axes (twice: both; default: those that part outcomes best)")
      ->type_name("NAME")
      ->allow_extra_args(false);
  add_choice(*verb, "--by", a.by, {"outcome", "policy"}, "plan, side, isometric, channel: what lines are coloured by")
      ->default_str("outcome");
  add_whole(*verb, "--trajectories", a.trajectories, 1, kMostPaths,
            "Traces that are simulated again for pictures of them (default: 60)");
  add_read_option(*verb, "--every", "plan, side, isometric: a mark so often; lapse: robots (default: 1s)",
                  [&a](const std::string& text, const std::string& option) {
                    a.every = parse_seconds(text, option, kLeastEvery, kMostEvery);
                  })
      ->type_name("TIME");
  add_trust(*verb);
  verb->add_flag("--force", a.force, "Replace files that exist");
  verb->callback([arguments, &action] {
    action = [arguments] {
      const PlotOrder order = read_order(*arguments);
      check_gnuplot(order.style.format == PlotStyle::Format::png);
      return in_reading_child(
          {arguments->archive}, [&] { return plot(*arguments, order); }, 2);
    };
  });
}

}  // namespace graze
