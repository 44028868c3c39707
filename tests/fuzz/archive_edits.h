#pragma once
// Changes of an archive's content that leave it sound HDF5 with a fitting seal: made by the HDF5 library itself, and
// sealed anew. Bytes changed at random would try the library, which does not survive that.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace graze::fuzz {

/// 12 bytes of input: a value of a dataset or an attribute is changed, a dataset replaced by one of another type or
/// shape, an object left out.
struct Edit {
  std::uint8_t kind, object;
  std::uint16_t position;
  std::uint8_t value[8];
};
static_assert(sizeof(Edit) == 12);

/// Applies the edits to the file, which is sealed when it begins and when it ends. False if it is not one that the
/// library opens.
bool edit_archive(const std::filesystem::path& file, std::span<const Edit> edits);
/// Takes the seal off the end of a file and puts a new one there, whatever the content.
void seal_again(const std::filesystem::path& file);

}  // namespace graze::fuzz
