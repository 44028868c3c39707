#include "jobs/slurm/batch_script.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <regex>

#include "archive/files/shell_word.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

// How long before the time limit the program is told to finish its blocks, at most, s. Slurm may be a minute early.
constexpr std::uint64_t kWarning = 120;

std::uint64_t number(const std::ssub_match& match) { return match.matched ? std::stoull(match.str()) : 0; }

/// The nearest right answer to a time that Slurm would not read: "90 min" is 1:30:00.
std::string nearest_time(const std::string& text) {
  static const std::regex with_unit(R"(\s*([0-9]+(?:\.[0-9]+)?)\s*([smhd])[a-z]*\s*)", std::regex::icase);
  std::smatch match;
  if (!std::regex_match(text, match, with_unit)) return "2:00:00 (hours:minutes:seconds)";
  const char unit = static_cast<char>(std::tolower(match[2].str()[0]));
  const double scale = unit == 's' ? 1 : unit == 'm' ? 60 : unit == 'h' ? 3600 : 86400;
  return slurm_time(static_cast<std::uint64_t>(std::llround(std::stod(match[1].str()) * scale)));
}

std::string joined(const std::vector<std::string>& words) {
  std::vector<std::string> quoted;
  for (const std::string& word : words) quoted.push_back(shell_word(word));
  return fmt::format("{}", fmt::join(quoted, " "));
}

/// A value in a line of #SBATCH, where a blank or # ends it unless it is in quotes. Nothing can be escaped.
std::string directive_value(const std::string& value) {
  static const std::regex plain(R"([A-Za-z0-9_./:=,@%+-]+)");
  if (std::regex_match(value, plain)) return value;
  const char quote = value.find('"') == std::string::npos ? '"' : '\'';
  return quote + value + quote;
}

std::string option(const std::string& name, const std::string& value) {
  return value.empty() ? "" : fmt::format("#SBATCH --{}={}\n", name, directive_value(value));
}

/// `suffix`: with Slurm's own replacements (%j); a % of the name stays one.
std::string log_name(const BatchCampaign& campaign, const std::string& suffix) {
  std::string out;
  for (const char c : campaign.name()) out += c == '%' ? "%%" : std::string(1, c);
  return out + suffix;
}

std::string resources(const BatchRequest& request, const BatchCampaign& campaign) {
  std::string out = option("job-name", request.job_name);
  if (request.array > 0) {
    out += option("array", fmt::format("1-{}", request.array)) + option("nodes", "1") + option("ntasks", "1");
  } else {
    out += option("nodes", fmt::format("{}", request.nodes)) +
           option("ntasks-per-node", fmt::format("{}", request.tasks_per_node));
  }
  out += option("cpus-per-task", fmt::format("{}", request.cpus_per_task)) + option("mem", request.memory) +
         option("time", slurm_time(request.seconds)) + option("partition", request.partition) +
         option("account", request.account) +
         option("output", log_name(campaign, request.array > 0 ? ".%A_%a.log" : ".%j.log"));
  out += "#SBATCH --open-mode=append\n#SBATCH --requeue\n";
  return out + option("signal", fmt::format("B:USR1@{}", std::clamp<std::uint64_t>(request.seconds / 5, 1, kWarning)));
}

/// `again`: how to submit it again, besides the file itself.
std::string head(const BatchCampaign& campaign, const std::string& what, const std::string& again) {
  std::string line =
      fmt::format("# {}: {}. Written by graze submit; to submit it again: {}", campaign.scenario, what, again);
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < ' '; }, '?');
  return "#!/bin/bash\n" + line + "\n";
}

/// How graze is started: alone, or as ranks.
std::string launcher(const BatchRequest& request) {
  if (request.array > 0 || request.nodes * request.tasks_per_node == 1) return "";
  return request.use_srun ? "srun --mpi=pmix --cpus-per-task=\"$SLURM_CPUS_PER_TASK\" "
                          : "mpirun -np \"$SLURM_NTASKS\" --bind-to none ";
}

}  // namespace

std::string BatchCampaign::name() const {
  const std::filesystem::path path = directory;
  return path.extension() == ".graze" ? std::filesystem::path(path).replace_extension().string() : directory;
}

std::string default_job_name(const BatchCampaign& campaign) {
  std::string name = std::filesystem::path(campaign.name()).filename().string();
  static const std::regex other(R"([^A-Za-z0-9_.+-]+)");
  return "graze-" + std::regex_replace(name, other, "_");
}

void check_slurm_path(const std::string& path) {
  const auto bad = [](unsigned char c) { return c < ' ' || c == '\\'; };
  const bool both = path.find('"') != std::string::npos && path.find('\'') != std::string::npos;
  if (!both && std::none_of(path.begin(), path.end(), bad)) return;
  throw InputError(fmt::format(
      "-o {}: a batch script cannot name it: Slurm takes no backslashes, no control characters, and not both "
      "kinds of quotes in one path; choose another -o",
      path));
}

std::string slurm_time(std::uint64_t seconds) {
  return fmt::format("{}-{:02}:{:02}:{:02}", seconds / 86400, seconds / 3600 % 24, seconds / 60 % 60, seconds % 60);
}

std::uint64_t parse_slurm_time(const std::string& text) {
  static const std::regex form(R"((?:([0-9]{1,5})-)?([0-9]{1,8})(?::([0-9]{1,8}))?(?::([0-9]{1,8}))?)");
  std::smatch match;
  const auto fail = [&](const std::string& rule, const std::string& right) {
    return InputError(fmt::format("--time {}: {}; nearest right answer: {}", text, rule, right));
  };
  if (!std::regex_match(text, match, form)) {
    throw fail("is not minutes, minutes:seconds, hours:minutes:seconds, days-hours or days-hours:minutes:seconds",
               nearest_time(text));
  }
  const bool days = match[1].matched, two = match[3].matched, three = match[4].matched;
  const std::uint64_t a = number(match[2]), b = number(match[3]), c = number(match[4]);
  const std::uint64_t seconds = days    ? (number(match[1]) * 24 + a) * 3600 + b * 60 + c
                                : three ? a * 3600 + b * 60 + c
                                        : a * 60 + b;
  if ((two && b > 59) || (three && c > 59) || (days && a > 23)) {
    throw fail("has a part that is too large (hours up to 23 behind days, minutes and seconds up to 59)",
               slurm_time(seconds));
  }
  if (seconds == 0) throw fail("a job needs some time", "2:00:00");
  return seconds;
}

std::string parse_slurm_memory(const std::string& text) {
  static const std::regex form("[0-9]+[KMGT]?"), spelled(R"(\s*([0-9]+)\s*([KMGT])i?B?\s*)", std::regex::icase);
  if (text.empty() || std::regex_match(text, form)) return text;
  std::smatch match;
  std::string right = "4G";
  if (std::regex_match(text, match, spelled)) {
    right = match[1].str() + static_cast<char>(std::toupper(match[2].str()[0]));
  }
  throw InputError(
      fmt::format("--mem {}: is not a whole number, or one with K, M, G or T (megabytes without); nearest "
                  "right answer: {}",
                  text, right));
}

std::string batch_script(const BatchRequest& request, const BatchCampaign& campaign) {
  const bool array = request.array > 0;
  const std::string threads =
      campaign.threads.empty() ? "--threads \"$SLURM_CPUS_PER_TASK\"" : "--threads " + shell_word(campaign.threads);
  const std::string again = "sbatch " + shell_path(campaign.script_file());
  std::string out =
      array ? head(campaign, fmt::format("a campaign in {} parts", request.array),
                   fmt::format("{}, and when all parts are there: sbatch {}", again, shell_path(campaign.join_file())))
            : head(campaign, "a campaign", again);
  out +=
      "# It resumes what is there already: after pre-emption, the time limit or a failed node nothing finished is "
      "lost.\n";
  out += resources(request, campaign) + "\n";
  out += "graze=" + shell_path(campaign.program) + "\n";
  out += array ? "campaign=" + shell_path(campaign.parts_directory()) + "/\"$SLURM_ARRAY_TASK_ID\"\n" + "mkdir -p " +
                     shell_path(campaign.parts_directory()) + "\n"
               : "campaign=" + shell_path(campaign.directory) + "\n";
  const std::string more = campaign.resume.empty() ? "" : joined(campaign.resume) + " ";
  const std::string part = array ? fmt::format(" --part \"$SLURM_ARRAY_TASK_ID/{}\"", request.array) : "";
  const std::string start = launcher(request) + "\"$graze\"";
  out +=
      "\n# Before the time is up Slurm sends USR1, at pre-emption TERM: graze then finishes its blocks.\n"
      "again=\n"
      "trap 'again=yes; kill -USR1 \"$work\" 2>/dev/null' USR1\n"
      "trap 'kill -USR1 \"$work\" 2>/dev/null' TERM\n\n";
  out += "if [ -e \"$campaign/campaign.h5\" ] || [ -e \"$campaign/campaign.copy.h5\" ]; then\n  " + start +
         " resume \"$campaign\" " + more + threads + " &\nelse\n  " + start + " run " + joined(campaign.run) + part +
         " " + threads + " -o \"$campaign\" &\nfi\n";
  out +=
      "work=$!\n"
      "while kill -0 \"$work\" 2>/dev/null; do wait \"$work\"; done  # a signal ends wait, not the work\n"
      "wait \"$work\"\n"
      "code=$?\n\n"
      "# Stopped by the time limit with work left (exit code 3): queue again, and go on from there.\n"
      "if [ -n \"$again\" ] && [ \"$code\" = 3 ]; then scontrol requeue \"$SLURM_JOB_ID\"; fi\n"
      "exit \"$code\"\n";
  return out;
}

std::string join_script(const BatchRequest& request, const BatchCampaign& campaign) {
  const std::string program = shell_path(campaign.program), file = shell_path(campaign.packed_file());
  return head(campaign, "makes one file of the parts", "sbatch " + shell_path(campaign.join_file())) +
         option("job-name", request.job_name + "-join") + "#SBATCH --nodes=1\n#SBATCH --ntasks=1\n" +
         option("mem", request.memory) + option("time", slurm_time(request.seconds)) +
         option("partition", request.partition) + option("account", request.account) +
         option("output", log_name(campaign, ".join.%j.log")) + "\n" +
         "set -e  # no table of an older file if pack fails\n" +
         fmt::format("{} pack {}/* -o {} --force\n", program, shell_path(campaign.parts_directory()), file) +
         fmt::format("{} score {}\n", program, file);
}

}  // namespace graze
