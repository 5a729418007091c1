#include "tests/storage/power_failure.h"

#include <fstream>
#include <map>
#include <memory>
#include <stdexcept>

namespace luxfield::disk {
namespace {

struct Node;
using NodePtr = std::shared_ptr<Node>;
using Names = std::map<std::string, NodePtr>;

// A change of a folder's names: `node` under `add`, and no longer under `remove`.
struct NameChange {
  std::string add = {}, remove = {};
  NodePtr node = {};
};

struct BytesChange {
  std::string append = {};
  bool truncate = false;
  std::size_t size = 0;
};

// A file or a folder: as it is on the disk for certain, and what was done to it since.
struct Node {
  bool folder = false;
  Names names;
  std::vector<NameChange> name_changes;
  std::string bytes;
  std::vector<BytesChange> byte_changes;
};

void Apply(const NameChange& change, Names& names) {
  if (!change.remove.empty()) names.erase(change.remove);
  if (!change.add.empty()) names[change.add] = change.node;
}

void Apply(const BytesChange& change, std::string& bytes) {
  if (change.truncate) bytes.resize(change.size);
  bytes += change.append;
}

// The tree while the program runs: everything it did is there.
class Disk {
 public:
  Disk() { root_->folder = true; }

  void Do(const Call& call) {
    switch (call.kind) {
      case Call::Kind::kMark:
        return;
      case Call::Kind::kMakeFolder:
      case Call::Kind::kCreate: {
        auto node = std::make_shared<Node>();
        node->folder = call.kind == Call::Kind::kMakeFolder;
        Change(call.path, {Name(call.path), "", node});
        return;
      }
      case Call::Kind::kWrite:
        Find(call.path)->byte_changes.push_back({call.bytes});
        return;
      case Call::Kind::kTruncate:
        Find(call.path)->byte_changes.push_back({"", true, static_cast<std::size_t>(call.size)});
        return;
      case Call::Kind::kRename:
        Change(call.path, {Name(call.to), Name(call.path), Find(call.path)});
        return;
      case Call::Kind::kRemove:
        Change(call.path, {"", Name(call.path), nullptr});
        return;
      case Call::Kind::kSync: {
        const NodePtr node = Find(call.path);
        for (const NameChange& change : node->name_changes) Apply(change, node->names);
        for (const BytesChange& change : node->byte_changes) Apply(change, node->bytes);
        node->name_changes.clear();
        node->byte_changes.clear();
        return;
      }
    }
  }

  const Node& root() const { return *root_; }

 private:
  static std::string Name(const std::string& path) {
    return std::filesystem::path(path).filename().string();
  }

  NodePtr Find(const std::filesystem::path& path) const {
    NodePtr node = root_;
    for (const auto& part : path) {
      if (part == ".") continue;
      Names now = node->names;
      for (const NameChange& change : node->name_changes) Apply(change, now);
      if (!now.contains(part.string())) throw std::logic_error(path.string() + " is not recorded");
      node = now[part.string()];
    }
    return node;
  }

  void Change(const std::string& path, NameChange change) {
    Find(std::filesystem::path(path).parent_path())->name_changes.push_back(std::move(change));
  }

  NodePtr root_ = std::make_shared<Node>();
};

Names SurvivingNames(const Node& node, Unsynced unsynced, core::Random& random) {
  Names names = node.names;
  for (const NameChange& change : node.name_changes)
    if (unsynced == Unsynced::kKept || unsynced == Unsynced::kOnlyNamesKept ||
        (unsynced == Unsynced::kRandom && random() % 2))
      Apply(change, names);
  return names;
}

std::string SurvivingBytes(const Node& node, Unsynced unsynced, core::Random& random) {
  std::string bytes = node.bytes;
  if (unsynced == Unsynced::kLost || unsynced == Unsynced::kOnlyNamesKept) return bytes;
  for (BytesChange change : node.byte_changes) {
    const bool whole = unsynced != Unsynced::kRandom || random() % 2;
    if (!whole) {
      change.append.resize(random() % (change.append.size() + 1));
      if (random() % 2) change.append.assign(change.append.size(), '\0');
    }
    Apply(change, bytes);
    if (!whole) break;
  }
  return bytes;
}

void Write(const Node& node, Unsynced unsynced, core::Random& random,
           const std::filesystem::path& path) {
  if (!node.folder) {
    std::ofstream(path, std::ios::binary) << SurvivingBytes(node, unsynced, random);
    return;
  }
  std::filesystem::create_directory(path);
  for (const auto& [name, child] : SurvivingNames(node, unsynced, random))
    Write(*child, unsynced, random, path / name);
}

}  // namespace

void FailPower(const std::vector<Call>& calls, std::size_t count, Unsynced unsynced,
               core::Random& random, const std::filesystem::path& folder) {
  Disk disk;
  for (std::size_t k = 0; k < count; ++k) disk.Do(calls[k]);
  Write(disk.root(), unsynced, random, folder);
}

}  // namespace luxfield::disk
