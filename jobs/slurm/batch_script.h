#pragma once
// Slurm batch scripts for campaigns: readable, and safe to be started again at any time, since they resume what is
// there.

#include <cstdint>
#include <string>
#include <vector>

namespace graze {

/// What is asked of Slurm. Empty texts and zeros are left to the cluster's own defaults.
struct BatchRequest {
  int nodes = 1, tasks_per_node = 1, cpus_per_task = 1;
  std::uint64_t seconds = 0;  // time limit
  std::string partition, account, memory, job_name;
  int array = 0;  // so many independent jobs instead of MPI ranks; 0: none
  bool use_srun = false;
};

/// What the job runs.
struct BatchCampaign {
  std::string program;              // path of graze
  std::string scenario;             // as given
  std::string directory;            // the campaign's; in array mode the parts lie in parts_directory()
  std::vector<std::string> resume;  // words behind `graze resume DIRECTORY`: those that it shares with run
  std::vector<std::string> run;     // words behind `graze run`, scenario included, without the output and --threads
  std::string threads;              // as given; empty: Slurm's processors per task

  /// Everything of the campaign begins with its name, which is that of the directory without ".graze".
  std::string name() const;
  std::string script_file() const { return name() + ".sbatch"; }
  std::string join_file() const { return name() + ".join.sbatch"; }  // array mode, as what follows
  std::string parts_directory() const { return name() + ".parts"; }
  std::string packed_file() const { return name() + ".h5"; }
};

/// Reads a time limit as Slurm writes it: M, M:S, H:M:S, D-H, D-H:M, D-H:M:S. Throws InputError with the nearest right
/// answer ("2 h": '2:00:00').
std::uint64_t parse_slurm_time(const std::string& text);
/// "1-02:30:00", "0-00:10:00".
std::string slurm_time(std::uint64_t seconds);
/// Reads an amount of memory as Slurm writes it: 4000, 4G. Throws InputError with the nearest right answer.
std::string parse_slurm_memory(const std::string& text);

/// The name of a job of this campaign, if none is given: of plain characters only, whatever the directory's name is.
std::string default_job_name(const BatchCampaign& campaign);
/// Throws InputError if the path of a campaign cannot be written into a batch script, where Slurm knows no escapes.
void check_slurm_path(const std::string& path);

/// The script of the campaign; of one task of the array in array mode.
std::string batch_script(const BatchRequest& request, const BatchCampaign& campaign);
/// The script that makes one file of the parts of an array, when all have ended.
std::string join_script(const BatchRequest& request, const BatchCampaign& campaign);

}  // namespace graze
