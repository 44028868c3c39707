// Claim: any file either is an archive, of which all can be read, or is refused with an InputError or MachineError. A
// changed byte breaks the seal, so what lies behind it is the matter of archive_content.cpp.

#include "tests/fuzz/scratch_archive.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  graze::fuzz::write_scratch(data, size);
  graze::fuzz::read_scratch();
  return 0;
}
