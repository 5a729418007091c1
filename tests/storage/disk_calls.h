// The disk as core/ uses it, seen at its system calls: the linker puts these wrappers in the place
// of libc's (CMakeLists.txt, --wrap), for our own code and not for libraries. They record what is
// asked of the disk, and make a call fail.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace luxfield::disk {

struct Call {
  enum class Kind {
    kMakeFolder,
    kCreate,
    kWrite,
    kTruncate,
    kSync,  // of a file's bytes, or of a folder's names
    kRename,
    kRemove,
    kMark,  // of the test's own: what the program was told is done
  };
  Kind kind;
  std::string path = {};   // below the recorded root; of a file that is open, as it was opened
  std::string to = {};     // kRename
  std::string bytes = {};  // kWrite (appended); kMark: its text
  off_t size = 0;          // kTruncate
};

// What `work` asks of the disk below `root`, in order; what was there before counts as durable.
std::vector<Call> Record(const std::filesystem::path& root, const std::function<void()>& work);
void Mark(const std::string& text);

// How a call fails: `error` is an errno, or a write is cut short.
struct Fault {
  int error = 0;         // 0: half of a write's bytes are written, and the call says so
  bool lasting = false;  // every later call that changes the disk fails too
};
// The n-th call from now on fails, n >= 0; until ClearFault.
void FailCall(int n, const Fault& fault);
// Returns how many calls were made since FailCall, and its name if it was reached.
struct Reached {
  int calls = 0;
  std::string failed;  // "fsync"; empty: FailCall's call was not reached
};
Reached ClearFault();

}  // namespace luxfield::disk
