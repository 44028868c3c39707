#pragma once
// The contact solvers and models of `lanes`, as parameters of tests: what is true of contact is true under each.

#include <gtest/gtest.h>

#include "engine/lane_physics/lane_engine.h"

namespace graze::test {

/// By the names that contact.solver has.
struct NamedSolver {
  std::string name;
  ContactSolver solver;
};
inline std::vector<NamedSolver> contact_solvers() {
  return {{"auto", ContactSolver::automatic}, {"sweeps", ContactSolver::sweeps}, {"newton", ContactSolver::newton}};
}
inline std::string name_of_solver(const testing::TestParamInfo<NamedSolver>& info) { return info.param.name; }

/// Each model under each solver.
struct ContactChoice {
  std::string model;
  NamedSolver solver;

  void apply_to(ContactSettings& contact) const { contact.model = model, contact.solver = solver.solver; }
};
inline std::vector<ContactChoice> contact_choices() {
  std::vector<ContactChoice> out;
  for (const std::string& model : lane_contact_models()) {
    for (const NamedSolver& solver : contact_solvers()) out.push_back({model, solver});
  }
  return out;
}
inline std::string name_of_choice(const testing::TestParamInfo<ContactChoice>& info) {
  return info.param.model + "_" + info.param.solver.name;
}

// What tests print of a parameter.
inline void PrintTo(const NamedSolver& solver, std::ostream* out) { *out << solver.name; }
inline void PrintTo(const ContactChoice& choice, std::ostream* out) {
  *out << choice.model << " by " << choice.solver.name;
}

}  // namespace graze::test
