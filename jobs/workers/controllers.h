#pragma once
// Controllers from outside (policy `library`) in campaigns: whether the user trusts them, whether they are the ones
// that were meant, and the processes that their blocks run in.

#include "scenarios/scenario.h"
#include "simulation/contained.h"

namespace graze {

/// The user has said that code that a scenario names may run (--trust). For the whole process.
void trust_controllers();
bool controllers_trusted();
/// They may not any more: one of them has ended a process that it ran in.
void distrust_controllers();
bool controllers_distrusted();
/// What controllers have printed in processes of their own is told though nothing went wrong. For the whole process.
void show_prints();

/// Refuses what cannot be simulated, before anything is: libraries that nobody trusts, that are not the ones that were
/// meant, that cannot be loaded, or whose create() fails. Throws InputError, MachineError.
void try_controllers(const Scenario& scenario);

/// Where the blocks of the scenario's policies run; empty if all run in this process. Libraries with `isolation: none`
/// may be loaded here from now on. `watchdog`: s, longest time for one trace. Throws InputError if a library is not
/// trusted.
RunElsewhere controllers_elsewhere(const Scenario& scenario, std::uint64_t seed, std::uint64_t particles,
                                   double watchdog);

/// For commands that simulate within this process alone: if the user trusts them, libraries with `isolation: none` may
/// be loaded from now on. Policies that are not loaded say why when a trace begins.
void prepare_controllers_here(const Scenario& scenario);

/// Whether the policy's blocks run in processes of their own: then these fabricate the particles, too, and of a
/// RemoteRun's particles only the ids count.
bool runs_elsewhere(const PolicySpec& policy);

/// All libraries may be loaded in this process from now on: a trace that is watched step by step runs nowhere else.
/// Throws as controllers_elsewhere().
void load_controllers_here(const Scenario& scenario);

}  // namespace graze
