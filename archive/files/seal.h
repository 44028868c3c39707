#pragma once
// The seal of a file: 24 bytes behind the HDF5 data ("GRAZEEND", then length and XXH64 of all before it,
// little-endian). HDF5 ignores what lies behind its own end. A file whose seal does not fit is refused before HDF5
// parses it: cut short, damaged, or changed by another program.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "engine/settings/settings.h"

namespace graze {

/// Whether the seals of shards are to be checked, which reads all of them; trusted: this program has just written them.
enum class Seals { checked, trusted };

/// XXH64 with seed 0 (Collet, xxHash specification 0.1.1), fed piecewise.
class Xxh64 {
 public:
  Xxh64();
  void update(std::span<const std::byte> data);
  std::uint64_t digest() const;

 private:
  std::span<const std::byte> rounds(std::span<const std::byte> data);  // whole stripes; returns the rest
  std::array<std::uint64_t, 4> lane_;
  std::array<std::byte, 32> rest_{};
  std::size_t held_ = 0;  // bytes in rest_
  std::uint64_t length_ = 0;
};

/// What a seal says of the bytes before it.
struct Seal {
  std::uint64_t bytes = 0, digest = 0;
  bool operator==(const Seal&) const = default;
};

/// Reads the file behind `descriptor` from its start and appends the seal, which it stores in `made`. Returns 0 or
/// errno.
int seal_file(int descriptor, Seal* made = nullptr);
/// A file that is not what it was when it was sealed.
struct DamagedFile : InputError {
  using InputError::InputError;
};

/// A file that has neither an archive's beginning nor its end, or that is whole and no archive.
struct ForeignFile : InputError {
  using InputError::InputError;
};

/// Throws InputError unless an open file is an HDF5 file with its seal intact: ForeignFile if it is none; DamagedFile
/// if it has none or it does not fit, UnreadableFile if it cannot be read. `path` is for messages.
Seal check_seal(int descriptor, const std::filesystem::path& path);

}  // namespace graze
