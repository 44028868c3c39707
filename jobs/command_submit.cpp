// graze submit: writes a Slurm batch script for a campaign and submits it.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>

#include "analysis/sequential.h"
#include "archive/shell_word.h"
#include "jobs/batch_script.h"
#include "jobs/commands.h"
#include "jobs/simulate.h"

namespace graze {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  BatchRequest request;
  std::string time, memory;
  bool dry_run = false;
};

/// The words that `graze submit` does not know are those of `graze run`; its own parser reads them.
class RunWords {
 public:
  explicit RunWords(std::vector<std::string> words) : words_(std::move(words)) {
    add_run(app_, ignored_, "");
    std::vector<std::string> line(words_.rbegin(), words_.rend());
    line.push_back("run");
    try {
      app_.parse(line);
    } catch (const CLI::ParseError& error) {
      throw InputError(
          fmt::format("submit: {}; what it does not know itself is for graze run, see graze run --help", error.what()));
    }
  }

  std::vector<std::string> of(const std::string& option) const {
    return app_.get_subcommand("run")->get_option(option)->results();
  }
  std::string one(const std::string& option) const { return of(option).empty() ? "" : of(option).back(); }
  bool given(const std::string& option) const { return !of(option).empty(); }
  const std::vector<std::string>& words() const { return words_; }

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
  Action ignored_;
  std::vector<std::string> words_;
};

void refuse(const RunWords& run, const std::string& option, const std::string& why) {
  if (run.given(option)) throw InputError(fmt::format("submit: {}: {}", option, why));
}

/// What the job would find wrong hours later is told now.
void check_campaign(const RunWords& run, const BatchRequest& request) {
  ScenarioArguments arguments;
  arguments.file = run.one("scenario");
  arguments.set = run.of("--set");
  arguments.ignore_missing_meshes = run.given("--ignore-missing-meshes");
  Scenario scenario = arguments.load();
  choose_policies(scenario, run.of("--policy"));
  if (run.given("--until") && request.array > 0) {
    throw InputError("submit: --until: the tasks of an array know nothing of each other; leave out --array");
  }
  for (const std::string& question : run.of("--until")) parse_question(question, "--until");
}

fs::path campaign_directory(const RunWords& run) {
  const fs::path output = run.one("--output");
  if (output.empty()) return fs::path(run.one("scenario")).stem().string() + ".graze";
  if (output.extension() == ".h5") {
    throw InputError(fmt::format("submit: -o {}: a job writes a directory, which can be resumed; nearest: -o {}",
                                 output.string(), fs::path(output).replace_extension(".graze").string()));
  }
  return output.has_filename() ? output : output.parent_path();
}

void write_script(const fs::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  out.close();
  if (!out) throw MachineError(fmt::format("{}: cannot be written", file.string()));
}

/// Runs sbatch; gives the number of the job. Its complaints go to stderr.
std::string sbatch(const std::string& arguments) {
  const std::string line = "sbatch --parsable " + arguments;
  std::FILE* pipe = popen(line.c_str(), "r");
  if (!pipe) throw MachineError(fmt::format("{}: cannot be started", line));
  std::string out;
  std::array<char, 256> buffer{};
  while (std::fgets(buffer.data(), buffer.size(), pipe)) out += buffer.data();
  const int status = pclose(pipe);
  if (status != 0) throw MachineError(fmt::format("{}: failed, see above; the script stays there", line));
  return out.substr(0, out.find_first_of(";\n"));
}

bool have_sbatch() {
  return std::system("command -v sbatch >/dev/null 2>&1") == 0;  // NOLINT: a shell is what runs it, too
}

void submit_scripts(const BatchRequest& request, const BatchCampaign& campaign) {
  const fs::path base = fs::path(campaign.directory).replace_extension();
  const fs::path script = base.string() + ".sbatch", join = base.string() + ".join.sbatch";
  write_script(script, batch_script(request, campaign));
  if (request.array > 0) write_script(join, join_script(request, campaign));
  if (!have_sbatch()) {
    throw MachineError(
        fmt::format("sbatch: not found on this machine; {} is written: submit it where Slurm is, or look at it with "
                    "--dry-run",
                    script.string()));
  }
  const std::string job = sbatch(shell_word(script.string()));
  std::cout << fmt::format("job {}: {}\n", job, script.string());
  if (request.array > 0) {
    const std::string next = sbatch(fmt::format("--dependency=afterany:{} {}", job, shell_word(join.string())));
    std::cout << fmt::format("job {}: {}, when all parts have ended\n", next, join.string());
  }
  std::cout << fmt::format("see: squeue -j {}; graze status {}\n", job,
                           request.array > 0 ? campaign.parts_directory() + "/1" : campaign.directory);
}

int submit(Arguments arguments, const std::vector<std::string>& words) {
  BatchRequest& request = arguments.request;
  const RunWords run(words);
  request.seconds = parse_slurm_time(arguments.time);
  request.memory = parse_slurm_memory(arguments.memory);
  if (request.array > 0 && request.nodes * request.tasks_per_node > 1) {
    throw InputError(
        "submit: --array: each of its tasks is one process on one node; leave out --nodes and "
        "--ntasks-per-node, or --array");
  }
  refuse(run, "--force", "a job resumes what is there; choose another -o, or remove it yourself");
  check_campaign(run, request);
  BatchCampaign campaign;
  campaign.program = fs::read_symlink("/proc/self/exe").string();
  campaign.scenario = run.one("scenario");
  campaign.directory = campaign_directory(run).string();
  campaign.run = run.without({"-o", "--output", "--threads"});
  for (const char* flag : {"--json", "--quiet"}) {
    if (run.given(flag)) campaign.resume.push_back(flag);
  }
  if (run.given("--watchdog")) campaign.resume.insert(campaign.resume.end(), {"--watchdog", run.one("--watchdog")});
  if (run.given("--threads")) campaign.threads = run.one("--threads");
  if (request.job_name.empty()) request.job_name = "graze-" + fs::path(campaign.directory).stem().string();
  const std::string made = request.array > 0 ? campaign.parts_directory() : campaign.directory;
  if (arguments.dry_run) {
    std::cout << batch_script(request, campaign);
    if (request.array > 0) std::cout << "\n" << join_script(request, campaign);
    return kDone;
  }
  if (fs::exists(made)) {
    throw InputError(
        fmt::format("{}: exists already; choose another -o, or go on with it by submitting its script again "
                    "(sbatch {}.sbatch)",
                    made, fs::path(campaign.directory).replace_extension().string()));
  }
  submit_scripts(request, campaign);
  return kDone;
}

/// One word that Slurm and the script take as it is.
std::string word_problem(const std::string& text) {
  const bool fine = !text.empty() && text.find_first_of(" \t\n\"'$`\\") == std::string::npos;
  return fine ? "" : "'" + text + "' is not one plain word";
}

}  // namespace

void add_submit(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  BatchRequest& request = arguments->request;
  CLI::App* verb = add_verb(
      app, "submit", "Write a Slurm batch script for a campaign, and submit it",
      "  graze submit curb.yaml --nodes 4 --ntasks-per-node 2 --cpus-per-task 16 --time 2:00:00 -n 100000\n"
      "  graze submit curb.yaml --time 1-12 --until 'ci < 0.01' --policy 'step/4cm' --dry-run\n"
      "  graze submit curb.yaml --array 50 --cpus-per-task 8 --time 4:00:00 -n 1000000 -o /scratch/curb.graze\n\n"
      "graze submit SCENARIO …: the scenario and all other options are those of graze run. The script resumes what is "
      "there, so that it may "
      "be\n"
      "queued again at any time. docs/cluster.md tells more.\n");
  verb->allow_extras();
  verb->add_option("--time", arguments->time, "Time limit: minutes, H:M:S, D-H, D-H:M:S")->required();
  verb->add_option("--nodes", request.nodes, "Nodes")->check(CLI::Range(1, 100000))->capture_default_str();
  verb->add_option("--ntasks-per-node", request.tasks_per_node, "MPI ranks on each node")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  verb->add_option("--cpus-per-task", request.cpus_per_task, "Threads of each rank")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  verb->add_option("--array", request.array, "So many independent jobs instead of MPI, and one that joins their parts")
      ->check(CLI::Range(2, 100000));
  verb->add_option("--partition", request.partition, "Partition")->check(word_problem);
  verb->add_option("--account", request.account, "Account")->check(word_problem);
  verb->add_option("--mem", arguments->memory, "Memory per node, e.g. 4G");
  verb->add_option("--job-name", request.job_name, "Name of the job (default: graze-CAMPAIGN)")->check(word_problem);
  verb->add_flag("--srun", request.use_srun, "Start ranks with srun (PMIx) instead of mpirun");
  verb->add_flag("--dry-run", arguments->dry_run, "Print the script; write and submit nothing");
  verb->callback(
      [arguments, verb, &action] { action = [arguments, verb] { return submit(*arguments, verb->remaining()); }; });
}

}  // namespace graze
