#pragma once
// Everything that is wrong with one URDF file. Its readers tell what they find here and go on with a stand-in, so that
// a user sees all problems at once; what can be repaired they have repaired in the document when they tell it.

#include <string>
#include <vector>

namespace graze {

class UrdfProblems {
 public:
  /// `name` stands for the file in messages. `repairing`: repairs are wanted, and are no problem.
  UrdfProblems(std::string name, bool repairing) : name_(std::move(name)), repairing_(repairing) {}

  /// A problem that nothing but the user's hand can mend. `what`: the link or joint, the value and the rule.
  void refuse(int line, const std::string& what);
  /// A problem that is now repaired in the document; `how` says by what, in the third person: "takes the first 3".
  void repair(int line, const std::string& what, const std::string& how);
  /// A problem that makes what else could be said of the file guesswork. Throws InputError with all so far.
  [[noreturn]] void stop(int line, const std::string& what);
  /// No problem, but worth a word.
  void warn(const std::string& text) { warnings_.push_back(text); }
  /// The same of a value that is taken as it stands, and was hardly meant so. Of very many the rest is left out.
  void doubt(int line, const std::string& what);

  /// How many problems cannot be repaired.
  std::size_t refused() const { return refused_; }
  /// Whether the document has been changed.
  bool changed() const { return problems_.size() > refused_; }
  /// Throws InputError with all problems (when repairing: those that cannot be repaired) if there are any.
  void raise() const;
  /// One line for each repair: "file:line: what; repaired: how". Of very many the rest is counted.
  std::vector<std::string> repairs() const;
  const std::vector<std::string>& warnings() const { return warnings_; }
  const std::string& name() const { return name_; }

 private:
  struct Problem {
    int line;
    std::string what, how;  // how: empty where there is no repair
  };
  std::string told(const Problem& problem) const;

  std::string name_;
  bool repairing_;
  std::size_t refused_ = 0, doubts_ = 0;
  std::vector<Problem> problems_;  // in the order in which they were found
  std::vector<std::string> warnings_;
};

}  // namespace graze
