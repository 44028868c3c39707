// graze submit: writes a Slurm batch script for a campaign and submits it.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "archive/files/files.h"
#include "archive/files/parent_folders.h"
#include "archive/files/shell_word.h"
#include "engine/settings/inputs.h"
#include "jobs/campaign/communicator.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/help_format.h"
#include "jobs/cli/option_values.h"
#include "jobs/cli/run_request.h"
#include "jobs/cli/wrapped_text.h"
#include "jobs/slurm/batch_queue.h"
#include "jobs/slurm/batch_script.h"
#include "jobs/workers/controllers.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct SubmitArguments {
  BatchRequest request;
  std::string time, memory;
  bool force = false, dry_run = false;
};

/// What a job must not find: the directory that it makes.
fs::path made_by(const BatchRequest& request, const BatchCampaign& campaign) {
  return request.array > 0 ? campaign.parts_directory() : campaign.directory;
}

/// The words that `graze submit` does not know are those of `graze run`; its own parser reads them.
class RunWords {
 public:
  explicit RunWords(std::vector<std::string> words) : words_(std::move(words)), verb_(app_.add_subcommand("run")) {
    arguments_.add_to(*verb_);
    std::vector<std::string> line(words_.rbegin(), words_.rend());
    line.push_back("run");
    try {
      app_.parse(line);
    } catch (const CLI::ParseError& error) {
      throw InputError(
          fmt::format("submit: {}; what it does not know itself is for graze run, see graze run --help", error.what()));
    }
  }

  const RunArguments& arguments() const { return arguments_; }
  bool given(const std::string& option) const { return !verb_->get_option(option)->results().empty(); }
  std::string one(const std::string& option) const {
    return given(option) ? verb_->get_option(option)->results().back() : "";
  }

  /// The words without an option and its value, however it was written.
  std::vector<std::string> without(const std::vector<std::string>& names) const {
    std::vector<std::string> out;
    for (std::size_t i = 0; i < words_.size(); ++i) {
      const std::string& word = words_[i];
      const auto is = [&](const std::string& name) { return word == name; };
      const auto holds = [&](const std::string& name) {
        return word.starts_with(name.starts_with("--") ? name + "=" : name) && word != name;
      };
      if (std::any_of(names.begin(), names.end(), is)) {
        ++i;
      } else if (std::none_of(names.begin(), names.end(), holds)) {
        out.push_back(word);
      }
    }
    return out;
  }

 private:
  CLI::App app_;
  std::vector<std::string> words_;
  RunArguments arguments_;
  CLI::App* verb_;
};

/// What neither Slurm nor the script could do with what was asked for.
void check_request(const BatchRequest& request, const RunArguments& run) {
  const int ranks = request.nodes * request.tasks_per_node;
  if (request.array > 0 && ranks > 1) {
    throw InputError(
        "submit: --array: each of its tasks is one process on one node; leave out --nodes and "
        "--ntasks-per-node, or --array");
  }
  if (ranks > 1 && !built_with_mpi()) {
    throw InputError(fmt::format("submit: {} ranks: this graze was built without MPI; take one, or --array", ranks));
  }
  check_ending(run.output, "a job writes a directory, which can be resumed", {".graze"});
  if (request.array == 0) return;
  if (!run.until.empty()) {
    throw InputError("submit: --until: the tasks of an array know nothing of each other; leave out --array");
  }
  if (!run.part.empty()) {
    throw InputError("submit: --part: the tasks of an array are the parts; leave out --part, or --array");
  }
}

/// What the job runs, checked as it will be by the job itself.
BatchCampaign prepare(const BatchRequest& request, const RunWords& words) {
  const RunArguments& arguments = words.arguments();
  if (arguments.scenario.file == kStandardInput) {
    throw InputError("submit: -: the job runs later and cannot read this standard input; give a file");
  }
  const RunRequest run = prepare_run(arguments, "");
  if (request.array > 0 && static_cast<std::uint64_t>(request.array) > run.options.particles) {
    throw InputError(fmt::format("submit: --array {}: there are only {} particles, and each task needs one",
                                 request.array, run.options.particles));
  }
  BatchCampaign out;
  out.program = fs::read_symlink("/proc/self/exe").string();
  out.scenario = arguments.scenario.file;
  out.directory = (run.directory.has_filename() ? run.directory : run.directory.parent_path()).string();
  out.run = words.without({"-o", "--output", "--threads"});
  if (arguments.json) out.resume.push_back("--json");
  if (arguments.quiet) out.resume.push_back("--quiet");
  if (words.given("--trust")) out.resume.push_back("--trust");
  if (words.given("--watchdog")) out.resume.insert(out.resume.end(), {"--watchdog", words.one("--watchdog")});
  out.threads = words.one("--threads");
  check_slurm_path(out.directory);
  if (const std::string problem = cannot_make(out.directory); !problem.empty()) {
    throw MachineError(fmt::format("-o {}: cannot be made: {}; choose another -o", out.directory, problem));
  }
  check_space(arguments, run, made_by(request, out), request.array > 0);
  return out;
}

/// A job never writes over anything: it would go on with it, or mix it up with its own.
void check_nothing_is_there(const BatchRequest& request, const BatchCampaign& campaign) {
  const fs::path made = made_by(request, campaign), script = campaign.script_file();
  if (fs::exists(fs::symlink_status(made))) {
    throw InputError(fmt::format(
        "{}: exists already; choose another -o, remove it, or go on with it: {}", made.string(),
        fs::exists(script) ? "sbatch " + shell_path(script.string())
                           : "graze resume " + shell_path(made.string()) + (request.array > 0 ? "/1 (/2, …)" : "") +
                                 (controllers_trusted() ? " --trust" : "")));
  }
  const fs::path packed = campaign.packed_file();
  if (request.array > 0 && fs::exists(fs::symlink_status(packed))) {
    throw InputError(
        fmt::format("{}: exists already, and the parts would be packed into it; choose another -o, or remove "
                    "it",
                    packed.string()));
  }
}

std::vector<BatchFile> batch_files(const BatchRequest& request, const BatchCampaign& campaign) {
  std::vector<BatchFile> files = {{campaign.script_file(), batch_script(request, campaign)}};
  if (request.array > 0) files.push_back({campaign.join_file(), join_script(request, campaign)});
  return files;
}

/// Scripts may have been edited, or be another campaign's.
std::string differs_text(const fs::path& file) {
  return fmt::format(
      "{0}: exists already, and differs from what would be written; submit it as it is (sbatch {1}), "
      "choose another -o, or replace it with --force",
      file.string(), shell_path(file.string()));
}

void print(const std::vector<BatchFile>& files) {
  for (const BatchFile& file : files) {
    // One script alone can be redirected into a file, and begins as Slurm wants it.
    if (files.size() > 1) std::cout << fmt::format("# ===== {} =====\n", file.path.string());
    std::cout << file.text << (&file == &files.back() ? "" : "\n");
  }
}

int submit(const SubmitArguments& arguments, const std::vector<std::string>& line) {
  BatchRequest request = arguments.request;
  const RunWords words(line);
  request.seconds = parse_slurm_time(arguments.time);
  request.memory = parse_slurm_memory(arguments.memory);
  check_request(request, words.arguments());
  const BatchCampaign campaign = prepare(request, words);
  check_nothing_is_there(request, campaign);
  if (request.job_name.empty()) request.job_name = default_job_name(campaign);
  const std::vector<BatchFile> files = batch_files(request, campaign);
  const std::vector<fs::path> others = arguments.force ? std::vector<fs::path>{} : differing(files);
  if (arguments.dry_run) {
    for (const fs::path& other : others) spdlog::warn("{}", differs_text(other));
    const fs::path folder = folder_of(files[0].path);
    if (!fs::exists(folder)) {
      spdlog::warn("{}: is not there; submit makes it, sbatch does not, and then has no place for the log",
                   folder.string());
    }
    print(files);
    return kDone;
  }
  if (!others.empty()) throw InputError(differs_text(others[0]));
  const std::vector<std::string> jobs = queue_jobs(files);
  std::cout << fmt::format("job {}: {}\n", jobs[0], files[0].path.string());
  if (jobs.size() > 1) {
    std::cout << fmt::format("job {}: {}, when all parts have ended\n", jobs[1], files[1].path.string());
  }
  std::cout << fmt::format("see: squeue -j {}; graze status {}\n", jobs[0],
                           shell_path(made_by(request, campaign).string() + (request.array > 0 ? "/1" : "")));
  return kDone;
}

/// One word that Slurm and the script take as it is.
std::string word_problem(const std::string& text) {
  const bool fine = !text.empty() && text.find_first_of(" \t\n\"'$`\\") == std::string::npos;
  return fine ? "" : "'" + text + "' is not one plain word";
}

}  // namespace

void add_submit(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<SubmitArguments>();
  BatchRequest& request = arguments->request;
  CLI::App* verb = add_verb(
      app, "submit", "Write a Slurm batch script for a campaign, and submit it",
      "  graze submit curb.yaml --nodes 4 --ntasks-per-node 2 --cpus-per-task 16 --time 2:00:00 -n 100000\n"
      "  graze submit curb.yaml --time 1-12 --until 'ci < 0.01' --policy 'step/4cm' --dry-run\n"
      "  graze submit curb.yaml --array 50 --cpus-per-task 8 --time 4:00:00 -n 1000000 -o /scratch/curb.graze\n\n"
      "graze submit SCENARIO …: the scenario and all other options are those of graze run. The script resumes what is "
      "there, so that it may be queued again at any time. docs/cluster.md tells more.\n");
  verb->allow_extras();
  // The scenario is read by run's own parser, so this one does not know that there is one.
  verb->formatter(help_format(output_width(), "Usage: graze submit [OPTIONS] SCENARIO [OPTIONS OF graze run]"));
  verb->add_option("--time", arguments->time, "Time limit as Slurm's: minutes, M:S, H:M:S, D-H, D-H:M:S")->required();
  add_whole(*verb, "--nodes", request.nodes, 1, 100000, "Nodes")->default_str("1");
  add_whole(*verb, "--ntasks-per-node", request.tasks_per_node, 1, 4096, "MPI ranks on each node")->default_str("1");
  add_whole(*verb, "--cpus-per-task", request.cpus_per_task, 1, 4096, "Threads of each rank")->default_str("1");
  add_whole(*verb, "--array", request.array, 2, 100000,
            "So many independent jobs instead of MPI, and one that joins their parts");
  verb->add_option("--partition", request.partition, "Partition")->check(word_problem);
  verb->add_option("--account", request.account, "Account")->check(word_problem);
  verb->add_option("--mem", arguments->memory, "Memory per node, e.g. 4G");
  verb->add_option("--job-name", request.job_name, "Name of the job (default: graze-CAMPAIGN)")->check(word_problem);
  verb->add_flag("--srun", request.use_srun, "Start ranks with srun (PMIx) instead of mpirun");
  verb->add_flag("--force", arguments->force, "Replace batch scripts that differ; never a campaign");
  verb->add_flag("--dry-run", arguments->dry_run, "Print the script; write and submit nothing");
  verb->callback(
      [arguments, verb, &action] { action = [arguments, verb] { return submit(*arguments, verb->remaining()); }; });
}

}  // namespace graze
