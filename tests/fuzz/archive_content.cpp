// Claim: an archive that is sound HDF5 with a fitting seal, but whose content was changed in any way, is read or
// refused with an InputError or MachineError: offsets that do not rise, indices out of range, missing or reshaped
// datasets, attributes of another value. The input is a list of edits to the seed full.h5.

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "tests/fuzz/archive_edits.h"
#include "tests/fuzz/scratch_archive.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using graze::fuzz::Edit;
  constexpr std::size_t kMostEdits = 8;
  std::vector<Edit> edits(std::min(size / sizeof(Edit), kMostEdits));
  if (!edits.empty()) std::memcpy(edits.data(), data, edits.size() * sizeof(Edit));
  std::filesystem::copy_file(GRAZE_SOURCE_DIR "/tests/fuzz/corpus/archive/full.h5", graze::fuzz::scratch_file(),
                             std::filesystem::copy_options::overwrite_existing);
  if (!graze::fuzz::edit_archive(graze::fuzz::scratch_file(), edits)) std::abort();
  // Untouched, the seed must be accepted: or nothing behind the first check would ever be tried.
  if (!graze::fuzz::read_scratch() && edits.empty()) std::abort();
  return 0;
}
