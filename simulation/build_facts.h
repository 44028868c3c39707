#pragma once
// What a program was built with and runs on, as far as bits of results could depend on it. Recorded in archives, so
// that results which differ between machines can be explained; docs/determinism.md says which of them should not
// matter.

#include <string>
#include <vector>

namespace graze {

/// All empty in archives that do not know it.
struct BuildFacts {
  std::string compiler;         // "GCC 12.2.0"
  std::string c_library;        // of the running process: "glibc 2.36"
  std::string eigen, bullet;    // versions: "3.4.0", "3.24"
  std::string flags;            // of the compiler: "-O3 -DNDEBUG -ffp-contract=off"
  std::string instruction_set;  // of the lanes' kernels in use: "x86_64, avx512"
};

/// Calls act(name of the attribute, member) for each fact, so that writing, reading and comparing cannot differ.
template <class Facts, class Do>
void each_fact(Facts& facts, const Do& act) {
  act("compiler", facts.compiler);
  act("c_library", facts.c_library);
  act("eigen_version", facts.eigen);
  act("bullet_version", facts.bullet);
  act("build_flags", facts.flags);
  act("instruction_set", facts.instruction_set);
}

/// Those of this process. Throws InputError if GRAZE_ISA names no instruction set (engine/lanes/isa.h).
BuildFacts build_facts();

/// "compiler GCC 12.2.0 there, Clang 14.0.6 here", a line for each fact that both know and that differs.
std::vector<std::string> build_differences(const BuildFacts& there, const BuildFacts& here);

}  // namespace graze
