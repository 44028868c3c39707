// Claims: `graze doctor` tells what a campaign would use and what stands in its way, in words and as JSON; it leaves
// nothing behind, and its exit code says whether campaigns can run and be kept there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "archive/files/lock.h"
#include "jobs/campaign/communicator.h"
#include "jobs/machine/folder_trial.h"
#include "jobs/machine/machine_limits.h"
#include "simulation/results_epoch.h"
#include "tests/jobs/program.h"

namespace graze {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

/// A made-up root folder with control groups.
struct MadeUpGroups {
  testing::TemporaryFolder root;
  void put(const std::string& name, const std::string& text) const {
    fs::create_directories((root / name).parent_path());
    testing::write_file(root / name, text + "\n");
  }
  GroupLimits read() const { return group_limits(root.path()); }
};

TEST(GroupLimits, OfVersion2AreTheTightestOnTheWayUp) {
  const MadeUpGroups groups;
  groups.put("proc/self/cgroup", "0::/slurm/job_17/step_0");
  groups.put("sys/fs/cgroup/slurm/cpu.max", "150000 100000");
  groups.put("sys/fs/cgroup/slurm/job_17/cpu.max", "max 100000");
  groups.put("sys/fs/cgroup/slurm/job_17/step_0/cpu.max", "400000 100000");
  groups.put("sys/fs/cgroup/slurm/memory.max", "8000000000");
  groups.put("sys/fs/cgroup/slurm/memory.current", "7000000000");
  groups.put("sys/fs/cgroup/slurm/job_17/memory.max", "2000000000");
  groups.put("sys/fs/cgroup/slurm/job_17/memory.current", "500000000");
  groups.put("sys/fs/cgroup/slurm/job_17/step_0/memory.max", "max");
  const GroupLimits limits = groups.read();
  EXPECT_DOUBLE_EQ(limits.processors.value_or(0), 1.5);
  EXPECT_EQ(limits.memory, 2'000'000'000u);
  EXPECT_EQ(limits.memory_in_use, 500'000'000u);
}

TEST(GroupLimits, InAContainerThePathMayBeThatOfTheHost) {
  const MadeUpGroups groups;
  groups.put("proc/self/cgroup", "0::/docker/0123abcd");
  groups.put("sys/fs/cgroup/cpu.max", "50000 100000");
  EXPECT_DOUBLE_EQ(groups.read().processors.value_or(0), 0.5);
  EXPECT_FALSE(groups.read().memory);
}

TEST(GroupLimits, OfVersion1HaveOtherNamesAndAHugeNumberForNone) {
  const MadeUpGroups groups;
  groups.put("proc/self/cgroup", "9:memory:/a\n4:cpu,cpuacct:/a/b\n1:name=systemd:/c");
  groups.put("sys/fs/cgroup/cpu/a/b/cpu.cfs_quota_us", "250000");
  groups.put("sys/fs/cgroup/cpu/a/b/cpu.cfs_period_us", "100000");
  groups.put("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1");
  groups.put("sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000");
  groups.put("sys/fs/cgroup/memory/a/memory.limit_in_bytes", "9223372036854771712");
  EXPECT_DOUBLE_EQ(groups.read().processors.value_or(0), 2.5);
  EXPECT_FALSE(groups.read().memory);
  groups.put("sys/fs/cgroup/memory/memory.limit_in_bytes", "3000000000");
  EXPECT_EQ(groups.read().memory, 3'000'000'000u);
}

TEST(GroupLimits, NoneWithoutGroupsAndAQuotaMakesFewerThreadsTheAdvice) {
  const MadeUpGroups groups;
  EXPECT_FALSE(groups.read().processors || groups.read().memory);
  GroupLimits limits;
  limits.processors = 0.25;
  const Finding few = limit_findings(limits).front();
  EXPECT_EQ(few.health, default_threads() > 1 ? Health::note : Health::good);
  EXPECT_THAT(few.text, HasSubstr("the time of 0.25"));
  EXPECT_EQ(few.advice, default_threads() > 1 ? "--threads 1 is as fast, and waits less" : "");
}

TEST(Mounts, TheLongestPointHoldsThePathAndTheLastCoversOthers) {
  const std::string table =
      "21 1 8:1 / / rw,relatime shared:1 - ext4 /dev/sda1 rw\n"
      "22 21 0:44 / /home rw - nfs4 server:/home rw,vers=4.2,local_lock=none\n"
      "23 22 0:45 / /home/my\\040disk rw,nosuid master:3 propagate_from:2 - xfs /dev/sdb rw\n"
      "24 21 0:46 / /home rw - lustre 10.0.0.1@tcp:/x rw,localflock\n";
  EXPECT_EQ(mount_of("/homely", table).type, "ext4");
  EXPECT_EQ(mount_of("/home", table).type, "lustre");
  EXPECT_EQ(mount_of("/home/a/b", table).options, "rw,rw,localflock");
  EXPECT_EQ(mount_of("/home/my disk/a", table).type, "xfs");
  EXPECT_EQ(mount_of("/home/my disk", table).point, "/home/my disk");
  EXPECT_EQ(mount_of("/a", "").type, "");
}

TEST(WhyNoLocks, SaysNothingWhereTheyWork) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(why_no_locks(folder.path()), "");
}

class Doctor : public ::testing::Test {
 protected:
  testing::TemporaryFolder folder;
  fs::path room = folder / "room";
  void SetUp() override { fs::create_directory(room); }
  testing::Result doctor(const std::string& arguments, const std::string& environment = "") const {
    return testing::shell(folder.path(), environment + " '" GRAZE_PROGRAM "' doctor " + arguments);
  }
};

TEST_F(Doctor, TellsEverythingAndLeavesNothing) {
  const testing::Result run = doctor("room");
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  EXPECT_EQ(run.err, "");
  const auto shipped =
      std::distance(fs::directory_iterator(GRAZE_SOURCE_DIR "/data/scenarios"), fs::directory_iterator());
  EXPECT_THAT(run.out,
              AllOf(HasSubstr(results_version()), HasSubstr(std::to_string(shipped) + " scenarios"), HasSubstr("HDF5"),
                    HasSubstr("locks         work\n"), HasSubstr(fs::canonical(room).string()),
                    HasSubstr("Campaigns can run and be kept here.")));
  EXPECT_THAT(run.out, Not(HasSubstr("BROKEN")));
  EXPECT_TRUE(fs::is_empty(room));
}

TEST_F(Doctor, JsonHasWhatTheTextHas) {
  const auto json = nlohmann::json::parse(doctor("room --json").out);
  EXPECT_EQ(json["sound"], true);
  const auto find = [&](const std::string& name) {
    for (const auto& one : json["findings"]) {
      if (one["name"] == name) return one;
    }
    ADD_FAILURE() << name;
    return nlohmann::json();
  };
  EXPECT_GE(find("processors")["threads"], 1);
  EXPECT_GT(find("memory")["total_bytes"], 1e8);
  EXPECT_GT(find("space")["free_bytes"], 0);
  EXPECT_EQ(find("renames")["health"], "good");
  EXPECT_EQ(find("worker")["health"], "good") << find("worker");
  EXPECT_EQ(find("reading child")["health"], "good") << find("reading child");
}

// Nobody, root included, may write into /proc.
TEST_F(Doctor, AFolderThatCannotBeWrittenIsBroken) {
  const testing::Result run = doctor("/proc");
  EXPECT_EQ(run.code, 3);
  EXPECT_THAT(run.out, AllOf(HasSubstr("BROKEN: no folder can be made here"), HasSubstr("-> name a folder"),
                             HasSubstr("One thing that campaigns need is broken.")));
  EXPECT_EQ(nlohmann::json::parse(doctor("/proc --json").out)["sound"], false);
}

TEST_F(Doctor, WhatIsMissingIsToldWithHowToGetIt) {
  const testing::Result run = doctor("room", "PATH= GRAZE_DATA='" + room.string() + "'");
  EXPECT_EQ(run.code, 0) << "nothing that a campaign needs";
  EXPECT_THAT(run.out, AllOf(HasSubstr("apt-get install gnuplot-nox"), HasSubstr("not there; for robots in .xacro"),
                             HasSubstr("no scenarios in "), HasSubstr("export GRAZE_DATA=FOLDER")));
  const testing::Result isa = doctor("room", "GRAZE_ISA=sse9");
  EXPECT_EQ(isa.code, 3);
  EXPECT_THAT(isa.out, AllOf(HasSubstr("BROKEN: "), HasSubstr("'sse9'"), HasSubstr("-> unset GRAZE_ISA")));
  EXPECT_THAT(doctor("room", "GRAZE_ISA=portable").out, HasSubstr("portable (there are: portable"));
}

// Of the interpreter that controllers in Python get, not of some other.
TEST_F(Doctor, TellsWhetherPythonHasNumPy) {
  std::filesystem::create_directories(room / "bin");
  const auto told_of = [&](const std::string& answer) {
    testing::write_file(room / "bin/python3", "#!/bin/sh\n" + answer + "\n");
    std::filesystem::permissions(room / "bin/python3", std::filesystem::perms::owner_all);
    return doctor("room", "PATH='" + (room / "bin").string() + "'").out;
  };
  EXPECT_THAT(told_of("exit 1"), AllOf(HasSubstr("bin/python3: has no NumPy, which controllers of your own in Python"),
                                       HasSubstr("/usr/bin/python3 has it (Python ")));
  EXPECT_THAT(told_of("echo Python 3.99.1, NumPy 9.8"), HasSubstr("bin/python3: Python 3.99.1, NumPy 9.8; for contr"));
}

TEST_F(Doctor, WrongFoldersAreRefused) {
  const testing::Result run = doctor("roam");
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, HasSubstr("roam: "));
  EXPECT_EQ(run.out, "");
}

}  // namespace
}  // namespace graze
