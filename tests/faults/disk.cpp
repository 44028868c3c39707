#include "tests/faults/disk.h"

#include <sys/stat.h>

#include <algorithm>
#include <stdexcept>

namespace graze::faults {
namespace {

std::uint64_t inode_of(const fs::path& path) {
  struct stat found {};
  return lstat(path.c_str(), &found) == 0 ? found.st_ino : 0;
}

/// A write or a truncate.
void act(const Change& change, std::string& content) {
  if (change.kind == Change::Kind::truncate) {
    content.resize(change.offset, '\0');
    return;
  }
  const std::size_t end = change.offset + change.data.size();
  if (content.size() < end) content.resize(end, '\0');
  content.replace(change.offset, change.data.size(), change.data);
}

}  // namespace

Disk::Disk(const fs::path& root) : root_(fs::canonical(root).string()) {
  add(true, inode_of(root_));
  load(root_, 0);
}

void Disk::load(const fs::path& folder, int node) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    const int child = add(entry.is_directory(), inode_of(entry.path()));
    const std::string name = entry.path().filename().string();
    nodes_[node].names[name] = nodes_[node].safe_names[name] = child;
    if (entry.is_directory()) {
      load(entry.path(), child);
    } else {
      nodes_[child].safe = testing::read_file(entry.path());
    }
  }
}

int Disk::add(bool directory, std::uint64_t inode) {
  nodes_.push_back({});
  nodes_.back().directory = directory;
  const int node = static_cast<int>(nodes_.size()) - 1;
  by_inode_[inode] = node;
  return node;
}

int Disk::node_of(std::uint64_t inode) {
  const auto found = by_inode_.find(inode);
  return found != by_inode_.end() ? found->second : add(false, inode);  // a file that had no name at first
}

std::pair<int, std::string> Disk::place_of(const std::string& path) const {
  if (path.compare(0, root_.size(), root_) != 0) throw std::logic_error(path + ": is not below " + root_);
  int node = 0;
  const fs::path below = fs::path(path.substr(std::min(path.size(), root_.size() + 1))).lexically_normal();
  for (const fs::path& part : below.parent_path()) node = nodes_[node].names.at(part.string());
  return {node, below.filename().string()};
}

int Disk::node_at(const std::string& path) const {
  const auto [directory, name] = place_of(path);
  const auto found = nodes_[directory].names.find(name);
  return found == nodes_[directory].names.end() ? -1 : found->second;
}

void Disk::step(const std::string& from, const std::string& to, int node) {
  Step step;
  if (!from.empty()) std::tie(step.from, step.old_name) = place_of(from);
  if (!to.empty()) std::tie(step.to, step.new_name) = place_of(to);
  step.node = node;
  if (step.from >= 0) nodes_[step.from].names.erase(step.old_name);
  if (step.to >= 0) nodes_[step.to].names[step.new_name] = node;
  steps_.push_back(std::move(step));
}

void Disk::apply(const Step& step, std::vector<std::map<std::string, int>>& names) {
  if (step.from >= 0) names[step.from].erase(step.old_name);
  if (step.to >= 0) names[step.to][step.new_name] = step.node;
}

/// What was done to a directory is safe, and so are the bytes of a file.
void Disk::sync(int node) {
  Node& own = nodes_[node];
  for (const Change& change : own.unsafe) act(change, own.safe);
  own.unsafe.clear();
  std::vector<Step> left;
  for (Step& step : steps_) {
    if ((step.to >= 0 ? step.to : step.from) != node) {
      left.push_back(std::move(step));
      continue;
    }
    if (step.from >= 0) nodes_[step.from].safe_names.erase(step.old_name);
    if (step.to >= 0) nodes_[step.to].safe_names[step.new_name] = step.node;
  }
  steps_ = std::move(left);
}

void Disk::apply(const Change& change) {
  using Kind = Change::Kind;
  switch (change.kind) {
    case Kind::create:
      step("", change.path, add(false, change.inode));
      break;
    case Kind::make_directory:
      step("", change.path, add(true, change.inode));
      break;
    case Kind::link:
      step("", change.path, node_of(change.inode));
      break;
    case Kind::rename:
      step(change.path, change.to, node_at(change.path));
      break;
    case Kind::unlink:
      step(change.path, "", -1);
      break;
    case Kind::write:
    case Kind::truncate:
      nodes_[node_of(change.inode)].unsafe.push_back(change);
      break;
    case Kind::sync:
      sync(node_of(change.inode));
      break;
  }
}

Tree Disk::after_power_cut(Luck luck, std::mt19937& random) const {
  const auto toss = [&] { return random() % 2 == 0; };
  std::vector<std::map<std::string, int>> names;
  std::vector<std::string> contents;
  for (const Node& node : nodes_) {
    names.push_back(node.safe_names);
    std::string content = node.safe, whole = node.safe;
    for (const Change& change : node.unsafe) act(change, whole);
    if (luck == Luck::zeros) content.resize(std::max(content.size(), whole.size()), '\0');
    const bool grows = luck == Luck::any && toss();
    if (grows) content.resize(std::max(content.size(), whole.size()), '\0');
    for (const Change& change : node.unsafe) {
      if (luck == Luck::all || (luck == Luck::any && toss())) act(change, content);
    }
    contents.push_back(std::move(content));
  }
  const std::size_t moment = steps_.empty() ? 0 : random() % (steps_.size() + 1);
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const bool kept = luck == Luck::none       ? false
                      : luck == Luck::any      ? toss()
                      : luck == Luck::in_order ? i < moment
                                               : true;
    if (kept) apply(steps_[i], names);
  }
  Tree tree;
  list(names, contents, 0, "", tree);
  return tree;
}

void Disk::list(const std::vector<std::map<std::string, int>>& names, const std::vector<std::string>& contents,
                int node, const std::string& prefix, Tree& tree) const {
  for (const auto& [name, child] : names[node]) {
    if (nodes_[child].directory) {
      tree[prefix + name + "/"] = "";
      list(names, contents, child, prefix + name + "/", tree);
    } else {
      tree[prefix + name] = contents[child];
    }
  }
}

}  // namespace graze::faults
