// check_tree() of hdf5.h.
#include <fmt/format.h>

#include <set>

#include "archive/hdf5/hdf5.h"

namespace graze::hdf5 {
namespace {

constexpr int kDeepest = 64;                 // groups within groups: policies have few slashes
constexpr std::size_t kMostNames = 1 << 20;  // an archive has some thousand

struct Link {
  std::string name;
  H5L_type_t type;
};

class TreeCheck {
 public:
  explicit TreeCheck(std::uint64_t file_bytes) : file_bytes_(file_bytes) {}

  void group(hid_t id, const std::string& path, int depth) {
    if (depth > kDeepest) throw Error(fmt::format("'{}': groups lie more than {} deep", path, kDeepest));
    for (const Link& link : links_of(id, path)) {
      const std::string full = path.empty() ? link.name : path + "/" + link.name;
      if (link.type != H5L_TYPE_HARD) throw Error(fmt::format("'{}' is no hard link; an archive has no others", full));
      object(id, link.name, full, depth);
    }
  }
  void seen(hid_t id, const std::string& path) {
    if (!seen_.insert(info_of(id, path).addr).second) {
      throw Error(fmt::format("'{}' is an object that has another name, too; in an archive each has one", path));
    }
  }

 private:
  static H5O_info_t info_of(hid_t id, const std::string& path) {
    H5O_info_t info{};
    check(H5Oget_info2(id, &info, H5O_INFO_BASIC), path);
    return info;
  }

  std::vector<Link> links_of(hid_t id, const std::string& path) {
    std::vector<Link> out;
    const auto take = [](hid_t, const char* name, const H5L_info_t* info, void* links) -> herr_t {
      auto& all = *static_cast<std::vector<Link>*>(links);
      if (all.size() > kMostNames) return 1;
      all.push_back({name, info->type});
      return 0;
    };
    hsize_t start = 0;
    check(H5Literate(id, H5_INDEX_NAME, H5_ITER_INC, &start, take, &out), path);
    names_ += out.size();
    if (names_ > kMostNames) throw Error(fmt::format("'{}': the file has more than {} objects", path, kMostNames));
    return out;
  }

  void object(hid_t parent, const std::string& name, const std::string& path, int depth) {
    const Handle opened(H5Oopen(parent, name.c_str(), H5P_DEFAULT), H5Oclose, path);
    seen(opened.id(), path);
    switch (info_of(opened.id(), path).type) {
      case H5O_TYPE_GROUP:
        return group(opened.id(), path, depth + 1);
      case H5O_TYPE_DATASET:
        stored_ += H5Dget_storage_size(open_dataset(parent, name).id());
        if (stored_ <= file_bytes_) return;
        throw Error(
            fmt::format("'{}': the datasets claim more than the {} bytes that the file has", path, file_bytes_));
      default:
        throw Error(fmt::format("'{}' is neither a group nor a dataset", path));
    }
  }

  const std::uint64_t file_bytes_;
  std::uint64_t stored_ = 0;
  std::size_t names_ = 0;
  std::set<haddr_t> seen_;
};

}  // namespace

void check_tree(const Handle& file) {
  hsize_t bytes = 0;
  check(H5Fget_filesize(file.id(), &bytes), "file size");
  const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, "/");
  TreeCheck tree(bytes);
  tree.seen(root.id(), "/");
  tree.group(root.id(), "", 0);
}

}  // namespace graze::hdf5
