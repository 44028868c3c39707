#include "archive/hdf5/text_spool.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>

#include "archive/files/files.h"
#include "archive/files/seal.h"

namespace graze {
namespace {

constexpr std::size_t kPending = std::size_t{1} << 20;

Descriptor open_nameless(const std::filesystem::path& path) {
  const Directory folder = Directory::of_new(path);
  remove_abandoned(folder, path.filename().string());  // a process may be killed between the next two calls
  std::string temporary;
  Descriptor file = folder.create_temporary(path.filename().string(), temporary);
  folder.remove(temporary);
  return file;
}

/// Reads a file from its start, some bytes at a time.
class Reader {
 public:
  Reader(int descriptor, const std::filesystem::path& path) : descriptor_(descriptor), path_(path) {}
  void read(void* to, std::size_t size) {
    auto* out = static_cast<char*>(to);
    while (size > 0) {
      if (at_ == held_) refill();
      const std::size_t count = std::min(size, held_ - at_);
      std::memcpy(out, buffer_.data() + at_, count);
      at_ += count;
      out += count;
      size -= count;
    }
  }

 private:
  void refill() {
    const ssize_t got = pread(descriptor_, buffer_.data(), buffer_.size(), static_cast<off_t>(offset_));
    if (got <= 0) fail_writing(path_, got < 0 ? errno : EIO);
    offset_ += static_cast<std::uint64_t>(got);
    held_ = static_cast<std::size_t>(got);
    at_ = 0;
  }
  int descriptor_;
  const std::filesystem::path& path_;
  std::string buffer_ = std::string(kPending, '\0');
  std::uint64_t offset_ = 0;
  std::size_t held_ = 0, at_ = 0;
};

}  // namespace

TextSpool::TextSpool(const std::filesystem::path& beside)
    : path_(beside.string() + ".texts"), file_(open_nameless(path_)) {}

std::uint32_t TextSpool::number(const std::string& text) {
  Xxh64 hash;
  hash.update(std::as_bytes(std::span(text)));
  const auto fresh = static_cast<std::uint32_t>(numbers_.size());
  const auto [entry, inserted] = numbers_.emplace(Key{hash.digest(), std::hash<std::string>()(text)}, fresh);
  if (inserted) {
    const auto size = static_cast<std::uint32_t>(text.size());
    pending_.append(reinterpret_cast<const char*>(&size), sizeof size).append(text);
    if (pending_.size() >= kPending) flush();
  }
  return entry->second;
}

void TextSpool::flush() {
  if (const int error = write_all(file_.number(), std::as_bytes(std::span(pending_)))) fail_writing(path_, error);
  pending_.clear();
}

void TextSpool::write(const hdf5::Handle& file, const char* dataset) {
  constexpr std::uint64_t kPiece = 4096;
  flush();
  Reader reader(file_.number(), path_);
  hdf5::StringColumn column(file.id(), dataset, numbers_.size());
  for (std::uint64_t first = 0; first < numbers_.size(); first += kPiece) {
    std::vector<std::string> texts(std::min<std::uint64_t>(kPiece, numbers_.size() - first));
    for (std::string& text : texts) {
      std::uint32_t size = 0;
      reader.read(&size, sizeof size);
      text.resize(size);
      reader.read(text.data(), size);
    }
    column.write(first, texts);
  }
}

}  // namespace graze
