#include "archive/files/seal.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <vector>

#include "archive/files/files.h"
#include "engine/settings/settings.h"

namespace graze {
namespace {

constexpr std::uint64_t kPrime1 = 0x9E3779B185EBCA87, kPrime2 = 0xC2B2AE3D27D4EB4F, kPrime3 = 0x165667B19E3779F9,
                        kPrime4 = 0x85EBCA77C2B2AE63, kPrime5 = 0x27D4EB2F165667C5;
constexpr std::size_t kStripe = 32;
constexpr std::size_t kSealBytes = 24;
constexpr std::array<unsigned char, 8> kMagic = {'G', 'R', 'A', 'Z', 'E', 'E', 'N', 'D'};
constexpr std::array<unsigned char, 8> kHdf5 = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1A, '\n'};
constexpr std::size_t kHashedAtOnce = std::size_t{1} << 17;  // stays in a core's own cache until it is hashed

template <class T>
T load(const std::byte* from) {
  static_assert(std::endian::native == std::endian::little);
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

std::uint64_t mix(std::uint64_t lane, std::uint64_t input) { return std::rotl(lane + input * kPrime2, 31) * kPrime1; }

std::array<std::byte, kSealBytes> make_seal(const Seal& seal) {
  std::array<std::byte, kSealBytes> out;
  std::memcpy(out.data(), kMagic.data(), 8);
  std::memcpy(out.data() + 8, &seal.bytes, 8);
  std::memcpy(out.data() + 16, &seal.digest, 8);
  return out;
}

/// Hashes the first `length` bytes of a file. Returns 0 or errno; EIO for a file that ends early.
int hash_file(int descriptor, std::uint64_t length, Xxh64& hash) {
  std::vector<std::byte> piece(kHashedAtOnce);
  for (std::uint64_t done = 0; done < length;) {
    const std::size_t wanted = std::min<std::uint64_t>(kHashedAtOnce, length - done);
    const ssize_t got = pread(descriptor, piece.data(), wanted, static_cast<off_t>(done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return got < 0 ? errno : EIO;
    hash.update({piece.data(), static_cast<std::size_t>(got)});
    done += static_cast<std::uint64_t>(got);
  }
  return 0;
}

/// The same of a file that nobody else changes, without copying it; a window at a time, as files may be large.
int hash_own_file(int descriptor, std::uint64_t length, Xxh64& hash) {
  constexpr std::uint64_t kWindow = std::uint64_t{4} << 20;  // whole pages
  for (std::uint64_t done = 0; done < length; done += kWindow) {
    const std::size_t size = std::min(kWindow, length - done);
    void* const bytes = mmap(nullptr, size, PROT_READ, MAP_SHARED | MAP_POPULATE, descriptor, static_cast<off_t>(done));
    if (bytes == MAP_FAILED) {
      hash = Xxh64();
      return hash_file(descriptor, length, hash);
    }
    hash.update({static_cast<const std::byte*>(bytes), size});
    munmap(bytes, size);
  }
  return 0;
}

/// Reads that many bytes. Returns whether there are so many. Throws UnreadableFile.
template <std::size_t N, class Byte>
bool read_at(int descriptor, std::uint64_t offset, std::array<Byte, N>& to, const std::filesystem::path& path) {
  const ssize_t got = pread(descriptor, to.data(), N, static_cast<off_t>(offset));
  if (got < 0) fail_reading(path, errno);
  return got == static_cast<ssize_t>(N);
}

}  // namespace

Xxh64::Xxh64() : lane_{kPrime1 + kPrime2, kPrime2, 0, 0 - kPrime1} {}

/// Four lanes that do not wait for each other, in registers all along.
std::span<const std::byte> Xxh64::rounds(std::span<const std::byte> data) {
  auto [a, b, c, d] = lane_;
  const std::byte* at = data.data();
  std::size_t left = data.size();
  for (; left >= kStripe; left -= kStripe, at += kStripe) {
    a = mix(a, load<std::uint64_t>(at));
    b = mix(b, load<std::uint64_t>(at + 8));
    c = mix(c, load<std::uint64_t>(at + 16));
    d = mix(d, load<std::uint64_t>(at + 24));
  }
  lane_ = {a, b, c, d};
  return {at, left};
}

void Xxh64::update(std::span<const std::byte> data) {
  length_ += data.size();
  if (held_ > 0) {
    const std::size_t taken = std::min(kStripe - held_, data.size());
    std::copy_n(data.begin(), taken, rest_.begin() + static_cast<std::ptrdiff_t>(held_));
    held_ += taken;
    data = data.subspan(taken);
    if (held_ < kStripe) return;
    rounds(rest_);
    held_ = 0;
  }
  data = rounds(data);
  std::copy(data.begin(), data.end(), rest_.begin());
  held_ = data.size();
}

std::uint64_t Xxh64::digest() const {
  std::uint64_t h = kPrime5;
  if (length_ >= kStripe) {
    h = std::rotl(lane_[0], 1) + std::rotl(lane_[1], 7) + std::rotl(lane_[2], 12) + std::rotl(lane_[3], 18);
    for (const std::uint64_t lane : lane_) h = (h ^ mix(0, lane)) * kPrime1 + kPrime4;
  }
  h += length_;
  std::size_t i = 0;
  for (; i + 8 <= held_; i += 8) {
    h = std::rotl(h ^ mix(0, load<std::uint64_t>(&rest_[i])), 27) * kPrime1 + kPrime4;
  }
  for (; i + 4 <= held_; i += 4) {
    h = std::rotl(h ^ (load<std::uint32_t>(&rest_[i]) * kPrime1), 23) * kPrime2 + kPrime3;
  }
  for (; i < held_; ++i) h = std::rotl(h ^ (static_cast<std::uint64_t>(rest_[i]) * kPrime5), 11) * kPrime1;
  h = (h ^ (h >> 33)) * kPrime2;
  h = (h ^ (h >> 29)) * kPrime3;
  return h ^ (h >> 32);
}

int seal_file(int descriptor, Seal* made) {
  const off_t length = lseek(descriptor, 0, SEEK_END);
  if (length < 0) return errno;
  Xxh64 hash;
  if (const int error = hash_own_file(descriptor, static_cast<std::uint64_t>(length), hash); error != 0) return error;
  const Seal seal{static_cast<std::uint64_t>(length), hash.digest()};
  if (made != nullptr) *made = seal;
  return write_all(descriptor, make_seal(seal));
}

Seal check_seal(int descriptor, const std::filesystem::path& path) {
  std::array<unsigned char, 8> head{};
  const bool begins = read_at(descriptor, 0, head, path) && head == kHdf5;
  const off_t size = lseek(descriptor, 0, SEEK_END);
  const auto length = static_cast<std::uint64_t>(std::max<off_t>(size, kSealBytes)) - kSealBytes;
  std::array<std::byte, kSealBytes> found{};
  const bool ends =
      read_at(descriptor, length, found, path) && std::memcmp(found.data(), kMagic.data(), kMagic.size()) == 0;
  if (!begins) {
    const std::string text = path.string() + ": is not an HDF5 file; give a campaign directory or a packed file";
    if (ends) throw InputError(text);
    throw ForeignFile(text);
  }
  if (!ends) {
    throw DamagedFile(
        path.string() +
        ": is no Graze archive, or not a whole one: its closing checksum is missing; it was cut short, or "
        "written by another program");
  }
  Xxh64 hash;
  if (const int error = hash_file(descriptor, length, hash); error != 0) fail_reading(path, error);
  const Seal seal{length, hash.digest()};
  if (found != make_seal(seal)) {
    throw DamagedFile(path.string() + ": is damaged: its content does not fit its checksum");
  }
  return seal;
}

}  // namespace graze
