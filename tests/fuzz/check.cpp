// Claim: `graze check` says something of any scenario with any robot and any mesh. The input is a bundle of files; the
// first is the scenario. The mutator changes each by its kind: settings and URDF as trees, meshes as bytes.

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/fuzz/bundle.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/verbs.h"
#include "tests/fuzz/xml_mutator.h"
#include "tests/fuzz/yaml_mutator.h"

namespace {

namespace fs = std::filesystem;

/// One folder per process, since targets run side by side.
const fs::path& scratch() {
  static const fs::path folder = fs::temp_directory_path() / ("graze_fuzz_check_" + std::to_string(getpid()));
  return folder;
}

std::string mutated(const std::string& name, const std::string& content, std::size_t most, graze::fuzz::Dice& dice) {
  const std::string kind = fs::path(name).extension().string();
  if (!dice.one_in(10)) {
    if (kind == ".yaml") return graze::fuzz::mutated_yaml(content, dice);
    if (kind == ".urdf") return graze::fuzz::mutated_xml(content, dice);
  }
  return graze::fuzz::mutated_bytes(content, most);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  std::atexit([] { fs::remove_all(scratch()); });
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto files = graze::fuzz::files_of({reinterpret_cast<const char*>(data), size});
  if (files.empty()) return 0;
  fs::remove_all(scratch());
  fs::create_directories(scratch());
  for (const auto& [name, content] : files) std::ofstream(scratch() / name, std::ios::binary) << content;
  graze::fuzz::run_verb({"check", (scratch() / files[0].first).string()});
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  graze::fuzz::Dice dice(seed);
  auto files = graze::fuzz::files_of({reinterpret_cast<const char*>(data), size});
  if (files.empty() || dice.one_in(20)) return LLVMFuzzerMutate(data, size, most);
  auto& [name, content] = files[dice.below(files.size())];
  content = mutated(name, content, std::min(most, content.size() + 100), dice);
  return graze::fuzz::put(graze::fuzz::bundle_of(files), data, size, most);
}
